"""Rules of owners: a goal stops when its owner is gone for longer than its grace."""

from __future__ import annotations

from skillwing.services.core.goal_states import GoalRun
from skillwing.services.core.skill_events import StopRequested
from skillwing.services.names import CLIENT


def owner_grace(run: GoalRun | None, owner: str) -> float:
    """Wall time in seconds for which the current goal runs on without this owner; 0 if the goal is not its own.

    `OwnerGone` is due once the owner's alive token was away for that long, after it counts as gone.
    """
    return run.owner_grace if run is not None and run.owner == owner else 0.0


def stop_without(owner: str, run: GoalRun) -> StopRequested:
    """The request to stop a goal whose owner has stayed away."""
    grace = f", and has not come back within {run.owner_grace:g} s" if run.owner_grace else ""
    return StopRequested(f"Its owner {owner.removeprefix(CLIENT)} is gone{grace}.")
