"""A skillset of two skills and one resource, for tests of whole systems and of their layouts."""

from __future__ import annotations

PUMP = """
skillset pump {
    data { pressure: float64 [Pa] period=0.2 }
    resource valve { initial SHUT  SHUT -> OPEN  OPEN -> SHUT }
    skill fill {
        effect { open: valve -> OPEN  shut: valve -> SHUT }
        precondition { shut: resource=(valve == SHUT)  success open }
        interrupt { apply=shut }
        result { success FULL: apply=shut }
    }
    skill drain { result { success EMPTY } }
}
"""
