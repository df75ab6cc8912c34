"""Rules of ends: goals that a manager may end, the effects, and the records."""

from __future__ import annotations

from skillwing.dsl.expressions import Expression
from skillwing.dsl.model import Skill, UnknownNameError
from skillwing.services.core.checks import check_goal_id, unknown_name
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.invariants import enforce_invariants
from skillwing.services.core.ledger import Grant, check_token, unknown_goal
from skillwing.services.core.losses import lost_effect
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.readiness import require_known_data
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import FinishedGoal
from skillwing.services.protocol import (
    NO_TOKEN,
    Ended,
    EndGoal,
    Ending,
    EndKind,
    ErrorCode,
    GoalVerdict,
    ProtocolError,
    RecordOutcome,
    Terminal,
    require_sendable,
)

LOCAL_OUTCOMES = (Ending.BUSY, Ending.NOT_VALIDATED, Ending.INTERRUPTED, Ending.ERROR)
LONGEST_LOCAL_OUTCOME = 1 << 14
"""Largest terminal answer that is stored for a manager [bytes]. Answers of our own managers are shorter."""


def end(state: ManagerState, request: EndGoal, now: float) -> GoalVerdict:
    """Apply the effect of an end. For a finished goal the reply is its verdict."""
    check_goal_id(request.goal_id)
    skill = state.skill(request.skill)
    effect, post = _effect_of_end(skill, request)
    state.ledger.verdict(request.goal_id, skill.name)  # refuses the id of another skill
    grant = state.ledger.active(request.goal_id)
    if grant is None:
        return _end_without_grant(state, request, skill, now)
    check_fence(request, grant)
    require_known_data(state, post, now)
    record = state.record_goal(skill, "ENDED", now, grant.goal_id, request.cause, request.result or request.how.value)
    reason = state.apply_effect(skill, effect, record, grant.goal_id, now)
    if not reason and post is not None:
        failure = explain_failure(post, state.environment(now, grant.inputs))
        reason = f"The postcondition {failure}" if failure else ""
    ended = Ended(
        goal_id=grant.goal_id,
        held=not reason,
        reason=reason,
        step=state.step,
        record=record,
        how=request.how,
        result=request.result,
    )
    # The effect may break the goal's own invariants, so the goal is finished before they are checked.
    state.ledger.close(grant, ended)
    enforce_invariants(state, now)
    return ended


def record_outcome(state: ManagerState, request: RecordOutcome, now: float) -> GoalVerdict:
    """Commit the outcome of a goal without a grant, unless another process has handled the goal.

    A successor that is asked for the goal gives the same answer, and does not run it.
    """
    del now
    check_goal_id(request.goal_id)
    skill = state.skill(request.skill)
    _check_local_outcome(request)
    state.incarnations.check_attached(request.manager, request.incarnation)
    verdict = state.ledger.verdict(request.goal_id, skill.name)
    if state.ledger.active(request.goal_id) is not None:
        text = f"The goal {request.goal_id} holds a grant."
        raise RefusedError(ErrorCode.STALE_TOKEN, text, help="Leave it to the process that runs it.")
    if verdict is not None:
        return verdict
    ended = Ended(
        goal_id=request.goal_id,
        held=False,
        reason="",
        step=state.step,
        record=request.cause or "",
        terminal=request.terminal,
    )
    state.ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, ended))
    return ended


def abandons_unknown_grant(request: EndGoal) -> bool:
    """True if the manager ends a goal without its token, because it does not know of a grant."""
    return request.how is EndKind.ERROR and request.token == NO_TOKEN


def check_fence(request: EndGoal, grant: Grant) -> None:
    """Refuse the end of another process's grant: its token differs, or without a token its incarnation."""
    if not abandons_unknown_grant(request):
        check_token(request, grant.token)
    elif request.incarnation != grant.incarnation:
        raise RefusedError(
            ErrorCode.STALE_TOKEN,
            f"The goal {request.goal_id} was granted to another process of this manager.",
            help="Start a new goal.",
        )


def _end_without_grant(state: ManagerState, request: EndGoal, skill: Skill, now: float) -> GoalVerdict:
    finished = state.ledger.finished(request.goal_id)
    abandoned = abandons_unknown_grant(request)
    if finished is not None:
        if not abandoned:
            check_token(request, finished.token)
        return finished.verdict
    if not abandoned:
        raise unknown_goal(request.goal_id)
    # Its begin may still arrive. The goal must not take any resource then.
    text = "The manager gave the goal up before it was granted."
    record = state.record_goal(skill, "ENDED", now, request.goal_id, request.cause, text)
    ended = Ended(goal_id=request.goal_id, held=False, reason=text, step=state.step, record=record)
    state.ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, ended))
    return ended


def _effect_of_end(skill: Skill, request: EndGoal) -> tuple[str | None, Expression | None]:
    """The effect to apply at an end, and the postcondition to check after it."""
    match request.how, request.result:
        case EndKind.RESULT, str(name):
            try:
                result = skill.result(name)
            except UnknownNameError as error:
                raise unknown_name(error) from error
            return result.apply, result.post
        case EndKind.INTERRUPT, _:
            return skill.interrupt.apply, None
        case EndKind.ERROR, _:
            return lost_effect(skill), None
        case _:
            raise RefusedError(
                ErrorCode.BAD_REQUEST,
                "A goal that ends with a result needs the name of one.",
                help=f"Name the `result` of `{skill.name}` that it ended with.",
                known=tuple(result.name for result in skill.results),
            )


def _check_local_outcome(request: RecordOutcome) -> None:
    """Refuse with BAD_REQUEST a terminal answer that a goal without a grant cannot have."""
    terminal = request.terminal
    if terminal.ending not in LOCAL_OUTCOMES or _needs_a_run(terminal):
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"A goal that was never granted cannot end with {terminal.label}, nor with anything that needs a run.",
            help=f"Let `terminal` be {', '.join(LOCAL_OUTCOMES[:-1])} or {LOCAL_OUTCOMES[-1]}, without a result.",
            known=LOCAL_OUTCOMES,
        )
    try:
        require_sendable(terminal, LONGEST_LOCAL_OUTCOME)
    except ProtocolError as error:
        text = f"The outcome of the goal {request.goal_id} cannot be stored: {error}."
        raise RefusedError(ErrorCode.BAD_REQUEST, text, help="Give a shorter reason.") from error


def _needs_a_run(terminal: Terminal) -> bool:
    """True for a terminal answer with fields that only an executed goal can have."""
    return terminal.result is not None or terminal.success or terminal.output is not None or terminal.forced
