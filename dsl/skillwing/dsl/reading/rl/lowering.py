"""Lowering of `.rl` nodes to those of the skillset language, with remarks on features without a counterpart."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import TypeVar

from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.expressions import And, depth
from skillwing.dsl.naming import is_usable
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.dialect import ReadOther
from skillwing.dsl.reading.rl.effects import InlineEffects
from skillwing.dsl.reading.rl.includes import included_by
from skillwing.dsl.reading.rl.postconditions import names_in, without
from skillwing.dsl.reading.rl.syntax import (
    EVERY_STATE,
    ChecksNode,
    IncludeNode,
    InterruptNode,
    InvariantsNode,
    Node,
    ParametersNode,
    PostNode,
    ResultNode,
    ResultsNode,
    RlFile,
    SectionNode,
    SkillNode,
    StartNode,
    TypesNode,
)
from skillwing.dsl.reading.rl.types import RlTypes
from skillwing.dsl.reading.syntax import CoinedWord
from skillwing.dsl.spans import Span, Word

_Kind = TypeVar("_Kind")
_DEEPEST = 100


def lowered(root: object, file: str, read: ReadOther) -> syntax.SkillsetSyntax | None:
    """Return the skillset that an `.rl` file describes. Its remarks report what means less, or something else, here.

    A library of types is a skillset of its own, which is named after its file.
    """
    if not isinstance(root, RlFile):
        return None
    report = DiagnosticReport()
    included = included_by(root, file, read, report)
    types = RlTypes((word for node in _only(root.nodes, TypesNode) for word in node.names), included, report)
    elements = tuple(_Lowering(types, report).elements(root.nodes))
    if root.name is None:
        return syntax.SkillsetSyntax(_library_name(file), types.structures, tuple(report.diagnostics), is_library=True)
    return syntax.SkillsetSyntax(root.name, (*types.structures, *elements), tuple(report.diagnostics))


def _library_name(file: str) -> Word:
    """The name of a library of types: that of its file, if it can be one."""
    stem = re.sub(r"\W", "_", Path(file).stem)
    return CoinedWord(stem if is_usable(stem) else "types", Span(file, 1, 1, 1, 2))


class _Lowering:
    def __init__(self, types: RlTypes, report: DiagnosticReport) -> None:
        self._types = types
        self._report = report

    def elements(self, nodes: Sequence[Node]) -> Iterator[syntax.Element]:
        skills = [self._skill(node) for node in _only(nodes, SkillNode)]
        by_skills, by_events = _changed(skills), _changed(_only(nodes, syntax.EventSyntax))
        skill = iter(skills)
        for node in nodes:
            match node:
                case ParametersNode():
                    yield self._common_parameters(node)
                case syntax.DataSyntax(items):
                    yield syntax.DataSyntax(tuple(replace(item, type=self._types.use(item.type)) for item in items))
                case syntax.ResourceSyntax():
                    yield _divided(node, by_skills, by_events)
                case syntax.EventSyntax():
                    yield node
                case SkillNode():
                    yield next(skill)
                case TypesNode() | IncludeNode():
                    pass  # The uses of types are replaced.

    def _common_parameters(self, node: ParametersNode) -> syntax.DataSyntax:
        for field in node.fields:
            message = f"The parameter `{field.name.text}` of the skillset is read as a datum."
            self._report.add("SW091", field.name.span, message, "Let the functional layer publish its value.")
        return syntax.DataSyntax(
            tuple(
                syntax.DatumSyntax(field.name, self._types.use(field.type), unit=None, period=None)
                for field in node.fields
            )
        )

    # --- skills

    def _skill(self, node: SkillNode) -> syntax.SkillSyntax:
        effects = InlineEffects()
        sections = [
            *self._fields(node),
            *(
                replace(section, fields=self._typed(section.fields))
                for section in _only(node.sections, syntax.ProgressSection)
            ),
            *_preconditions(node.sections, effects),
            *_invariants(node.sections, effects),
            *self._ends(node, effects),
        ]
        if effects.declared:
            sections.append(syntax.EffectSection(CoinedWord("effect", node.name.span), effects.declared))
        return syntax.SkillSyntax(node.name, tuple(sections))

    def _fields(self, node: SkillNode) -> Iterator[syntax.FieldsSection]:
        """Inputs, parameters among them, and outputs."""
        given = _only(node.sections, syntax.FieldsSection)
        parameters = _only(node.sections, ParametersNode)
        for field in (field for section in parameters for field in section.fields):
            message = f"The parameter `{field.name.text}` of `{node.name.text}` is read as an input."
            self._report.add("SW091", field.name.span, message, "Give its value with every goal.")
        for word in ("input", "output"):
            sections = [section for section in given if section.keyword.text == word]
            sections += [syntax.FieldsSection(it.keyword, it.fields) for it in parameters if word == "input"]
            if sections:
                fields = tuple(field for section in sections for field in section.fields)
                yield syntax.FieldsSection(CoinedWord(word, sections[0].keyword.span), self._typed(fields))

    def _typed(self, fields: Iterable[syntax.FieldSyntax]) -> tuple[syntax.FieldSyntax, ...]:
        return tuple(replace(field, type=self._types.use(field.type)) for field in fields)

    # --- ends

    def _ends(self, node: SkillNode, effects: InlineEffects) -> Iterator[syntax.Section]:
        groups = _only(node.sections, ResultsNode)
        results = tuple(self._result(item, group, effects) for group in groups for item in group.results)
        if groups:
            yield syntax.ResultSection(CoinedWord("result", groups[0].keyword.span), results)
        interrupts = _only(node.sections, InterruptNode)
        for interrupt in interrupts:
            yield self._interrupt(node, interrupt, effects)
        if not interrupts and self._undecided(node, results):
            message = f"`{node.name.text}` has no `interrupt`: an interruption changes no resource."
            self._report.add("SW094", node.name.span, message, _interrupt_advice(results, effects))
            yield _end(node.name, effects.nothing(node.name))

    def _undecided(self, node: SkillNode, results: Sequence[syntax.ResultSyntax]) -> bool:
        """True if no effect of an interruption follows: the results disagree, or resources are taken and there is no
        result.
        """
        applied = {None if result.apply is None else result.apply.effect.text for result in results}
        takes = any(start.changes for start in _only(node.sections, StartNode))
        return len(applied) > 1 or (takes and not results)

    def _result(self, node: ResultNode, group: ResultsNode, effects: InlineEffects) -> syntax.ResultSyntax:
        effect = effects.of(node.changes)
        for post in node.posts:
            self._unnamed(post)
        posts = [part for post in node.posts if (part := self._before_effect(post, node)) is not None]
        return syntax.ResultSyntax(
            node.name, group.keyword.text, None if effect is None else syntax.ApplySyntax(effect), _joined(posts)
        )

    def _interrupt(self, skill: SkillNode, node: InterruptNode, effects: InlineEffects) -> syntax.EndSection:
        for post in node.posts:
            message = f"The postcondition of an interruption of `{skill.name.text}` is not evaluated: it cannot fail."
            self._report.add("SW093", post.predicate.span, message, "Write it as the postcondition of a result.")
        return _end(node.keyword, effects.of(node.changes) or effects.nothing(node.keyword))

    def _unnamed(self, post: PostNode) -> None:
        if post.name is not None:
            message = f"The name `{post.name.text}` of this postcondition is not kept."
            self._report.add("SW096", post.name.span, message, "Remove it: a failed condition is reported by its text.")

    def _before_effect(self, post: PostNode, result: ResultNode) -> syntax.PredicateSyntax | None:
        """The part of a postcondition that its effect cannot change."""
        predicate = post.predicate
        if depth(predicate.expression) > _DEEPEST:
            return predicate  # The checker rejects it.
        changed = {change.resource.text for change in result.changes} & names_in(predicate.expression)
        if not changed:
            return predicate
        for name in sorted(changed):
            message = (
                f"The postcondition of `{result.name.text}` is not evaluated for `{name}`, which its effect changes."
            )
            advice = "It means the state before the effect: write it as an invariant."
            self._report.add("SW097", predicate.span, message, advice)
        left = without(predicate.expression, changed)
        return None if left is None else replace(predicate, expression=left)


# --- sections that need no remarks


def _preconditions(nodes: Iterable[SectionNode], effects: InlineEffects) -> Iterator[syntax.PreconditionSection]:
    parts = [node for node in nodes if isinstance(node, ChecksNode | StartNode)]
    if not parts:
        return
    checks = tuple(check for part in _only(parts, ChecksNode) for check in part.checks)
    start = effects.of([change for part in _only(parts, StartNode) for change in part.changes])
    keyword = CoinedWord("precondition", parts[0].keyword.span)
    yield syntax.PreconditionSection(keyword, checks, () if start is None else (start,), ())


def _invariants(nodes: Iterable[SectionNode], effects: InlineEffects) -> Iterator[syntax.InvariantSection]:
    blocks = _only(nodes, InvariantsNode)
    if blocks:
        invariants = tuple(
            syntax.InvariantSyntax(node.name, node.guard, effects.of(node.changes))
            for block in blocks
            for node in block.invariants
        )
        yield syntax.InvariantSection(CoinedWord("invariant", blocks[0].keyword.span), invariants)


def _end(place: Word, effect: Word) -> syntax.EndSection:
    return syntax.EndSection(CoinedWord("interrupt", place.span), (syntax.ApplySyntax(effect),), ())


def _interrupt_advice(results: Iterable[syntax.ResultSyntax], effects: InlineEffects) -> str:
    applied = [result.apply.effect.text for result in results if result.apply is not None]
    choice = effects.written(applied[-1]) if applied else "RESOURCE -> STATE"
    return f"Say what it changes, for instance `interrupt {{ interrupting true effect {choice} }}`."


def _joined(predicates: Sequence[syntax.PredicateSyntax]) -> syntax.PredicateSyntax | None:
    if not predicates:
        return None
    expression = reduce(And, (predicate.expression for predicate in predicates))
    return syntax.PredicateSyntax("resource", expression, predicates[0].span.to(predicates[-1].span))


# --- the takers of transitions, which an `.rl` file leaves to what its skills and events do


def _divided(
    resource: syntax.ResourceSyntax, by_skills: Set[tuple[str, str]], by_events: Set[tuple[str, str]]
) -> syntax.ResourceSyntax:
    """Mark the transitions of a resource as internal, extern or both. by_...: (resource, target state) pairs.

    A transition of a skill is internal, one of an event is extern. One of neither is extern, too: published files leave
    it to the robot, such as a pilot who hands over the authority.
    """
    name = resource.name.text
    items: list[syntax.StatesSyntax | syntax.InitialSyntax | syntax.TransitionSyntax] = []
    for item in resource.items:
        if not isinstance(item, syntax.TransitionSyntax):
            items.append(item)
            continue
        for edge in _by_target(item, resource):
            change = (name, edge.target.text)
            if change in by_skills:
                items.append(edge)
            if change in by_events or change not in by_skills:
                items.append(replace(edge, extern=True))
    return syntax.ResourceSyntax(resource.name, tuple(items))


def _by_target(edge: syntax.TransitionSyntax, resource: syntax.ResourceSyntax) -> Iterator[syntax.TransitionSyntax]:
    """A transition into any state as one transition for each state, since each may be internal or extern."""
    if edge.target.text != EVERY_STATE:
        yield edge
        return
    for states in (item for item in resource.items if isinstance(item, syntax.StatesSyntax)):
        for state in states.names:
            yield replace(edge, target=CoinedWord(state.text, edge.target.span))


# --- looking into nodes


def _only(nodes: Iterable[object], kind: type[_Kind]) -> list[_Kind]:
    return [node for node in nodes if isinstance(node, kind)]


def _changed(elements: Iterable[syntax.SkillSyntax | syntax.EventSyntax]) -> frozenset[tuple[str, str]]:
    """The (resource, target state) pairs of everything that skills or events apply."""
    parts = [
        part
        for element in elements
        for part in (element.items if isinstance(element, syntax.EventSyntax) else element.sections)
    ]
    effects: list[syntax.EffectSyntax | syntax.EventEffectSyntax] = [*_only(parts, syntax.EventEffectSyntax)]
    effects += [effect for part in _only(parts, syntax.EffectSection) for effect in part.effects]
    return frozenset((change.resource.text, change.target.text) for effect in effects for change in effect.changes)
