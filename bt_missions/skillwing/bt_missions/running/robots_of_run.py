"""Robots of a run: whether they are ready, and which of them the mission has to bring to their rescue goals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.mission.mission import Mission, MissionTrees, split_need
from skillwing.bt_missions.running.run_conditions import Readiness, RescueCheck
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.dsl.suggest import listed


@dataclass(frozen=True, slots=True)
class RobotOfRun:
    """One robot of a run. name: empty for the only one. rescue: tree that brings it to its rescue goal."""

    name: str
    readiness: Readiness
    safety: RescueCheck
    rescue: Behaviour | None
    words: tuple[str, str]
    """Words for the rescue goal that is reached, and a noun for the way there."""

    @property
    def is_due(self) -> bool:
        """True if the mission has to rescue this robot now."""
        return self.rescue is not None and self.safety.is_due


class RobotsOfRun:
    """All robots of a run, as one."""

    def __init__(self, mission: Mission, context: MissionContext, trees: MissionTrees) -> None:
        several = bool(mission.robots)
        needs: dict[str, dict[str, tuple[str, ...]]] = {name: {} for name in context.robots}
        for need, states in mission.needs.items():
            robot, resource = split_need(need, several=several)
            needs.get(robot, {})[resource] = states
        self._robots = [_robot_of_run(own, needs[name], trees.rescue_of(name)) for name, own in context.robots.items()]

    def time_is_known(self, robot: str) -> None:
        """Note that the time of a robot is known from now on."""
        for each in self._robots:
            if each.name == robot:
                each.readiness.time_is_known = True

    @property
    def missing(self) -> str:
        """All that the robots still lack; empty if they are ready."""
        found = ((each.name, each.readiness.missing) for each in self._robots)
        return "; ".join(f"{name}: {missing}" if name else missing for name, missing in found if missing)

    def begin(self) -> None:
        """Note the start of the mission."""
        for each in self._robots:
            each.safety.begin()

    @property
    def refusal(self) -> str | None:
        """Reason why a mission that waits cannot start."""
        found = ((each.name, each.safety.refusal) for each in self._robots)
        return next((f"{name}: {refusal}" if name else refusal for name, refusal in found if refusal), None)

    @property
    def due(self) -> tuple[RobotOfRun, ...]:
        """The robots that the mission has to rescue now."""
        return tuple(each for each in self._robots if each.is_due)

    @property
    def rescuable(self) -> tuple[RobotOfRun, ...]:
        """The robots with a rescue."""
        return tuple(each for each in self._robots if each.rescue is not None)

    @property
    def where(self) -> str:
        """Words for the places of the robots that are away: `under load`; with names, if there are several."""
        away = [(each.name, each.safety.where) for each in self._robots if each.safety.is_away]
        return " and ".join(f"{name} {where}" if name else where for name, where in away)

    @property
    def reported(self) -> str:
        """Resources by whose states the robots report their places."""
        return " and ".join(dict.fromkeys(each.safety.reported for each in self.due))

    @property
    def rescue_action(self) -> str | None:
        """Noun for the rescue; None without one."""
        return next((each.words[1] for each in self.rescuable), None)


def rescue_tree(robots: tuple[RobotOfRun, ...]) -> Behaviour:
    """The rescue of these robots, which does not depend on one another."""
    trees = [each.rescue for each in robots if each.rescue is not None]
    for tree in trees:
        tree.parent = None  # it may have had another one in an earlier rescue
    return trees[0] if len(trees) == 1 else ParallelAll("rescue", trees)


def rescued_words(robots: tuple[RobotOfRun, ...]) -> tuple[str, str]:
    """Clause for robots that are rescued, and a noun for the way there: `the robot is without load`, `lowering`."""
    reached, action = robots[0].words
    names = [each.name for each in robots if each.name]
    who = f"{listed(names)} {'is' if len(names) == 1 else 'are'}" if names else "the robot is"
    return f"{who} {reached}", action


def _robot_of_run(
    context: MissionContext, needs: Mapping[str, tuple[str, ...]], rescue: Behaviour | None
) -> RobotOfRun:
    goal = context.rescue_goal
    return RobotOfRun(
        context.robot,
        Readiness(context.interface, needs),
        RescueCheck(context.interface, context.skillset, goal, needs),
        rescue,
        ("safe", "the rescue") if goal is None else (goal.reached, goal.action),
    )
