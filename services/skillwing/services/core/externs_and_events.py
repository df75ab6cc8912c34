"""Rules of the functional layer: extern transitions, events, and the data that guards name."""

from __future__ import annotations

from skillwing.dsl.model import Resource, UnknownNameError
from skillwing.services.core.checks import check_schema, unknown_name
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.invariants import enforce_invariants
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.readiness import require_known_data
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.snapshot import DatumEntry
from skillwing.services.protocol import DataSample, ErrorCode, FireEvent, FireExtern, ResourceStates


def fire_extern(state: ManagerState, request: FireExtern, now: float) -> ResourceStates:
    """Drive one extern transition; the reply holds all states after everything that it broke."""
    if request.schema:
        check_schema(state.skillset, request.schema)
    try:
        resource = state.skillset.resource(request.resource)
    except UnknownNameError as error:
        raise unknown_name(error) from error
    if request.target not in resource.states:
        raise unknown_name(UnknownNameError(f"state of {resource.name}", request.target, resource.states))
    transitions = [(resource.name, request.target)]
    obstacle = state.table.obstacle(transitions, extern=True)
    if obstacle is not None:
        raise _no_such_transition(state, resource, obstacle)
    state.table.apply(transitions, now, f"reported by {request.source}", cause=request.cause)
    enforce_invariants(state, now)
    return state.resource_states(now)


def fire_event(state: ManagerState, request: FireEvent, now: float) -> ResourceStates:
    """Fire an event: its guard and all its extern transitions, or nothing."""
    if request.schema:
        check_schema(state.skillset, request.schema)
    try:
        event = state.skillset.event(request.event)
    except UnknownNameError as error:
        raise unknown_name(error) from error
    require_known_data(state, event.guard, now)
    obstacle = None if event.guard is None else explain_failure(event.guard, state.environment(now))
    obstacle = obstacle or state.table.obstacle(event.effect.transitions, extern=True)
    if obstacle is not None:
        text = f"The event `{event.name}` cannot happen now: {obstacle}"
        raise RefusedError(ErrorCode.NOT_ALLOWED, text, help="Look at the states of the resources.")
    text = f"event {event.name} by {request.source}"
    state.table.apply(event.effect.transitions, now, text, cause=request.cause)
    enforce_invariants(state, now)
    return state.resource_states(now)


def take_sample(state: ManagerState, sample: DataSample, now: float) -> None:
    """Take the value of a datum that guards name; any other is ignored."""
    data = state.data
    if sample.name not in data.names:
        return
    before = data.value(sample.name)
    problem = data.accept(sample, now)
    if problem is not None:
        raise RefusedError(ErrorCode.BAD_REQUEST, problem, help="Publish values of the type in the skillset.")
    if data.never_expires(sample.name) and data.value(sample.name) != before:
        state.entries.append(DatumEntry(sample.name, data.value(sample.name), now))
    enforce_invariants(state, now)


def _no_such_transition(state: ManagerState, resource: Resource, obstacle: str) -> RefusedError:
    targets = state.table.extern_targets(resource.name)
    help_text = f"From {state.table.states[resource.name]} " + (
        f"the functional layer can bring it to {' or '.join(targets)}." if targets else "only skills move it."
    )
    return RefusedError(ErrorCode.NOT_ALLOWED, obstacle, help=help_text, known=targets)
