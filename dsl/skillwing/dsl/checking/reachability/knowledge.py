"""The checker's knowledge of the situations in which a skillset is evaluated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from skillwing.dsl.checking.reachability.situations import Situations, either
from skillwing.dsl.checking.reachability.statespace import Behaviour
from skillwing.dsl.model import Skill


@dataclass(frozen=True, slots=True)
class SkillSituations:
    """The possible situations at each step of a goal of one skill.

    idle: at the evaluation of a start. entered: right after the start effect. started: at the first evaluation of the
    invariants, which comes later if the start effect ended other goals. running: between steps, while it runs.
    violated: at the violation of each of its invariants, before the effect.
    """

    idle: Situations
    entered: Situations
    started: Situations
    running: Situations
    violated: tuple[Situations, ...]

    def refused(self, behaviour: Behaviour) -> Situations:
        """The situations of a rejected start: a precondition fails, or the start effect cannot be applied."""
        if None in behaviour.checks:
            return self.idle
        failing = [self.idle.where(check, wanted=False) for check in behaviour.judged_checks]
        return either([*failing, self.idle.where_all(behaviour.judged_checks).unable(behaviour.start)], self.idle)


def ends_of(skill: Skill) -> Iterator[tuple[str, str | None]]:
    """Each end of a started goal, with the effect that it applies: results, interruption, loss, violations of
    invariants.
    """
    yield from ((f"result `{result.name}`", result.apply) for result in skill.results)
    yield "interruption", skill.interrupt.apply
    yield "loss of its manager", skill.lost
    yield from ((f"violation of `{invariant.name}`", invariant.violation) for invariant in skill.invariants)


class Knowledge(Protocol):
    """The possible situations of a skillset. They are right if `exact`; otherwise too many, never too few.

    always: all situations, also those within an atomic step. resting: those between steps.
    """

    exact: bool
    always: Situations
    resting: Situations

    def of(self, skill: Skill) -> SkillSituations: ...

    def stuck(self, skill: Skill, name: str, origins: frozenset[str]) -> list[frozenset[str]]:
        """The states after each of `ends_of` a skill from which the resource can reach none of `origins`."""
        ...
