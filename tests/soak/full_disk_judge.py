"""Promises of an outage on mocks: how goals may end, and what may be missing. Pure.

Times are robot times in seconds. A killed resource manager or skill may fail goals until it is back and its resources
are free again. The manager of a goal that has ended tells that again after at most 1 s, and waits 2 s for an answer.
Until then its resources are taken, and another start is refused as `NR`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from skillwing.services.history.files import GOALS_FILE
from skillwing.services.history.recording_state import Gap
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import Ending

AFTER_RETURN = 3.0
"""Longest time from the return of a killed process to the end of a goal that may fail of it."""
NOTICED_WITHIN = 2.0
"""Longest time from the first lost line to the begin of its gap: the recorder looks once a second."""
RESOURCE_MANAGER_AWAY = (Ending.ERROR, Ending.NOT_READY)
"""Endings of goals whose resource manager was away: `ERROR` after 5.6 s, and `NR` for taken resources."""


@dataclass(frozen=True, kw_only=True)
class EndedGoal:
    """A goal that has ended. t: when its client learned of it. recorded: its end is in the files."""

    skill: str
    t: float
    success: bool
    ending: str
    reason: str = ""
    recorded: bool = True


@dataclass(frozen=True, kw_only=True)
class Kill:
    """A process that was killed at a time; back: when `status` saw another one run, None if it never did."""

    process: str
    at: float
    back: float | None

    def excuses(self, goal: EndedGoal) -> bool:
        """True if the goal may have failed of this kill."""
        if self.back is None or not self.at <= goal.t <= self.back + AFTER_RETURN:
            return False
        if self.process == RESOURCE_MANAGER:
            return goal.ending in RESOURCE_MANAGER_AWAY
        return self.process == skill_process(goal.skill) and goal.ending == Ending.LOST


def failure_sentences(goals: Iterable[EndedGoal], kill: Kill | None) -> list[str]:
    """A sentence for each way in which goals failed that no kill excuses."""
    found: dict[tuple[str, str], list[EndedGoal]] = {}
    for goal in goals:
        if not goal.success and not (kill is not None and kill.excuses(goal)):
            found.setdefault((goal.skill, goal.ending), []).append(goal)
    return [_failure(failed, kill) for failed in found.values()]


def _failure(failed: Sequence[EndedGoal], kill: Kill | None) -> str:
    first = failed[0]
    count = "A goal" if len(failed) == 1 else f"{len(failed)} goals"
    when = "" if kill is None else f", {first.t - kill.at:.1f} s after the kill"
    why = f": {first.reason}" if first.reason else "."
    return f"{count} of {first.skill} ended with {first.ending}{when}{why}"


def missing_sentences(goals: Collection[EndedGoal], gaps: Sequence[Gap]) -> list[str]:
    """A sentence for goals without a line in the files, of which no gap tells. gaps: of this outage."""
    missing = [goal for goal in goals if not goal.recorded]
    outside = [goal for goal in missing if not any(_within(goal.t, gap) for gap in gaps)]
    problems: list[str] = []
    if outside:
        problems.append(
            f"{len(outside)} goals that ended from {outside[0].t:.1f} s to {outside[-1].t:.1f} s are missing, "
            "and no gap has that time."
        )
    told = sum(gap.lost.get(GOALS_FILE, 0) for gap in gaps)
    if told < len(missing):
        problems.append(f"{len(missing)} goals are missing, and the gaps name {told} lines of `{GOALS_FILE}`.")
    return problems


def _within(t: float, gap: Gap) -> bool:
    return gap.begin - NOTICED_WITHIN <= t and (gap.end is None or t <= gap.end)
