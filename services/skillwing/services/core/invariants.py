"""Rules of invariants: a goal whose invariant is false ends, and its violation effect is applied."""

from __future__ import annotations

from typing import NamedTuple

from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Invariant
from skillwing.services.core.causes import record_datum
from skillwing.services.core.events import TimePassed
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.ledger import Grant
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.protocol import RecordKind, Violated


class Violation(NamedTuple):
    """A false invariant of a goal. reason: a sentence that names the values."""

    grant: Grant
    invariant: Invariant
    reason: str


def pass_time(state: ManagerState, event: TimePassed, now: float) -> None:
    """Check the invariants now: data may have turned stale."""
    del event
    enforce_invariants(state, now)


def enforce_invariants(state: ManagerState, now: float, data_records: dict[str, str] | None = None) -> None:
    """End goals until no invariant is violated.

    After each violation effect the check starts from the top, for the effect may break or fix any other invariant.
    Each round ends one goal, so there are no more rounds than goals. data_records: those of this step so far.
    """
    data_records = {} if data_records is None else data_records
    while (violation := first_violation(state, now)) is not None:
        _end_violated(state, violation, data_records, now)


def first_violation(state: ManagerState, now: float) -> Violation | None:
    """The first false invariant, in order of grant, then of declaration."""
    for grant in state.ledger.grants:
        environment = state.environment(now, grant.inputs)
        for invariant in grant.skill.invariants:
            reason = explain_failure(invariant.expression, environment)
            if reason is None:
                continue
            if not state.data.freshness_unknown(names_used(invariant.expression, "data"), now):
                return Violation(grant, invariant, reason)
    return None


def _end_violated(state: ManagerState, violation: Violation, data_records: dict[str, str], now: float) -> None:
    grant, invariant, reason = violation
    skill = grant.skill
    subject, cause = _cause_of(state, violation, data_records, now)
    record = state.outbox.record(
        now,
        RecordKind.GOAL,
        f"{skill.name}.{invariant.name}",
        "HOLDS",
        "VIOLATED",
        reason,
        cause=cause,
        goal_id=grant.goal_id,
    )
    unapplied = state.apply_effect(skill, invariant.violation, record, grant.goal_id, now)
    violated = Violated(
        goal_id=grant.goal_id,
        skill=skill.name,
        invariant=invariant.name,
        subject=subject,
        reason=f"{reason} {unapplied}".rstrip(),
        t=now,
        step=state.step,
        record=record,
        token=grant.token,
    )
    state.ledger.close(grant, violated)
    state.outbox.add(violated)


def _cause_of(
    state: ManagerState, violation: Violation, data_records: dict[str, str], now: float
) -> tuple[str, str | None]:
    """The resource or datum that broke the invariant, and the record of its change; None if it never changed."""
    expression = violation.invariant.expression
    if data := names_used(expression, "data"):
        return record_datum(state, data, violation.reason, data_records, now)
    change = state.table.latest_change(names_used(expression, "resource"))
    return change or (violation.invariant.name, None)
