"""One palette for all pictures: green success, red failure, grey interrupted, blue running."""

from __future__ import annotations

from skillwing.services.history.history import GoalOutcome

GREEN = "#2e9e4f"
RED = "#d64545"
GREY = "#9aa0a6"
BLUE = "#3b82f6"
AMBER = "#e69f00"
INK = "#24292f"
NIGHT = (27, 31, 38)
"""Background of drawn panels, as RGB."""

OUTCOME_COLOURS = {
    GoalOutcome.RUNNING: BLUE,
    GoalOutcome.SUCCESS: GREEN,
    GoalOutcome.FAILURE: RED,
    GoalOutcome.INTERRUPTED: GREY,
}

TREE_COLOURS = {"RUNNING": BLUE, "SUCCESS": GREEN, "FAILURE": RED}
"""Colours by status. A node that is not visited has `REST`, or `GAVE_UP` if it failed at its last visit."""
REST = "#555d68"
GAVE_UP = "#7d3a3e"

NEUTRAL = "#cfe3d4"
"""A resource that needs no attention."""
_BAD = ("FAIL", "CRITICAL", "DIVERGED", "LOST", "UNAVAILABLE")
_DEGRADED = ("UNKNOWN", "INVALID", "LOW", "DEGRADED")
_BUSY = ("#8fb8ee", "#c3a3e3", "#76c7c0", "#d9b38c")

STATE_COLOURS = {
    "at rest, or well": (NEUTRAL,),
    "another state": _BUSY,
    "unknown, or low": (AMBER,),
    "failed, lost or critical": (RED,),
}
"""Meanings of the colours of a resource's states."""


def is_trouble(state: str) -> bool:
    """True for the name of a state that is failed, lost or critical."""
    return state.startswith(_BAD)


def state_colours(states: tuple[str, ...], initial: str) -> dict[str, str]:
    """A colour for each state of a resource: red or amber for names of trouble, distinct colours for others.

    The first harmless state, or the initial one if that is harmless, is pale: it needs no attention.
    """
    colours: dict[str, str] = {}
    harmless = [state for state in states if not state.startswith(_BAD + _DEGRADED)]
    resting = initial if initial in harmless else next(iter(harmless), None)
    busy = iter(_BUSY * len(states))
    for state in states:
        if is_trouble(state):
            colours[state] = RED
        elif state.startswith(_DEGRADED):
            colours[state] = AMBER
        else:
            colours[state] = NEUTRAL if state == resting else next(busy)
    return colours


def rgba(colour: str, alpha: int = 255) -> int:
    """`#rrggbb` as Rerun's number 0xRRGGBBAA."""
    return int(colour.lstrip("#"), 16) << 8 | alpha
