"""Check of a mission without a robot: build its trees, and list all problems."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn

from skillwing.bt_missions.checking.preflight import preflight
from skillwing.bt_missions.leaves.context import MissionContext, MissionNotes
from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.bt_missions.leaves.robot_group import RobotGroup
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem, problem_of_exception
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.dsl.model import Skillset
from skillwing.dsl.suggest import listed
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


def offline_context(
    skillset: Skillset, goal: RescueGoal | None = None, robot: str = "", notes: MissionNotes | None = None
) -> MissionContext:
    """Context with which trees can be built, but not run. robot, notes: in a mission on several robots."""

    def write_nothing(subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        return ""

    return MissionContext(OfflineInterface(), skillset, lambda: 0.0, write_nothing, goal, robot=robot, notes=notes)


def offline_contexts(robots: Mapping[str, RobotModel]) -> MissionContext:
    """The same for these robots; the only one has an empty name."""
    if set(robots) == {""}:
        return offline_context(robots[""].skillset, robots[""].rescue_goal)
    notes = MissionNotes()
    contexts = {name: offline_context(model.skillset, model.rescue_goal, name, notes) for name, model in robots.items()}

    def write_nothing(
        subject: str, before: str | None, after: str, text: str, causes: Mapping[str, str | None]
    ) -> Mapping[str, str]:
        return dict.fromkeys(robots, "")

    return RobotGroup(contexts, notes, write_nothing)


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
    return check_mission_on(mission, {"": RobotModel(skillset, goal)}, options)


def check_mission_on(
    mission: Mission, robots: Mapping[str, RobotModel], options: MissionOptions
) -> list[MissionProblem]:
    """All problems of a mission with these robots, as of `check_mission`. The only robot has an empty name."""
    when = "while it is built"
    try:
        context = offline_contexts(robots)
        if problem := robots_problem(mission, robots):
            return [MissionProblem(problem)]
        trees, problems = mission.draft(context, options)
        when = "while it is checked"
        return _all_problems(mission, trees, problems, context)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - code of users may raise anything
        return [problem_of_exception(mission.file, error, when)]


def robots_problem(mission: Mission, robots: Iterable[str]) -> str:
    """Sentence about a mission on other robots than the given ones; empty if they are those of the mission."""
    given = sorted(robot for robot in robots if robot)
    if sorted(mission.robots) == given:
        return ""
    if not mission.robots:
        return f"Mission `{mission.name}` is for one robot. Name it by `--robot NAME`."
    missing = [robot for robot in mission.robots if robot not in given]
    options = " ".join(f"--robot {robot}=NAME" for robot in missing or mission.robots)
    text = f"Mission `{mission.name}` is for the robots {listed(mission.robots)}."
    if missing == list(mission.robots) or not missing:
        return f"{text} Name them: `{options}`."
    was, them = ("was", "it") if len(missing) == 1 else ("were", "them")
    return f"{text} {listed(missing)} {was} not found. Name {them}: `{options}`."


def require_fit(mission: Mission, robots: Mapping[str, RobotModel], options: MissionOptions) -> None:
    """Raise FaultyMissionError with all problems of a mission with the robots that run, if there are any."""
    problems = check_mission_on(mission, robots, options)
    if problems:
        names = listed(dict.fromkeys(model.skillset.name for model in robots.values()))
        heading = f"Mission `{mission.name}` does not fit {names}, which is what runs here:"
        raise FaultyMissionError(problems, heading=heading)


def _all_problems(
    mission: Mission, trees: MissionTrees, found: list[MissionProblem], context: MissionContext
) -> list[MissionProblem]:
    ours = preflight(mission, trees, context)
    return sorted(dict.fromkeys([*found, *ours]), key=_place)


def _place(problem: MissionProblem) -> tuple[str, int]:
    file, _, line = (problem.place or "").rpartition(":")
    return (file, int(line)) if line.isdecimal() else (problem.place or "", 0)
