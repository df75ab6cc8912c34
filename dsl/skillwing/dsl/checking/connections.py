"""Connections of a resource's states by its transitions: unreachable states, and misspelt ones among them."""

from __future__ import annotations

from collections.abc import Collection

from skillwing.dsl.checking.reachability.statespace import closure
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Resource, Skillset, Transition
from skillwing.dsl.queries import states_named
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest, listed


def connected_states(resource: Resource) -> frozenset[str]:
    """The states that a chain of transitions leads to."""
    return closure({resource.initial}, ((edge.source, edge.target) for edge in resource.transitions))


def report_misspelt_states(
    root: syntax.SkillsetSyntax, skillset: Skillset, damaged: Collection[str], report: DiagnosticReport
) -> None:
    """Report initial states that no transition leaves, and states that none leads to, if others were probably meant.

    Predicates and effects that name what was meant are then right. damaged: resources with other errors.
    """
    declared = {element.name.text: element for element in root.elements if isinstance(element, syntax.ResourceSyntax)}
    named = states_named(skillset)
    for resource in skillset.resources:
        if resource.transitions and resource.name not in damaged:
            elsewhere = {state for name, state in named if name == resource.name}
            _misspelt_states(resource, declared[resource.name], elsewhere, report)


def _misspelt_states(
    resource: Resource, declaration: syntax.ResourceSyntax, elsewhere: Collection[str], report: DiagnosticReport
) -> None:
    """elsewhere: states that guards and effects name."""
    connected = connected_states(resource)
    others = [state for state in resource.states if state not in connected]
    if not others:
        return
    if len(connected) == 1:
        _misspelt_initial(resource, others, declaration, report)
    elif any(_meant(resource, state, connected) for state in others):
        report_unreachable(resource, connected, report, elsewhere)


def report_unreachable(
    resource: Resource, connected: Collection[str], report: DiagnosticReport, elsewhere: Collection[str] = ()
) -> None:
    """Report the states that no chain of transitions leads to. elsewhere: states that guards and effects name."""
    initial = resource.initial
    for state in (state for state in resource.states if state not in connected):
        misspelt = _meant(resource, state, connected)
        if misspelt is not None and state in elsewhere and misspelt not in elsewhere:
            message = f"Only a transition of `{resource.name}` names the state `{misspelt}`."
            report.add("SW031", first_mention(resource, misspelt), message, f"Did you mean `{state}`?")
            continue
        message = f"No transition leads `{resource.name}` from `{initial}` to `{state}`."
        advice = f"Add a transition such as `{initial} -> {state}`, or remove the state."
        if meant := _meant(resource, state, connected):
            advice = f"Did you mean `{meant}`? Otherwise add a transition such as `{initial} -> {state}`."
        report.add("SW031", first_mention(resource, state), message, advice)


def first_mention(resource: Resource, state: str) -> Span | None:
    """The span of the first transition with a state, or that of the resource."""
    edges = _edges_with(resource, state)
    return edges[0].span if edges else resource.span


def _misspelt_initial(
    resource: Resource, others: list[str], declaration: syntax.ResourceSyntax, report: DiagnosticReport
) -> None:
    initial = resource.initial
    meant = closest(initial, others)
    is_listed = any(isinstance(item, syntax.StatesSyntax) for item in declaration.items)
    if meant is None and (is_listed or _edges_with(resource, initial)):
        return
    place = next(item.state.span for item in declaration.items if isinstance(item, syntax.InitialSyntax))
    message = f"No transition leads `{resource.name}` out of `{initial}`, its initial state."
    edge = f"a transition such as `{initial} -> {meant or others[0]}`"
    advice = f"Did you mean `initial {meant}`? Otherwise add {edge}."
    if meant is None:
        advice = f"Name another state, of {listed(others)}, or add {edge}."
    report.add("SW031", place, message, advice)


def _meant(resource: Resource, state: str, connected: Collection[str]) -> str | None:
    """The reachable state that an unreachable one resembles; None if no transition has the unreachable one."""
    return closest(state, connected) if _edges_with(resource, state) else None


def _edges_with(resource: Resource, state: str) -> list[Transition]:
    return [edge for edge in resource.transitions if state in (edge.source, edge.target)]
