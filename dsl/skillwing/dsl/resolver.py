"""From syntax nodes to the model: every name gets its meaning, every element its type.

The order is that of dependence: types, data, resources, then events and skills, which speak of all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from skillwing.dsl import syntax
from skillwing.dsl.model import (
    DEFAULT_DISPATCH_TIMEOUT,
    DEFAULT_INTERRUPT_TIMEOUT,
    DataItem,
    Effect,
    Event,
    Field,
    Interrupt,
    Invariant,
    Precondition,
    Predicate,
    Resource,
    Result,
    Skill,
    Skillset,
    Transition,
)
from skillwing.dsl.naming import class_name
from skillwing.dsl.predicates import Predicates, Vocabulary
from skillwing.dsl.report import Report
from skillwing.dsl.spans import Span
from skillwing.dsl.syntax import Word
from skillwing.dsl.types import Types

_Section = TypeVar("_Section")
_ANY = "*"


def resolve(root: syntax.SkillsetSyntax, report: Report) -> Skillset:
    """Build the model. What is wrong goes to the report, and the model then lacks the parts that have no meaning."""
    return _Resolver(root, report).skillset()


class _Resolver:
    def __init__(self, root: syntax.SkillsetSyntax, report: Report) -> None:
        self._root = root
        self._report = report
        self._types = Types(root.elements, report)
        self._data = {item.name: item for item in self._data_items()}
        self._resources = {resource.name: resource for resource in self._resource_items()}

    def skillset(self) -> Skillset:
        root = self._root
        self._report.declare({}, root.name, "skillset")
        events, skills = tuple(self._events()), tuple(self._skills())
        self._colliding_classes()
        self._unused_types()
        return Skillset(
            name=root.name.text,
            types=self._types.all,
            data=tuple(self._data.values()),
            resources=tuple(self._resources.values()),
            events=events,
            skills=skills,
            span=root.name.span,
        )

    def _elements(self, kind: type[_Section]) -> Iterator[_Section]:
        return (element for element in self._root.elements if isinstance(element, kind))

    # --- data

    def _data_items(self) -> Iterator[DataItem]:
        seen: dict[str, Word] = {}
        for block in self._elements(syntax.DataSyntax):
            for item in block.items:
                declared, unit = self._types.resolve(item.type), self._types.unit(item.unit)
                period = None if item.period is None else self._seconds(item.period, "period")
                if self._report.declare(seen, item.name, "datum") and declared is not None:
                    yield DataItem(item.name.text, declared, unit, period, item.name.span)

    def _seconds(self, number: syntax.Number, what: str) -> float:
        if number.value <= 0:
            message = f"A {what} of {number.value} seconds is not possible."
            self._report.add("SW025", number.span, message, "Write a number of seconds greater than zero.")
        return float(number.value)

    # --- resources

    def _resource_items(self) -> Iterator[Resource]:
        seen: dict[str, Word] = {}
        for declaration in self._elements(syntax.ResourceSyntax):
            resource = self._resource(declaration)
            if self._report.declare(seen, declaration.name, "resource"):
                yield resource

    def _resource(self, declaration: syntax.ResourceSyntax) -> Resource:
        name = declaration.name
        initials = [item.state for item in declaration.items if isinstance(item, syntax.InitialSyntax)]
        edges = [item for item in declaration.items if isinstance(item, syntax.TransitionSyntax)]
        states = self._states(declaration, initials, edges)
        if not initials:
            advice = f"Add `initial {states[0] if states else 'STATE'}`."
            self._report.add("SW030", name.span, f"The resource `{name.text}` has no initial state.", advice)
        for extra in initials[1:]:
            message = f"The resource `{name.text}` has two initial states."
            related = (initials[0].span, "the first one")
            self._report.add("SW030", extra.span, message, "Keep one of them.", related)
        initial = initials[0].text if initials else next(iter(states), "")
        transitions = tuple(self._transitions(name, edges, states))
        return Resource(name.text, states, initial, transitions, name.span)

    def _states(
        self,
        declaration: syntax.ResourceSyntax,
        initials: list[Word],
        edges: list[syntax.TransitionSyntax],
    ) -> tuple[str, ...]:
        """The states in the order of the `state { }` list, or of their first mention where there is none."""
        mentions = [*initials, *(side for edge in edges for side in (edge.source, edge.target) if side.text != _ANY)]
        blocks = [item for item in declaration.items if isinstance(item, syntax.StatesSyntax)]
        seen: dict[str, Word] = {}
        if not blocks:
            for word in mentions:
                if word.text not in seen:
                    self._report.declare(seen, word, "state")
            return tuple(seen)
        for word in (word for block in blocks for word in block.names):
            self._report.declare(seen, word, "state")
        for word in mentions:
            if word.text not in seen:
                self._report.unknown("SW011", word, f"state of `{declaration.name.text}`", seen)
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
                    self._report.add("SW016", span, message, "Remove one of them.", related)

    # --- events

    def _events(self) -> Iterator[Event]:
        seen: dict[str, Word] = {}
        predicates = Predicates(Vocabulary(self._resources, self._data, {}), self._report)
        for declaration in self._elements(syntax.EventSyntax):
            self._report.declare(seen, declaration.name, "event")
            guards = [item for item in declaration.items if isinstance(item, syntax.GuardSyntax)]
            blocks = [item for item in declaration.items if isinstance(item, syntax.EventEffectSyntax)]
            for extra in guards[1:]:
                message = f"The event `{declaration.name.text}` has two guards."
                self._report.add("SW017", extra.predicate.span, message, "Join them with `and`.")
            changes = tuple(change for block in blocks for change in block.changes)
            name = declaration.name
            guard = predicates.resolve(guards[0].predicate) if guards else None
            yield Event(name.text, guard, self._effect(syntax.EffectSyntax(name, changes)), name.span)

    # --- skills

    def _skills(self) -> Iterator[Skill]:
        seen: dict[str, Word] = {}
        for declaration in self._elements(syntax.SkillSyntax):
            self._report.declare(seen, declaration.name, "skill")
            yield _SkillResolver(self._skill_sections(declaration), self).skill(declaration.name)

    def _skill_sections(self, declaration: syntax.SkillSyntax) -> dict[str, syntax.Section]:
        sections: dict[str, syntax.Section] = {}
        for section in declaration.sections:
            first = sections.setdefault(section.keyword.text, section)
            if first is not section:
                word = section.keyword
                message = f"The skill `{declaration.name.text}` has `{word.text}` twice."
                related = (first.keyword.span, "first given here")
                self._report.add("SW017", word.span, message, "Merge the two.", related)
        return sections

    def _effect(self, declaration: syntax.EffectSyntax) -> Effect:
        changed: dict[str, Word] = {}
        pairs: list[tuple[str, str]] = []
        spans: list[Span] = []
        for change in declaration.changes:
            word, target = change.resource, change.target
            if word.text not in self._resources:
                self._report.unknown("SW010", word, "resource", self._resources)
                continue
            states = self._resources[word.text].states
            if target.text not in states:
                self._report.unknown("SW011", target, f"state of `{word.text}`", states)
                continue
            first = changed.setdefault(word.text, word)
            if first is not word:
                message = f"This effect changes `{word.text}` twice, and it is one atomic step."
                related = (first.span, "first changed here")
                self._report.add("SW043", word.span, message, "Keep one of the two.", related)
                continue
            pairs.append((word.text, target.text))
            spans.append(word.span.to(target.span))
        return Effect(declaration.name.text, tuple(pairs), declaration.name.span, tuple(spans))

    # --- across the file

    def _colliding_classes(self) -> None:
        """Report names that differ here and would be one Python class in the generated code."""
        named = [element.name for element in self._elements(syntax.StructSyntax)]
        named += [element.name for element in self._elements(syntax.EnumSyntax)]
        classes = [(class_name(name.text), name) for name in named]
        for skill in self._elements(syntax.SkillSyntax):
            stem = class_name(skill.name.text)
            classes += [(stem + suffix, skill.name) for suffix in ("Inputs", "Outputs", "Feedback")]
        seen: dict[str, Word] = {}
        for name, word in classes:
            first = seen.setdefault(name, word)
            if first.text != word.text:
                message = f"`{word.text}` and `{first.text}` would both become the class `{name}`."
                self._report.add("SW019", word.span, message, "Rename one of them.", (first.span, "the other one"))
                return

    def _unused_types(self) -> None:
        for declared in self._types.all:
            if declared.name not in self._types.used:
                message = f"Nothing has the type `{declared.name}`."
                self._report.add("SW083", declared.span, message, "Use it or remove it.")

    # What the skills need of the whole.

    def fields(self, section: object, kind: str) -> tuple[Field, ...]:
        if isinstance(section, syntax.FieldsSection | syntax.ProgressSection):
            return self._types.fields(section.fields, kind)
        return ()

    def seconds(self, number: syntax.Number, what: str) -> float:
        return self._seconds(number, what)

    def effect(self, declaration: syntax.EffectSyntax) -> Effect:
        return self._effect(declaration)

    def predicates(self, inputs: Iterable[Field]) -> Predicates:
        by_name = {field.name: field for field in inputs}
        return Predicates(Vocabulary(self._resources, self._data, by_name), self._report)

    @property
    def report(self) -> Report:
        return self._report


class _SkillResolver:
    """Resolves one skill. sections: by keyword, each at most once."""

    def __init__(self, sections: dict[str, syntax.Section], whole: _Resolver) -> None:
        self._sections = sections
        self._whole = whole
        self._report = whole.report
        self._effects: dict[str, Effect] = {}
        self._misnamed_effect = False
        self._inputs = whole.fields(sections.get("input"), "input")
        self._predicates = whole.predicates(self._inputs)

    def skill(self, name: Word) -> Skill:
        whole, sections = self._whole, self._sections
        self._declare_effects()
        progress = sections.get("progress")
        results = self._results(name)
        interrupt = self._interrupt(name, results)
        lost = sections.get("lost")
        applies = lost.applies if isinstance(lost, syntax.EndSection) else ()
        skill = Skill(
            name=name.text,
            progress_period=self._limit("progress"),
            feedback=whole.fields(progress, "feedback field"),
            inputs=self._inputs,
            outputs=whole.fields(sections.get("output"), "output"),
            effects=tuple(self._effects.values()),
            preconditions=self._preconditions(),
            invariants=tuple(self._invariants()),
            results=results,
            interrupt=interrupt,
            lost=self._effect_name(applies[0].effect) if applies else interrupt.apply,
            deadline=self._limit("deadline"),
            dispatch_timeout=self._limit("dispatch_timeout") or DEFAULT_DISPATCH_TIMEOUT,
            span=name.span,
        )
        self._missing_interrupt(skill)
        self._unused_effects(skill)
        return skill

    def _limit(self, keyword: str) -> float | None:
        section = self._sections.get(keyword)
        match section:
            case syntax.LimitSection(seconds=number) | syntax.ProgressSection(period=number):
                return self._whole.seconds(number, "period" if keyword == "progress" else keyword)
            case _:
                return None

    # --- effects

    def _declare_effects(self) -> None:
        section = self._sections.get("effect")
        if not isinstance(section, syntax.EffectSection):
            return
        seen: dict[str, Word] = {}
        for declaration in section.effects:
            effect = self._whole.effect(declaration)
            if self._report.declare(seen, declaration.name, "effect"):
                self._effects[effect.name] = effect

    def _effect_name(self, word: Word | None) -> str | None:
        if word is None or word.text in self._effects:
            return None if word is None else word.text
        self._misnamed_effect = True
        self._report.unknown("SW012", word, "effect", self._effects)
        return None

    def _unused_effects(self, skill: Skill) -> None:
        if self._misnamed_effect:
            return
        used = {
            skill.preconditions.success,
            skill.preconditions.failure,
            skill.interrupt.apply,
            skill.lost,
            *(invariant.violation for invariant in skill.invariants),
            *(result.apply for result in skill.results),
        }
        for effect in skill.effects:
            if effect.name not in used:
                message = f"Nothing in `{skill.name}` applies the effect `{effect.name}`."
                self._report.add("SW081", effect.span, message, "Apply it or remove it.")

    # --- guards

    def _preconditions(self) -> Precondition:
        section = self._sections.get("precondition")
        if not isinstance(section, syntax.PreconditionSection):
            return Precondition()
        seen: dict[str, Word] = {}
        checks: list[Predicate] = []
        for check in section.checks:
            expression = self._predicates.resolve(check.predicate)
            if self._report.declare(seen, check.name, "precondition") and expression is not None:
                checks.append(Predicate(check.name.text, check.predicate.kind, expression, check.name.span))
        for which, words in (("success", section.success), ("failure", section.failure)):
            for extra in words[1:]:
                message = f"There are two `{which}` effects here."
                self._report.add("SW017", extra.span, message, "Join them in one effect, `e { a -> X  b -> Y }`.")
        success = self._effect_name(section.success[0]) if section.success else None
        failure = self._effect_name(section.failure[0]) if section.failure else None
        return Precondition(tuple(checks), success, failure)

    def _invariants(self) -> Iterator[Invariant]:
        section = self._sections.get("invariant")
        if not isinstance(section, syntax.InvariantSection):
            return
        seen: dict[str, Word] = {}
        for item in section.invariants:
            expression = self._predicates.resolve(item.predicate)
            violation = self._effect_name(item.violation)
            if self._report.declare(seen, item.name, "invariant") and expression is not None:
                yield Invariant(item.name.text, item.predicate.kind, expression, violation, item.name.span)

    # --- ends

    def _results(self, skill: Word) -> tuple[Result, ...]:
        section = self._sections.get("result")
        if not isinstance(section, syntax.ResultSection):
            return ()
        marked = [item for item in section.results if item.partition is not None]
        for item in section.results if marked else ():
            if item.partition is None:
                message = f"`{item.name.text}` is neither `success` nor `failure`, other results of `{skill.text}` are."
                self._report.add("SW062", item.name.span, message, f"Write `failure {item.name.text}: ...`.")
        seen: dict[str, Word] = {}
        results: list[Result] = []
        for item in section.results:
            apply = self._effect_name(item.apply.effect) if item.apply else None
            post = self._predicates.resolve(item.post) if item.post else None
            if self._report.declare(seen, item.name, "result"):
                success = item.partition == "success" if marked else not results
                results.append(Result(item.name.text, success, apply, post, item.name.span))
        return tuple(results)

    def _interrupt(self, skill: Word, results: tuple[Result, ...]) -> Interrupt:
        section = self._sections.get("interrupt")
        given = section if isinstance(section, syntax.EndSection) else None
        timeouts = [self._whole.seconds(number, "timeout") for number in given.timeouts] if given else []
        timeout = timeouts[0] if timeouts else DEFAULT_INTERRUPT_TIMEOUT
        for extra in (*given.applies[1:], *given.timeouts[1:]) if given else ():
            span = extra.span if isinstance(extra, syntax.Number) else extra.effect.span
            self._report.add(
                "SW017", span, f"The `interrupt` of `{skill.text}` says this twice.", "Keep one of the two."
            )
        if given is not None and given.applies:
            return Interrupt(self._effect_name(given.applies[0].effect), timeout)
        agreed = {result.apply for result in results}
        return Interrupt(agreed.pop() if len(agreed) == 1 else None, timeout)

    def _missing_interrupt(self, skill: Skill) -> None:
        """Without a word in the file, the effect on which all results agree is the interrupt's; else it is missing."""
        section = self._sections.get("interrupt")
        if isinstance(section, syntax.EndSection) and section.applies:
            return
        differ = len({result.apply for result in skill.results}) > 1
        takes = bool(skill.transitions(skill.preconditions.success))
        if differ or (takes and not skill.results):
            reason = "its results apply different effects" if differ else "it takes resources and has no result"
            message = f"`{skill.name}` does not say what an interruption applies, and {reason}."
            choices = " or ".join(f"`interrupt {{ apply={name} }}`" for name in self._effects)
            self._report.add("SW060", skill.span, message, f"Write {choices}.")
