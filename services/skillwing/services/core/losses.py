"""Rules of losses: goals of managers that are gone, silent or replaced end, and their lost effects are applied."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.dsl.model import Skill
from skillwing.services.core.checks import check_schema
from skillwing.services.core.events import GoalSilent, ManagerExited, ManagerGone
from skillwing.services.core.invariants import enforce_invariants
from skillwing.services.core.ledger import Grant
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.protocol import AttachManager, Lost, ResourceStates


def attach_manager(state: ManagerState, request: AttachManager, now: float) -> ResourceStates:
    """Take a process for the latest of its name. Its predecessor is gone, however short its alive token was away."""
    if request.schema:
        check_schema(state.skillset, request.schema)
    state.incarnations.check(request.manager, request.incarnation)
    replace_predecessors(state, request.manager, request.incarnation, now)
    return state.resource_states(now)


def lose_manager(state: ManagerState, event: ManagerGone, now: float) -> None:
    """End all goals of a manager, the oldest first."""
    _lose_all(state, [grant for grant in state.ledger.grants if grant.manager == event.manager], event.reason, now)


def note_exit(state: ManagerState, event: ManagerExited, now: float) -> None:
    """Note why a manager will be found gone. Its goals are lost only when that is certain, by its alive token."""
    del now
    state.ledger.note_exit(event.manager, event.record, event.t)


def lose_goal(state: ManagerState, event: GoalSilent, now: float) -> None:
    """End one goal; a finished goal stays as it is."""
    grant = state.ledger.active(event.goal_id)
    if grant is not None:
        _lose_all(state, (grant,), event.reason, now)


def replace_predecessors(state: ManagerState, manager: str, incarnation: str, now: float) -> None:
    """Take this incarnation for the latest, and end the goals of its predecessors."""
    state.incarnations.note(manager, incarnation)
    grants = state.ledger.grants
    held = [grant for grant in grants if grant.manager == manager and grant.incarnation != incarnation]
    _lose_all(state, held, "another process has taken its place", now)


def lost_effect(skill: Skill) -> str | None:
    """The effect of a goal that ends without its manager."""
    return skill.interrupt.apply if skill.lost is None else skill.lost


def _lose_all(state: ManagerState, grants: Iterable[Grant], reason: str, now: float) -> None:
    for grant in grants:
        # The effect of an earlier one may have violated an invariant of this one.
        if state.ledger.active(grant.goal_id) is not None:
            _lose(state, grant, f"The manager `{grant.manager}` was lost: {reason}.", now)
            enforce_invariants(state, now)


def _lose(state: ManagerState, grant: Grant, reason: str, now: float) -> None:
    skill = grant.skill
    # Without a record of the process's exit the loss is a root: least of all did the grant make it happen.
    record = state.record_goal(skill, "LOST", now, grant.goal_id, grant.exit_record, reason)
    unapplied = state.apply_effect(skill, lost_effect(skill), record, grant.goal_id, now)
    lost = Lost(
        goal_id=grant.goal_id,
        skill=skill.name,
        reason=f"{reason} {unapplied}".rstrip(),
        t=now,
        step=state.step,
        record=record,
        token=grant.token,
    )
    state.ledger.close(grant, lost)
    state.outbox.add(lost)
