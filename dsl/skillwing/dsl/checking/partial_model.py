"""The partial model of a file with errors: its sound elements, and the readable parts of the damaged ones.

An element is damaged if an error leaves its behaviour open, or if it names a damaged resource. A damaged skill may do
anything to the resources that it names, so these are unconstrained (`StateSpace.unconstrained`). A damaged resource may
be in any of its states. What the analysis then calls impossible stays impossible when the errors are fixed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TypeGuard

from skillwing.dsl.checking.source_locations import SourceLocations
from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.expressions import Expression, names_used
from skillwing.dsl.model import Effect, Event, Precondition, Resource, Skill, Skillset, Transition
from skillwing.dsl.queries import named_by
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest

_LEAVES_BEHAVIOUR = frozenset(
    {
        *("SW013", "SW018", "SW019", "SW021", "SW022", "SW023", "SW024", "SW025", "SW026", "SW044", "SW062"),
        *("SW070", "SW071", "SW072", "SW098", "SW099"),
    }
)
"""Errors that concern types, values and names alone. The predicates that they affect are in `DiagnosticReport.lost`."""
_LEAVES_RESOURCES_OPEN = frozenset({"SW010"})
"""Errors after which a skill may name any resource."""
_LEAVES_THE_REST = frozenset({"SW003"})
"""Syntax errors after which the rest of an element is read as it is meant."""
_MOST_STATES = 32
"""States of a damaged resource that takes part in the analysis: each transition between them is possible."""


@dataclass(frozen=True, slots=True)
class PartialModel:
    """The readable part of a skillset.

    skillset: the sound elements. unconstrained: resources that the others may move at any time. skills, events: the
    damaged ones, with the parts that every correction leaves as they are.
    """

    skillset: Skillset
    unconstrained: frozenset[str]
    skills: tuple[Skill, ...]
    events: tuple[Event, ...]


def partial_model(
    skillset: Skillset,
    locations: SourceLocations,
    misread: Iterable[Diagnostic],
    wrong: Iterable[Diagnostic],
    lost: Iterable[Span],
) -> PartialModel:
    """Return the part of a skillset that can be analysed.

    misread: syntax errors. wrong: problems with names and types. lost: spans of elements that were left out because of
    an error elsewhere.
    """
    misread, wrong = tuple(misread), tuple(item for item in wrong if item.severity == "error")
    spans = [item.span for item in (*misread, *wrong) if item.code not in _LEAVES_BEHAVIOUR]
    places = [(element, span) for span in (*spans, *lost) if (element := locations.at(span)) is not None]
    hurt = [element for element, _ in places]
    unsure = {element.name.text for element in hurt if isinstance(element, syntax.ResourceSyntax)}
    named = {element.name.text for element in hurt if isinstance(element, syntax.SkillSyntax)}
    silent = {element.name.text for element in hurt if isinstance(element, syntax.EventSyntax)}
    sound = [skill for skill in skillset.skills if skill.name not in named and unsure.isdisjoint(named_by(skill))]
    is_sound = {skill.name for skill in sound}
    damaged = [skill for skill in skillset.skills if skill.name not in is_sound]
    unread = [locations.at(item.span) for item in misread if item.code not in _LEAVES_THE_REST]
    resources = tuple(
        _unsure(resource, locations, places) if resource.name in unsure else resource
        for resource in skillset.resources
        if resource.name not in unsure or _has_known_states(resource, hurt, unread)
    )
    if misread or any(item.code in _LEAVES_RESOURCES_OPEN for item in wrong):
        unconstrained = {resource.name for resource in resources}
    else:
        unconstrained = {name for skill in damaged for name in _may_move(skill, locations)} | unsure
    events = [event for event in skillset.events if event.name not in silent and unsure.isdisjoint(named_by(event))]
    left = replace(skillset, resources=resources, events=tuple(events), skills=tuple(sound))
    known = {resource.name for resource in resources}
    return PartialModel(
        left,
        frozenset(unconstrained),
        tuple(_certain_part(skill, known, locations) for skill in damaged if _is_read(skill, locations, unread)),
        tuple(
            event
            for event in skillset.events
            if event not in events and named_by(event) <= known and _is_read(event, locations, unread)
        ),
    )


def _has_known_states(
    resource: Resource, hurt: Collection[syntax.Element], unread: Collection[syntax.Element | None]
) -> bool:
    """True if the states of a damaged resource are known: it is declared once, without a syntax error."""
    declarations = [
        element for element in hurt if isinstance(element, syntax.ResourceSyntax) and element.name.text == resource.name
    ]
    is_single = all(element.name.span == resource.span for element in declarations)
    return is_single and not any(each in unread for each in declarations) and len(resource.states) <= _MOST_STATES


def _unsure(resource: Resource, locations: SourceLocations, places: Iterable[tuple[syntax.Element, Span]]) -> Resource:
    """A resource that may go from any state to any other: those that it declares, and those that it mentions.

    places: of the errors. If only the initial state is misspelt, a state that extern transitions alone lead to stays
    out of the reach of skills.
    """
    states = dict.fromkeys(resource.states)
    declaration = locations.at(resource.span) if resource.span else None
    reported = frozenset[str]()
    if isinstance(declaration, syntax.ResourceSyntax):
        edges = (item for item in declaration.items if isinstance(item, syntax.TransitionSyntax))
        states |= dict.fromkeys(word.text for edge in edges for word in (edge.source, edge.target) if word.text != "*")
        if _is_only_initial(declaration, states, [span for element, span in places if element is declaration]):
            reported = _targets(resource, extern=True) - _targets(resource, extern=False)
    transitions = tuple(
        Transition(source, target, extern)
        for source in states
        for target in states
        for extern in (False, True)
        if source != target and (extern or target not in reported)
    )
    return replace(resource, states=tuple(states), initial=next(iter(states), ""), transitions=transitions)


def _is_only_initial(declaration: syntax.ResourceSyntax, states: Iterable[str], wrong: Iterable[Span]) -> bool:
    """True if all that is wrong is an initial state that resembles another state. wrong: places of the errors."""
    initials = [item.state for item in declaration.items if isinstance(item, syntax.InitialSyntax)]
    if any(span != initial.span for span in wrong for initial in initials):
        return False
    return all(closest(each.text, [state for state in states if state != each.text]) for each in initials)


def _targets(resource: Resource, *, extern: bool) -> frozenset[str]:
    return frozenset(edge.target for edge in resource.transitions if edge.extern is extern)


# --- damaged skills


def _is_read(element: Skill | Event, locations: SourceLocations, misread: Collection[syntax.Element | None]) -> bool:
    """True if the element was read as it is written, but for misspelt words of the language."""
    return element.span is not None and locations.at(element.span) not in misread


def _certain_part(skill: Skill, known: Collection[str], locations: SourceLocations) -> Skill:
    """The parts of a damaged skill that can be judged alone.

    Left out are inputs that are declared twice, and predicates on resources that are not `known`. A postcondition whose
    effect is not certain stays without it.
    """
    sections = _sections(skill, locations)
    declared = Counter(field.name.text for section in sections if _is_input(section) for field in section.fields)
    changes = {
        effect.name.text: len(effect.changes)
        for section in sections
        if isinstance(section, syntax.EffectSection)
        for effect in section.effects
    }
    certain = {effect.name for effect in skill.effects if changes.get(effect.name) == len(effect.transitions)}
    checks = [check for check in skill.preconditions.checks if _is_on(check.expression, known)]
    return replace(
        skill,
        inputs=tuple(field for field in skill.inputs if declared[field.name] == 1),
        effects=tuple(_on_known(effect, known) for effect in skill.effects),
        preconditions=Precondition(tuple(checks)),
        invariants=tuple(item for item in skill.invariants if _is_on(item.expression, known)),
        results=tuple(
            replace(result, apply=result.apply if result.apply in certain else None)
            for result in skill.results
            if result.post is not None and _is_on(result.post, known)
        ),
    )


def _is_on(expression: Expression, known: Collection[str]) -> bool:
    return names_used(expression, "resource") <= set(known)


def _on_known(effect: Effect, known: Collection[str]) -> Effect:
    kept = [at for at, (name, _) in enumerate(effect.transitions) if name in known]
    transitions, spans = (tuple(each[at] for at in kept) for each in (effect.transitions, effect.spans))
    return replace(effect, transitions=transitions, spans=spans)


def _may_move(skill: Skill, locations: SourceLocations) -> Iterator[str]:
    """The resources that the effects of a skill name, also those that are not declared."""
    for section in _sections(skill, locations):
        if isinstance(section, syntax.EffectSection):
            yield from (change.resource.text for effect in section.effects for change in effect.changes)


def _sections(skill: Skill, locations: SourceLocations) -> tuple[syntax.Section, ...]:
    declaration = locations.at(skill.span) if skill.span else None
    return declaration.sections if isinstance(declaration, syntax.SkillSyntax) else ()


def _is_input(section: syntax.Section) -> TypeGuard[syntax.FieldsSection]:
    return isinstance(section, syntax.FieldsSection) and section.keyword.text == "input"
