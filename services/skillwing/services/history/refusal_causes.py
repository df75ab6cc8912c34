"""What kept a skill from starting, by its preconditions. Pure.

The record of a refusal names who asked as its cause, for nothing but the question made the resource manager judge. A
reader wants to know what the answer came from, as with an invariant, whose record names what broke it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeAlias

from skillwing.dsl.expressions import Expression, names_used
from skillwing.dsl.guards import holds, sufficient_changes
from skillwing.dsl.model import Skill, Skillset
from skillwing.services.protocol import RecordKind

Subject: TypeAlias = tuple[RecordKind, str]
"""A resource or a datum, as records name it."""


def obstacles(skillset: Skillset, skill: str, states: Mapping[str, str], stale: Collection[str]) -> frozenset[Subject]:
    """The resources and data because of which a skill may not start.

    states: of all resources. stale: data that are too old to be judged. What nobody writes down is not judged: inputs,
    and values of data. So nothing is found where only these forbid it. Raises UnknownNameError for an unknown skill.
    """
    model = skillset.skill(skill)
    guards = [check.expression for check in model.preconditions.checks]
    by_guards = frozenset[Subject]().union(*(_obstacles_of(guard, skillset, states, stale) for guard in guards))
    return by_guards or _obstacles_of_start(model, skillset, states)


def _obstacles_of(
    guard: Expression, skillset: Skillset, states: Mapping[str, str], stale: Collection[str]
) -> frozenset[Subject]:
    """Those of which each alone would do, were it another one; all that the guard names where none would."""
    data = names_used(guard, "data")
    if data:
        return frozenset((RecordKind.DATA, name) for name in data.intersection(stale))
    if names_used(guard, "input") or holds(guard, states):
        return frozenset()
    culprits = sufficient_changes(guard, skillset, states) or names_used(guard, "resource")
    return frozenset((RecordKind.RESOURCE, name) for name in culprits)


def _obstacles_of_start(skill: Skill, skillset: Skillset, states: Mapping[str, str]) -> frozenset[Subject]:
    """Resources that the start effect cannot bring where it has to."""
    return frozenset(
        (RecordKind.RESOURCE, name)
        for name, target in skill.transitions(skill.preconditions.success)
        if not skillset.resource(name).allows(states[name], target, extern=False)
    )
