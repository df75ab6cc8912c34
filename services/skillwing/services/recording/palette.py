"""One set of colours for everything people look at: green success, red failure, grey interrupted, blue running."""

from __future__ import annotations

from skillwing.services.history.history import Outcome

GREEN = "#2e9e4f"
RED = "#d64545"
GREY = "#9aa0a6"
BLUE = "#3b82f6"
AMBER = "#e69f00"
INK = "#24292f"
NIGHT = (27, 31, 38)
"""Background of drawn panels, as RGB."""

OUTCOME_COLOURS = {
    Outcome.RUNNING: BLUE,
    Outcome.SUCCESS: GREEN,
    Outcome.FAILURE: RED,
    Outcome.INTERRUPTED: GREY,
}

TREE_COLOURS = {"RUNNING": BLUE, "SUCCESS": GREEN, "FAILURE": RED}
"""By status; a node that is not visited has `REST`, or `GAVE_UP` if it failed the last time it was."""
REST = "#555d68"
GAVE_UP = "#7d3a3e"

CALM = "#cfe3d4"
"""A resource that needs no attention."""
_BAD = ("FAIL", "CRITICAL", "DIVERGED", "LOST", "UNAVAILABLE")
_DOUBTFUL = ("UNKNOWN", "INVALID", "LOW", "DEGRADED")
_BUSY = ("#8fb8ee", "#c3a3e3", "#76c7c0", "#d9b38c")

STATE_COLOURS = {
    "at rest, or well": (CALM,),
    "another state": _BUSY,
    "in doubt, or low": (AMBER,),
    "failed, lost or critical": (RED,),
}
"""What the colours of a resource's states say."""


def is_trouble(state: str) -> bool:
    """Something failed, was lost or is critical."""
    return state.startswith(_BAD)


def state_colours(states: tuple[str, ...], initial: str) -> dict[str, str]:
    """A colour for each state of a resource: names of trouble are red or amber, others tell states apart.

    The first harmless state, or the initial one if that is harmless, is pale: it is the one that needs no attention.
    """
    colours: dict[str, str] = {}
    harmless = [state for state in states if not state.startswith(_BAD + _DOUBTFUL)]
    resting = initial if initial in harmless else next(iter(harmless), None)
    busy = iter(_BUSY * len(states))
    for state in states:
        if is_trouble(state):
            colours[state] = RED
        elif state.startswith(_DOUBTFUL):
            colours[state] = AMBER
        else:
            colours[state] = CALM if state == resting else next(busy)
    return colours


def rgba(colour: str, alpha: int = 255) -> int:
    """`#rrggbb` as the 0xRRGGBBAA number that Rerun takes."""
    return int(colour.lstrip("#"), 16) << 8 | alpha
