"""Analysis of resources and events: unreachable states, events that never fire."""

from __future__ import annotations

from skillwing.dsl.checking.connections import connected_states, first_mention, report_unreachable
from skillwing.dsl.checking.impossible_guards import report_guard
from skillwing.dsl.checking.reachability.knowledge import Knowledge
from skillwing.dsl.checking.reachability.situations import Situations
from skillwing.dsl.checking.reachability.statespace import StateSpace
from skillwing.dsl.checking.wording import alternatives, possible_states, transitions_of
from skillwing.dsl.diagnostics.diagnostic import has_errors
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import names_used
from skillwing.dsl.model import Event, Resource, Skillset
from skillwing.dsl.queries import named_by
from skillwing.dsl.spans import Span


def report_resources(skillset: Skillset, knowledge: Knowledge, space: StateSpace, report: DiagnosticReport) -> None:
    """Report resources that nothing names and states that nothing reaches. Runs after skills and events."""
    named = _resources_named(space)
    effects = [effect for skill in skillset.skills for effect in skill.effects]
    driven = {
        pair for effect in (*effects, *(event.effect for event in skillset.events)) for pair in effect.transitions
    }
    follows = has_errors(report.diagnostics)  # That effects can never apply has been reported where they stand.
    for resource in skillset.resources:
        if resource.name not in named:
            message = f"No skill and no event names the resource `{resource.name}`."
            advice = "Name it in a precondition, an invariant or an effect, or remove it."
            report.add("SW082", resource.span, message, advice)
        connected = connected_states(resource)
        report_unreachable(resource, connected, report)
        reached = knowledge.always.states(resource.name)
        for state in resource.states:
            if state in connected and state not in reached and resource.name in named:
                is_driven = (resource.name, state) in driven
                if not (is_driven and follows):
                    _unvisited(resource, state, is_driven, report)


def _unvisited(resource: Resource, state: str, is_driven: bool, report: DiagnosticReport) -> None:
    if is_driven:
        message = f"`{resource.name}` never gets to {state}: the effects that would bring it there can never apply."
        advice = "Fix the skills that have these effects, or declare the transition `extern`."
    else:
        message = f"`{resource.name}` never gets to {state}: no effect brings it there, and no extern transition does."
        advice = f"Give a skill an effect with `{resource.name} -> {state}`, or declare the transition `extern`."
    report.add("SW086", first_mention(resource, state), message, advice)


def _resources_named(space: StateSpace) -> set[str]:
    named = {name for skill in space.skillset.skills for name in space.behaviour(skill).names}
    named = named.union(*(named_by(event) for event in space.skillset.events))
    return named.union(*(names_used(predicate) for predicate in space.relations.too_wide))


def report_event(event: Event, knowledge: Knowledge, space: StateSpace, report: DiagnosticReport) -> None:
    """Report an event that can never fire, or that drives an internal transition."""
    guard = space.guard(event.guard)
    enabled = knowledge.resting if guard is None else knowledge.resting.where(guard)
    if event.guard is not None and guard is not None and enabled.empty:
        report_guard(event, guard, knowledge.resting, report)
    wrong = report_transitions(event, space, report)
    changes = space.event(event)
    if not wrong and not enabled.empty and enabled.able(changes).empty:
        _never_applies(event, enabled, space, report)


def report_transitions(event: Event, space: StateSpace, report: DiagnosticReport) -> bool:
    """Report the transitions that no event may take; return whether there are any."""
    wrong = False
    for (name, target), span in zip(event.effect.transitions, event.effect.spans, strict=True):
        wrong |= _transition(name, target, span, space, report)
    return wrong


def _never_applies(event: Event, enabled: Situations, space: StateSpace, report: DiagnosticReport) -> None:
    changes = space.event(event)
    for (name, target, sources), span in zip(changes, event.effect.spans, strict=True):
        states = enabled.states(name)
        if not states & sources:
            message = (
                f"`{event.name}` can never happen: `{name}` is {alternatives(states)} when it may, "
                f"with no extern transition to `{target}`."
            )
            advice = f"{transitions_of(space.resource(name))} Add `extern {min(states)} -> {target}`, or another guard."
            report.add("SW042", span, message, advice)
            return
    message = f"`{event.name}` can never happen: its transitions are never open all at once."
    possible = possible_states([name for name, _, _ in changes], enabled)
    report.add("SW042", event.span, message, f"When its guard holds, {possible}: leave one out.")


def _transition(name: str, target: str, span: Span, space: StateSpace, report: DiagnosticReport) -> bool:
    """Report a transition that no event may take; return whether it was reported."""
    edges = [edge for edge in space.resource(name).transitions if edge.target == target]
    if any(edge.extern for edge in edges):
        return False
    if edges:
        message = f"`{name} -> {target}` is an internal transition, and events are external."
        advice = f"Declare it `extern {edges[0].source} -> {target}`, or leave it to a skill."
        report.add("SW044", span, message, advice)
    else:
        report.add("SW041", span, f"`{name}` has no transition to `{target}`.", transitions_of(space.resource(name)))
    return True
