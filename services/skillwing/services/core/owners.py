"""Rules of owners: a goal stops when its owner is gone for longer than its grace."""

from __future__ import annotations

from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.core.goal_states import GoalRun
from skillwing.services.core.skill_events import OwnerGone, StopRequested
from skillwing.services.names import CLIENT, SEPARATOR, skill_process
from skillwing.services.protocol import NodesExited

EXITS_REMEMBERED = 100
UNDER_WAY = 2.0
"""Robot time in seconds by which a start may arrive after the exit of its owner's process."""


class ProcessExits:
    """The latest exits of processes, by the names of their nodes, as the launcher reports them."""

    def __init__(self) -> None:
        self._latest: BoundedDict[str, NodesExited] = BoundedDict(EXITS_REMEMBERED)

    def note(self, exited: NodesExited) -> None:
        for node in exited.nodes:
            self._latest[node] = exited

    def of_owner(self, owner: str) -> NodesExited | None:
        """The exit of the process of an owner's client: of that name, or of the skill of that name."""
        client = owner.removeprefix(CLIENT).rpartition(SEPARATOR)[2].rpartition("-")[0]
        return self._latest.get(client) or self._latest.get(skill_process(client))


def owner_grace(run: GoalRun | None, owner: str) -> float:
    """Wall time in seconds for which the current goal runs on without this owner; 0 if the goal is not its own.

    `OwnerGone` is due once the owner's alive token was away for that long, after it counts as gone.
    """
    return run.owner_grace if run is not None and run.owner == owner else 0.0


def stop_without(event: OwnerGone, run: GoalRun) -> StopRequested:
    """The request to stop a goal whose owner has stayed away. Its cause is an exit, but none from before the goal."""
    grace = f", and has not come back within {run.owner_grace:g} s" if run.owner_grace else ""
    exited = event.exited
    cause = exited.record if exited is not None and exited.t >= run.started_at - UNDER_WAY else None
    return StopRequested(f"Its owner {event.owner.removeprefix(CLIENT)} is gone{grace}.", cause)
