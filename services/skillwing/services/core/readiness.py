"""Rules of readiness: whether a goal may begin, and why not."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from skillwing.dsl.expressions import Environment, Expression, names_used
from skillwing.dsl.model import Skill, Skillset
from skillwing.services.core.causes import refusal_cause
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.invariants import enforce_invariants
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_table import transition_obstacle
from skillwing.services.core.snapshot import FinishedGoal
from skillwing.services.core.values import fit_fields
from skillwing.services.protocol import NO_TOKEN, BeginGoal, ErrorCode, NotReady


def fitted_inputs(skill: Skill, given: Mapping[str, object]) -> dict[str, object]:
    """Inputs of a goal with defaults filled in; refuses inputs that do not fit the skill."""
    inputs, problems = fit_fields(skill.inputs, given)
    if problems:
        text = " ".join(problem.sentence for problem in problems)
        raise RefusedError(
            ErrorCode.BAD_REQUEST,
            f"The inputs do not fit `{skill.name}`: {text}",
            help="Send what the skillset declares.",
        )
    return inputs


def require_known_data(state: ManagerState, guard: Expression | None, now: float) -> None:
    """Refuse to evaluate a guard on data that may be fresh, but whose values are not known here yet."""
    if guard is not None and state.data.freshness_unknown(names_used(guard, "data"), now):
        text = "The resource manager has just been restarted and does not know all data yet."
        raise RefusedError(ErrorCode.UNAVAILABLE, text, help="Ask again.")


def failing_preconditions(
    skillset: Skillset, skill: Skill, known: Environment, unchecked: Collection[str] = ()
) -> dict[str, str]:
    """Every check that fails, and why. A start effect that cannot be applied counts as one.

    The one rule of readiness: starts and `QueryReady` use it. unchecked: names of checks that are left out.
    """
    checks = [check for check in skill.preconditions.checks if check.name not in unchecked]
    reasons = {check.name: explain_failure(check.expression, known) for check in checks}
    failing = {name: reason for name, reason in reasons.items() if reason is not None}
    start = skill.preconditions.success
    obstacle = transition_obstacle(skillset.resource, known.resources, skill.transitions(start))
    if obstacle is not None:
        failing[f"effect {start}"] = f"The effect `{start}` cannot be applied: {obstacle}"
    return failing


def decline(
    state: ManagerState,
    request: BeginGoal,
    skill: Skill,
    inputs: Mapping[str, object],
    failing: Mapping[str, str],
    now: float,
) -> NotReady:
    """Apply the failure effect of a goal that may not begin, and finish the goal."""
    effect = skill.preconditions.failure
    if (obstacle := state.table.obstacle(skill.transitions(effect))) is not None:
        # The reason of the refusal stays if it is about this very effect.
        failing = dict(failing)
        failing.setdefault(f"effect {effect}", f"The effect `{effect}` could not be applied: {obstacle}")
    data_records: dict[str, str] = {}
    cause = refusal_cause(state, skill, inputs, data_records, now)
    record = state.record_goal(skill, "NOT_READY", now, request.goal_id, cause, " ".join(failing.values()))
    state.apply_effect(skill, effect, record, request.goal_id, now)
    verdict = NotReady(goal_id=request.goal_id, failing=dict(failing), step=state.step, record=record)
    state.ledger.remember(FinishedGoal(request.goal_id, skill.name, NO_TOKEN, verdict))
    enforce_invariants(state, now, data_records)
    return verdict
