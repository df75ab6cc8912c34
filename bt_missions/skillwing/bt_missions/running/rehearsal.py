"""Building a mission without a robot, to see whether it would fit one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NoReturn

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skills import Goal
from skillwing.bt_missions.running.misfit import Misfit
from skillwing.bt_missions.running.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.running.preflight import preflight
from skillwing.dsl.model import Skillset
from skillwing.services.protocol import DataReading


class NoRobot:
    """An interface to nothing: no state and no datum is known, and nothing can be started."""

    ready = False
    states: Mapping[str, str] = {}

    def state(self, resource: str) -> str | None:
        return None

    def change_record(self, resource: str) -> str | None:
        return None

    def reading(self, datum: str) -> DataReading:
        return DataReading(name=datum, value=None, t=None, age=None, stale=True)

    def start(self, skill: str, inputs: Mapping[str, Any] | None = None, *, cause: str | None = None) -> Goal:
        self._refuse(f"start {skill}")

    def interrupt(self, goal: Any, *, cause: str | None = None) -> None:
        self._refuse(f"interrupt {goal.skill}")

    def _refuse(self, what: str) -> NoReturn:
        raise RuntimeError(f"The mission wants to {what} while it is built; do that in a leaf.")


def grounded_context(skillset: Skillset) -> MissionContext:
    """What trees can be built with, and not flown."""

    def write_nothing(subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        return ""

    return MissionContext(NoRobot(), skillset, lambda: 0.0, write_nothing)


def drafted(mission: Mission, context: MissionContext, options: MissionOptions) -> tuple[MissionTrees, list[Misfit]]:
    """The trees of a mission, and everything in it that does not fit the robot of this context, by place. It is the
    same list before a flight and at its start."""
    trees, misfits = mission.draft(context, options)
    misfits += preflight(mission, trees, context.skillset)
    return trees, sorted(dict.fromkeys(misfits), key=_where)


def rehearse(mission: Mission, skillset: Skillset, options: MissionOptions) -> list[Misfit]:
    """Everything in a mission that does not fit this skillset with these options, with its place where it is known."""
    return drafted(mission, grounded_context(skillset), options)[1]


def _where(misfit: Misfit) -> tuple[str, int]:
    file, _, line = (misfit.place or "").rpartition(":")
    return (file, int(line)) if line.isdecimal() else (misfit.place or "", 0)
