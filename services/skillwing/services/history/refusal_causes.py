"""Causes of a refused start: the resources and data that make a skill's preconditions fail. Pure.

The record of a refusal has the request as its cause, because the request made the resource manager decide. Readers look
for the state behind the answer, as in the record of a violated invariant.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeAlias

from skillwing.dsl.expressions import Expression, names_used
from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import blocked_at_start, holds, sufficient_changes
from skillwing.services.protocol import RecordKind

Subject: TypeAlias = tuple[RecordKind, str]
"""A resource or a datum, in the terms of records."""


def refusal_causes(
    skillset: Skillset, skill: str, states: Mapping[str, str], stale: Collection[str]
) -> frozenset[Subject]:
    """The resources and data because of which a skill cannot start.

    states: of all resources. stale: data without new values. Inputs and values of data are not recorded. If only these
    prevent the start, the result is empty. Raises UnknownNameError for an unknown skill.
    """
    model = skillset.skill(skill)
    guards = [check.expression for check in model.preconditions.checks]
    by_guards = frozenset[Subject]().union(*(_causes_in_guard(guard, skillset, states, stale) for guard in guards))
    return by_guards or frozenset((RecordKind.RESOURCE, name) for name in blocked_at_start(model, skillset, states))


def _causes_in_guard(
    guard: Expression, skillset: Skillset, states: Mapping[str, str], stale: Collection[str]
) -> frozenset[Subject]:
    """Resources that could each make the guard hold alone; all that the guard names if none could."""
    data = names_used(guard, "data")
    if data:
        return frozenset((RecordKind.DATA, name) for name in data.intersection(stale))
    if names_used(guard, "input") or holds(guard, states):
        return frozenset()
    found = sufficient_changes(guard, skillset, states) or names_used(guard, "resource")
    return frozenset((RecordKind.RESOURCE, name) for name in found)
