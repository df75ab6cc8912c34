"""The partial model of a file with errors: its sound elements, without those of unknown behaviour.

An element is damaged if an error leaves its behaviour open, or if it names a damaged resource. A damaged skill may do
anything to the resources that it names, so these are unconstrained (`StateSpace.unconstrained`). What the analysis then
calls impossible stays impossible when the errors are fixed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from skillwing.dsl.checking.source_locations import SourceLocations
from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.model import Skill, Skillset
from skillwing.dsl.queries import named_by
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Span

_LEAVES_BEHAVIOUR = frozenset(
    {"SW013", "SW018", "SW019", "SW021", "SW022", "SW023", "SW024", "SW025", "SW026", "SW044", "SW062"}
)
"""Errors that concern types, values and names alone. The predicates that they affect are in `DiagnosticReport.lost`."""
_LEAVES_RESOURCES_OPEN = frozenset({"SW010", "SW092"})
"""Errors after which a skill may name any resource."""


@dataclass(frozen=True, slots=True)
class PartialModel:
    """The sound part of a skillset. unconstrained: resources that the other part may move at any time."""

    skillset: Skillset
    unconstrained: frozenset[str]


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
    hurt = [element for element in map(locations.at, (*spans, *lost)) if element is not None]
    gone = {element.name.text for element in hurt if isinstance(element, syntax.ResourceSyntax)}
    named = {element.name.text for element in hurt if isinstance(element, syntax.SkillSyntax)}
    silent = {element.name.text for element in hurt if isinstance(element, syntax.EventSyntax)}
    sound = [skill for skill in skillset.skills if skill.name not in named and gone.isdisjoint(named_by(skill))]
    damaged = {skill.name for skill in skillset.skills} - {skill.name for skill in sound}
    resources = tuple(resource for resource in skillset.resources if resource.name not in gone)
    if misread or any(item.code in _LEAVES_RESOURCES_OPEN for item in wrong):
        unconstrained = {resource.name for resource in resources}
    else:
        unconstrained = {
            name for skill in skillset.skills if skill.name in damaged for name in _may_move(skill, locations)
        }
    events = tuple(event for event in skillset.events if event.name not in silent and gone.isdisjoint(named_by(event)))
    left = replace(skillset, resources=resources, events=events, skills=tuple(sound))
    return PartialModel(left, frozenset(unconstrained))


def _may_move(skill: Skill, locations: SourceLocations) -> Iterator[str]:
    """The resources that the effects of a skill name, also those that are not declared."""
    declaration = locations.at(skill.span) if skill.span else None
    if isinstance(declaration, syntax.SkillSyntax):
        for section in declaration.sections:
            if isinstance(section, syntax.EffectSection):
                yield from (change.resource.text for effect in section.effects for change in effect.changes)
