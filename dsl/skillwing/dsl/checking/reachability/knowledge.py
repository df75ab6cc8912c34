"""What the checker knows about the situations in which the parts of a skillset are judged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from skillwing.dsl.checking.reachability.situations import Situations, either
from skillwing.dsl.checking.reachability.statespace import Behaviour
from skillwing.dsl.model import Skill


@dataclass(frozen=True, slots=True)
class SkillSituations:
    """Where the resources can be at each step of a goal of one skill.

    idle: when a start is judged. entered: right after the start effect. started: when the invariants are judged for the
    first time, which is later if the start effect ended other goals. running: whenever nothing happens, while it runs.
    violated: as the goal ends by the violation of each of its invariants, before the effect.
    """

    idle: Situations
    entered: Situations
    started: Situations
    running: Situations
    violated: tuple[Situations, ...]

    def refused(self, behaviour: Behaviour) -> Situations:
        """When a start is refused: a precondition fails, or the start effect cannot be applied."""
        if None in behaviour.checks:
            return self.idle
        failing = [self.idle.where(check, wanted=False) for check in behaviour.judged_checks]
        return either([*failing, self.idle.where_all(behaviour.judged_checks).unable(behaviour.start)], self.idle)


def ends_of(skill: Skill) -> Iterator[tuple[str, str | None]]:
    """Every way in which a goal that has started can end, in words, and the effect that is applied then.

    In this order: results, interruption, loss, violations of the invariants.
    """
    yield from ((f"result `{result.name}`", result.apply) for result in skill.results)
    yield "interruption", skill.interrupt.apply
    yield "loss of its manager", skill.lost
    yield from ((f"violation of `{invariant.name}`", invariant.violation) for invariant in skill.invariants)


class Knowledge(Protocol):
    """What can come about in a skillset. Sets may be too large, never too small, unless `exact`, when they are right.

    always: all situations that ever come about, those within an atomic step included. resting: those between steps.
    """

    exact: bool
    always: Situations
    resting: Situations

    def of(self, skill: Skill) -> SkillSituations: ...

    def stuck(self, skill: Skill, name: str, origins: frozenset[str]) -> list[frozenset[str]]:
        """The states in which a resource can be after each of `ends_of` a skill and get back to none of `origins`."""
        ...
