"""Declarations that skills and events refer to: types, data and resources, effects and guards."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from skillwing.dsl.checking.predicates import Predicates, VisibleNames
from skillwing.dsl.checking.types import Types
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import DataItem, Effect, Field, Resource, Transition
from skillwing.dsl.reading import syntax
from skillwing.dsl.spans import Span, Word

_ANY = "*"


class Declarations:
    """The resolved declarations of a skillset. Their problems are in `report`."""

    def __init__(self, root: syntax.SkillsetSyntax, report: DiagnosticReport) -> None:
        self.report = report
        self.types = Types(root.elements, report)
        self.data = {item.name: item for item in self._data_items(root)}
        self.resources = {resource.name: resource for resource in self._resource_items(root)}

    # --- for events and skills

    def fields(self, section: object, kind: str) -> tuple[Field, ...]:
        """Resolve the fields of a section; none for a section without fields."""
        if isinstance(section, syntax.FieldsSection | syntax.ProgressSection):
            return self.types.fields(section.fields, kind)
        return ()

    def predicates(self, inputs: Iterable[Field] = ()) -> Predicates:
        """A resolver of predicates that may name these inputs."""
        by_name = {field.name: field for field in inputs}
        return Predicates(VisibleNames(self.resources, self.data, by_name, self.types.untyped), self.report)

    def effect(self, declaration: syntax.EffectSyntax) -> Effect:
        """Resolve an effect. Changes without a meaning are left out."""
        changed: dict[str, Word] = {}
        pairs: list[tuple[str, str]] = []
        spans: list[Span] = []
        for change in declaration.changes:
            word, target = change.resource, change.target
            if word.text not in self.resources:
                self.report.unknown("SW010", word, "resource", self.resources)
                continue
            states = self.resources[word.text].states
            if target.text not in states:
                self.report.unknown("SW011", target, f"state of `{word.text}`", states)
                continue
            first = changed.setdefault(word.text, word)
            if first is not word:
                message = f"This effect changes `{word.text}` twice, and it is one atomic step."
                related = (first.span, "first changed here")
                self.report.add("SW043", word.span, message, "Keep one of the two.", related)
                continue
            pairs.append((word.text, target.text))
            spans.append(word.span.to(target.span))
        return Effect(declaration.name.text, tuple(pairs), declaration.name.span, tuple(spans))

    def seconds(self, number: syntax.Number, what: str) -> float:
        """Return a duration. Reports a number that is none."""
        if number.value <= 0:
            message = f"A {what} of {number.value} seconds is not possible."
            self.report.add("SW025", number.span, message, "Write a number of seconds greater than zero.")
        return float(number.value)

    # --- data

    def _data_items(self, root: syntax.SkillsetSyntax) -> Iterator[DataItem]:
        seen: dict[str, Word] = {}
        for block in (element for element in root.elements if isinstance(element, syntax.DataSyntax)):
            for item in block.items:
                declared, unit = self.types.resolve(item.type), self.types.unit(item.unit)
                period = None if item.period is None else self.seconds(item.period, "period")
                if declared is None:
                    self.types.untyped.add(item.name.text)
                low, high = (None, None) if declared is None else self.types.bounds(item.bounds, declared)
                if self.report.declare(seen, item.name, "datum") and declared is not None:
                    yield DataItem(item.name.text, declared, unit, period, low, high, item.name.span)

    # --- resources

    def _resource_items(self, root: syntax.SkillsetSyntax) -> Iterator[Resource]:
        seen: dict[str, Word] = {}
        for declaration in (element for element in root.elements if isinstance(element, syntax.ResourceSyntax)):
            resource = self._resource(declaration)
            if self.report.declare(seen, declaration.name, "resource"):
                yield resource

    def _resource(self, declaration: syntax.ResourceSyntax) -> Resource:
        name = declaration.name
        initials = [item.state for item in declaration.items if isinstance(item, syntax.InitialSyntax)]
        edges = [item for item in declaration.items if isinstance(item, syntax.TransitionSyntax)]
        states = self._states(declaration, initials, edges)
        if not initials:
            advice = f"Add `initial {states[0] if states else 'STATE'}`."
            self.report.add("SW030", name.span, f"The resource `{name.text}` has no initial state.", advice)
        for extra in initials[1:]:
            message = f"The resource `{name.text}` has two initial states."
            related = (initials[0].span, "the first one")
            self.report.add("SW030", extra.span, message, "Keep one of them.", related)
        initial = initials[0].text if initials else next(iter(states), "")
        transitions = tuple(self._transitions(name, edges, states))
        return Resource(name.text, states, initial, transitions, name.span)

    def _states(
        self,
        declaration: syntax.ResourceSyntax,
        initials: list[Word],
        edges: list[syntax.TransitionSyntax],
    ) -> tuple[str, ...]:
        """The states in the order of the `state { }` list, or of their first mention if there is no list."""
        mentions = [*initials, *(side for edge in edges for side in (edge.source, edge.target) if side.text != _ANY)]
        blocks = [item for item in declaration.items if isinstance(item, syntax.StatesSyntax)]
        seen: dict[str, Word] = {}
        if not blocks:
            for word in mentions:
                if word.text not in seen:
                    self.report.declare(seen, word, "state")
            return tuple(seen)
        for word in (word for block in blocks for word in block.names):
            self.report.declare(seen, word, "state")
        for word in mentions:
            if word.text not in seen:
                self.report.unknown("SW011", word, f"state of `{declaration.name.text}`", seen)
        return tuple(seen)

    def _transitions(
        self, resource: Word, edges: Iterable[syntax.TransitionSyntax], states: tuple[str, ...]
    ) -> Iterator[Transition]:
        seen: dict[tuple[str, str, bool], syntax.TransitionSyntax] = {}
        for edge in edges:
            sources = states if edge.source.text == _ANY else (edge.source.text,)
            targets = states if edge.target.text == _ANY else (edge.target.text,)
            wild = _ANY in (edge.source.text, edge.target.text)
            for source, target in ((a, b) for a in sources for b in targets if not (wild and a == b)):
                first = seen.setdefault((source, target, edge.extern), edge)
                if first is edge:
                    yield Transition(source, target, edge.extern, edge.source.span.to(edge.target.span))
                elif not wild and _ANY not in (first.source.text, first.target.text):
                    message = f"The transition `{source} -> {target}` of `{resource.text}` is declared twice."
                    related = (first.source.span.to(first.target.span), "first declared here")
                    span = edge.source.span.to(edge.target.span)
                    self.report.add("SW016", span, message, "Remove one of them.", related)
