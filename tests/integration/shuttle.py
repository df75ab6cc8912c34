"""A skillset of one skill and one resource, for tests of routers and keys."""

from __future__ import annotations

SHUTTLE = """
skillset shuttle {
    resource bay { initial FREE  FREE -> USED  USED -> FREE }
    skill go {
        effect { take: bay -> USED  give: bay -> FREE }
        precondition { free: resource=(bay == FREE)  success take }
        result { success THERE: apply=give }
    }
}
"""
