"""What a verdict of the resource manager means to those who wait for a goal."""

from __future__ import annotations

from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Ending, Lost, Terminal, Violated


def terminal_of(verdict: Violated | Lost) -> Terminal:
    """The terminal answer of a goal that the resource manager has ended."""
    if isinstance(verdict, Lost):
        return Terminal(ending=Ending.LOST, reason=verdict.reason, detected_by=RESOURCE_MANAGER)
    return Terminal(
        ending=Ending.INVARIANT_VIOLATED,
        reason=verdict.reason,
        invariant=verdict.invariant,
        subject=verdict.subject,
    )
