"""Rules of grants: a goal begins once, and its manager keeps the grant by renewing it."""

from __future__ import annotations

from skillwing.services.core.checks import check_goal_id, check_schema
from skillwing.services.core.invariants import enforce_invariants
from skillwing.services.core.ledger import Grant, check_token, unknown_goal
from skillwing.services.core.losses import replace_predecessors
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.readiness import decline, failing_preconditions, fitted_inputs, require_known_data
from skillwing.services.protocol import BeginGoal, GoalVerdict, Granted, RenewGoal


def begin(state: ManagerState, request: BeginGoal, now: float) -> GoalVerdict:
    """Check the preconditions and apply the start effect. A known goal id gets the latest verdict on its goal."""
    check_goal_id(request.goal_id)
    check_schema(state.skillset, request.schema)
    skill = state.skill(request.skill)
    known = state.ledger.verdict(request.goal_id, skill.name)
    grant = state.ledger.active(request.goal_id)
    if grant is not None and _is_of_predecessor(grant, request):
        return _take_from_predecessor(state, grant, request, now)
    if known is not None:
        return known
    inputs = fitted_inputs(skill, request.inputs)
    state.incarnations.check(request.manager, request.incarnation)
    for check in skill.preconditions.checks:
        require_known_data(state, check.expression, now)
    if request.incarnation:
        replace_predecessors(state, request.manager, request.incarnation, now)
    failing = failing_preconditions(state.skillset, skill, state.environment(now, inputs))
    if failing:
        return decline(state, request, skill, inputs, failing, now)
    record = state.record_goal(skill, "GRANTED", now, request.goal_id, request.cause, f"to {request.manager}")
    state.apply_effect(skill, skill.preconditions.success, record, request.goal_id, now)
    token = state.ledger.next_token(now)
    granted = Granted(goal_id=request.goal_id, token=token, step=state.step, record=record)
    state.ledger.open(Grant(skill, inputs, request.manager, request.incarnation, granted, request.owner, now))
    enforce_invariants(state, now)
    # An invariant may be false from the start, for instance without data: then the goal is finished already.
    return state.ledger.verdict(request.goal_id, skill.name) or granted


def renew(state: ManagerState, request: RenewGoal, now: float) -> GoalVerdict:
    """The present verdict on a goal: `Granted`, or how it has ended."""
    del now
    verdict = state.ledger.verdict(request.goal_id, state.skill(request.skill).name)
    if verdict is None:
        raise unknown_goal(request.goal_id)
    grant = state.ledger.active(request.goal_id)
    if grant is not None:
        check_token(request, grant.token)
    return verdict


def _is_of_predecessor(grant: Grant, request: BeginGoal) -> bool:
    """True if an earlier process of the same name holds the grant of the requested goal."""
    return grant.manager == request.manager and request.incarnation not in ("", grant.incarnation)


def _take_from_predecessor(state: ManagerState, grant: Grant, request: BeginGoal, now: float) -> GoalVerdict:
    """End the goal as lost: the new process must not run it a second time."""
    state.incarnations.check(request.manager, request.incarnation)
    replace_predecessors(state, request.manager, request.incarnation, now)
    finished = state.ledger.finished(grant.goal_id)
    assert finished is not None
    return finished.verdict
