"""Rescue goal of a robot: the state to which it is brought before anybody leaves it alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import msgspec

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Invariant, Skillset, UnknownNameError
from skillwing.dsl.queries import holds, taken_by
from skillwing.dsl.suggest import listed
from skillwing.services.errors import InvalidOptionError


class RescueGoal(msgspec.Struct, frozen=True, kw_only=True):
    """State of a resource, and the skill that leads there.

    resource, state: the goal is reached while the resource is in this state. away: its other states, in which nobody
    leaves the robot alone, each with words that follow `the robot is`: `under load`. skill: leads to the goal.
    left_by: skills that lead away from it. reached: words that follow `the robot is`: `without load`. action: noun for
    the way there: `lowering`.
    """

    resource: str
    state: str
    away: Mapping[str, str]
    skill: str
    left_by: tuple[str, ...]
    reached: str
    action: str

    def problems(self, skillset: Skillset) -> Iterator[str]:
        """The reasons why a robot with this skillset cannot have this goal, each as a sentence."""
        try:
            states = skillset.resource(self.resource).states
            skill, *_ = [skillset.skill(name) for name in (self.skill, *self.left_by)]
        except UnknownNameError as error:
            yield str(error)
            return
        for state in (self.state, *self.away):
            if state not in states:
                yield str(UnknownNameError(f"state of {self.resource}", state, states))
        required = [field.name for field in skill.inputs if field.default is None]
        if required:
            needs = f"its input{'s' * (len(required) > 1)} {listed(required)}"
            yield f"`{skill.name}` cannot be a rescue, because it needs {needs}. Give them defaults, or choose another."

    def require_fit(self, skillset: Skillset) -> None:
        """Raise InvalidOptionError if a robot with this skillset cannot have this goal."""
        for problem in self.problems(skillset):
            raise InvalidOptionError(
                "robot", f"The rescue goal of `{skillset.name}` does not fit its skillset: {problem}"
            )

    def needed_resources(self, skillset: Skillset) -> frozenset[str]:
        """The resources on which the skill depends until its end. While one is in another state, it cannot start."""
        return frozenset[str]().union(*(names_used(each.expression, "resource") for each in self._demands(skillset)))

    def is_possible(self, skillset: Skillset, states: Mapping[str, str]) -> bool:
        """True if these states allow the skill to run: not while a person has the robot."""
        demands = self._demands(skillset)
        known = all(names_used(each.expression, "resource") <= states.keys() for each in demands)
        return known and all(holds(each.expression, states) for each in demands)

    def is_under_way(self, skillset: Skillset, states: Mapping[str, str]) -> bool:
        """True if a skill has taken a resource that the skill of this goal takes: this one, or one that excludes it."""
        taken = taken_by(skillset.skill(self.skill))
        return any(states.get(resource) == state for resource, state in taken.items())

    def _demands(self, skillset: Skillset) -> list[Invariant]:
        return [each for each in skillset.skill(self.skill).invariants if each.kind == "resource"]
