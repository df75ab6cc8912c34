"""Check of a mission without a robot: build its trees, and list all problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from skillwing.bt_missions.checking.preflight import preflight
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem, problem_of_exception
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer
from skillwing.services.protocol import DataReading
from skillwing.services.rescue_goal import RescueGoal


class OfflineInterface:
    """A `RobotInterface` without a robot: no state and no datum is known, and nothing can be started."""

    ready = False
    states: Mapping[str, str] = {}

    def state(self, resource: str) -> str | None:
        return None

    def change_record(self, resource: str) -> str | None:
        return None

    def reading(self, datum: str) -> DataReading:
        return DataReading(name=datum, value=None, t=None, age=None, stale=True)

    def ask_ready(
        self, skill: str, on_answer: Callable[[Answer], None], inputs: Mapping[str, Any] | None = None
    ) -> None:
        self._refuse(f"ask whether {skill} may start")

    def start(self, skill: str, inputs: Mapping[str, Any] | None = None, *, cause: str | None = None) -> GoalView:
        self._refuse(f"start {skill}")

    def interrupt(self, goal: Any, *, cause: str | None = None) -> None:
        self._refuse(f"interrupt {goal.skill}")

    def _refuse(self, what: str) -> NoReturn:
        raise RuntimeError(f"The mission wants to {what} while it is built; do that in a leaf.")


def offline_context(skillset: Skillset, goal: RescueGoal | None = None) -> MissionContext:
    """Context with which trees can be built, but not run."""

    def write_nothing(subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        return ""

    return MissionContext(OfflineInterface(), skillset, lambda: 0.0, write_nothing, goal)


def draft_and_check(
    mission: Mission, context: MissionContext, options: MissionOptions
) -> tuple[MissionTrees, list[MissionProblem]]:
    """The trees of a mission, and all problems with the robot of this context, by place."""
    trees, problems = mission.draft(context, options)
    return trees, _all_problems(mission, trees, problems, context)


def check_mission(
    mission: Mission, skillset: Skillset, options: MissionOptions, goal: RescueGoal | None = None
) -> list[MissionProblem]:
    """All problems of a mission with these options and this robot, by place. An exception is a problem as well.

    goal: rescue goal of the robot, if it has one.
    """
    context = offline_context(skillset, goal)
    when = "while it is built"
    try:
        trees, problems = mission.draft(context, options)
        when = "while it is checked"
        return _all_problems(mission, trees, problems, context)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - code of users may raise anything
        return [problem_of_exception(mission.file, error, when)]


def require_fit(mission: Mission, skillset: Skillset, options: MissionOptions, goal: RescueGoal | None = None) -> None:
    """Raise FaultyMissionError with all problems of a mission with the robot that runs, if there are any."""
    problems = check_mission(mission, skillset, options, goal)
    if problems:
        heading = f"Mission `{mission.name}` does not fit `{skillset.name}`, which is what runs here:"
        raise FaultyMissionError(problems, heading=heading)


def _all_problems(
    mission: Mission, trees: MissionTrees, found: list[MissionProblem], context: MissionContext
) -> list[MissionProblem]:
    ours = preflight(mission, trees, context.skillset, context.rescue_goal)
    return sorted(dict.fromkeys([*found, *ours]), key=_place)


def _place(problem: MissionProblem) -> tuple[str, int]:
    file, _, line = (problem.place or "").rpartition(":")
    return (file, int(line)) if line.isdecimal() else (problem.place or "", 0)
