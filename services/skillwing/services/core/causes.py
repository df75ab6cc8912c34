"""Causes of false guards: the change of a resource, or the record of a datum."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from skillwing.dsl.expressions import And, Environment, Expression, evaluate, names_used
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import blocked_at_start, holds, sufficient_changes
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.values import sendable_text
from skillwing.services.protocol import RecordKind


def refusal_cause(
    state: ManagerState, skill: Skill, inputs: Mapping[str, object], data_records: dict[str, str], now: float
) -> str | None:
    """Record because of which a skill cannot start; None for inputs, and for resources that never changed.

    data_records: as in `record_datum`.
    """
    known = state.environment(now, inputs)
    change = state.table.latest_change(preventing_resources(state.skillset, skill, known))
    if change is not None:
        return change[1]
    for part in _failing_parts(skill, known):
        if data := names_used(part, "data"):
            return record_datum(state, data, explain_failure(part, known) or "", data_records, now)[1]
    return None


def preventing_resources(skillset: Skillset, skill: Skill, known: Environment) -> frozenset[str]:
    """The resources because of which a skill cannot start: those that make a check fail, else block the start effect.

    If one change is enough for a check, these are the resources that could each make it hold alone.
    """
    failing = [check.expression for check in skill.preconditions.checks if not evaluate(check.expression, known)]
    if not failing:
        return blocked_at_start(skill, skillset, known.resources)
    return frozenset[str]().union(*(_preventing(guard, skillset, known.resources) for guard in failing))


def _preventing(guard: Expression, skillset: Skillset, states: Mapping[str, str]) -> frozenset[str]:
    """The resources that could each make a false guard hold alone; none for a guard on data or inputs.

    If none could, each false side of an `and` counts for itself. Of another guard all resources count.
    """
    if not names_used(guard, "resource") or holds(guard, states):
        return frozenset()
    if alone := sufficient_changes(guard, skillset, states):
        return frozenset(alone)
    if isinstance(guard, And):
        return _preventing(guard.left, skillset, states) | _preventing(guard.right, skillset, states)
    return names_used(guard, "resource")


def _failing_parts(skill: Skill, known: Environment) -> Iterator[Expression]:
    """The false sides of every `and`, in the preconditions that fail."""
    pending = [check.expression for check in reversed(skill.preconditions.checks)]
    while pending:
        part = pending.pop()
        if isinstance(part, And):
            pending += (part.right, part.left)
        elif not evaluate(part, known):
            yield part


def record_datum(
    state: ManagerState, names: Collection[str], reason: str, data_records: dict[str, str], now: float
) -> tuple[str, str]:
    """The datum that makes a guard false, a stale one first, and its record.

    names: data of the guard. data_records: those of this step; a datum gets one when it first makes a guard false.
    """
    data = sorted(names)
    datum = next((name for name in data if not state.data.is_fresh(name, now)), data[0])
    if datum not in data_records:
        reading = state.data.reading(datum, now)
        after = "STALE" if reading.stale else sendable_text(str(reading.value))
        data_records[datum] = state.outbox.record(now, RecordKind.DATA, datum, None, after, reason)
    return datum, data_records[datum]
