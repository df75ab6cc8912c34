"""Steps of a first mission: skills of a robot in an order that their preconditions allow. Pure.

What a skill changes follows from its effects, its postconditions, and the rescue goal of the robot. Resources that the
robot reports may begin in another state than their first one: the mission then needs that state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from skillwing.dsl.expressions import UnboundNameError
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import changed_by, could_start, wanted_states
from skillwing.services.rescue_goal import RescueGoal

MOST_STEPS = 6
"""Number of skills in a draft, without the one of the rescue goal."""


@dataclass(frozen=True)
class DraftSteps:
    """Skills, one after the other. needs: states of resources at the start, if they are not the first ones."""

    skills: tuple[Skill, ...]
    needs: Mapping[str, str]


def draft_steps(skillset: Skillset, goal: RescueGoal | None) -> DraftSteps:
    """Each skill that ends by itself at most once, as far as it can start. The skill of the rescue goal is the last."""
    planner = _Planner(skillset, goal)
    while len(planner.steps) < MOST_STEPS and planner.add_step():
        pass
    planner.return_to_goal()
    return DraftSteps(tuple(planner.steps), dict(planner.needs))


class _Planner:
    def __init__(self, skillset: Skillset, goal: RescueGoal | None) -> None:
        self.steps: list[Skill] = []
        self.needs: dict[str, str] = {}
        self._skillset = skillset
        self._goal = goal
        self._states = {resource.name: resource.initial for resource in skillset.resources}
        changed = frozenset[str]().union(*(changed_by(skill) for skill in skillset.skills))
        self._reported = {resource.name for resource in skillset.resources} - changed
        self._left = [skill for skill in skillset.skills if _ends_well(skill) and skill.name != self._rescuer]

    @property
    def _rescuer(self) -> str | None:
        return None if self._goal is None else self._goal.skill

    def add_step(self) -> bool:
        """Add the first skill that can start now, or that could with another report of the robot. False if none can."""
        for with_needs in (False, True):
            for skill in self._left:
                needs = dict(self._needs_of(skill)) if with_needs else {}
                states = self._states_after([*self.steps, skill], self.needs | needs)
                if states is not None:
                    self.steps.append(skill)
                    self._left.remove(skill)
                    self.needs |= needs
                    self._states = states
                    return True
        return False

    def return_to_goal(self) -> None:
        """Add the skill of the rescue goal, if a step leads away from it."""
        goal = self._goal
        if goal is not None and self._states[goal.resource] in goal.away:
            self.steps.append(self._skillset.skill(goal.skill))

    def _needs_of(self, skill: Skill) -> Iterator[tuple[str, str]]:
        """States that the robot would have to report for the skill to start, in place of what it reports at first."""
        for check in skill.preconditions.checks:
            if check.kind != "resource":
                continue
            wanted = wanted_states(check.expression, self._skillset, self._states)
            for name, targets in wanted.items():
                untouched = self._states[name] == self._skillset.resource(name).initial and name not in self.needs
                if name in self._reported and untouched and not self._is_of_goal(name):
                    yield name, targets[0]

    def _is_of_goal(self, resource: str) -> bool:
        return self._goal is not None and self._goal.resource == resource

    def _states_after(self, skills: Sequence[Skill], needs: Mapping[str, str]) -> dict[str, str] | None:
        """States after these steps, from a start with these needs; None if one of the steps could not start."""
        states = {resource.name: resource.initial for resource in self._skillset.resources} | dict(needs)
        for skill in skills:
            if not could_start(skill, self._skillset, states):
                return None
            states |= self._changes(skill, states)
        return states

    def _changes(self, skill: Skill, before: Mapping[str, str]) -> dict[str, str]:
        """States that the success of a skill leaves, as far as it changes them or promises them."""
        result = next(result for result in skill.results if result.success)
        changes = dict(skill.transitions(skill.preconditions.success)) | dict(skill.transitions(result.apply))
        goal = self._goal
        if goal is not None and skill.name in goal.left_by:
            changes[goal.resource] = next(iter(goal.away))
        elif goal is not None and skill.name == goal.skill:
            changes[goal.resource] = goal.state
        if result.post is None:
            return changes
        try:
            wanted = wanted_states(result.post, self._skillset, {**before, **changes})
        except UnboundNameError:  # it is about data as well
            return changes
        return changes | {name: targets[0] for name, targets in wanted.items() if name in self._reported}


def _ends_well(skill: Skill) -> bool:
    return any(result.success for result in skill.results)
