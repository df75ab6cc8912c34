"""The index of names, from syntax nodes.

It looks names up by the rules of the checker (`checking/resolver.py`), and continues where the checker reports a
problem. An undeclared name is an occurrence without a symbol.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.editor.names import Declaration, Index, NameScope, Occurrence, Symbol, SymbolKind
from skillwing.dsl.editor.positions import Lines
from skillwing.dsl.expressions import Comparison, Name, NamedValue, Term, terms
from skillwing.dsl.reading import syntax
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.spans import Span, Word

TYPES = NameScope("type")
_DATA = NameScope("datum")
_RESOURCES = NameScope("resource")
_ANY = "*"
_SIGNS = frozenset({"ARROW", "COMPARATOR"})

_Named: TypeAlias = (
    syntax.FieldSyntax
    | syntax.DatumSyntax
    | syntax.EffectSyntax
    | syntax.CheckSyntax
    | syntax.InvariantSyntax
    | syntax.ResultSyntax
)


def index(root: syntax.SkillsetSyntax | None, lines: Lines, words: Sequence[Lexeme]) -> Index:
    """Collect the names of a file. root: its syntax tree as far as it was read; words: all but comments."""
    builder = _Builder(lines, words)
    if root is not None:
        builder.declare_all(root)
        builder.use_all(root)
        builder.use_unread()
    return builder.index()


class _Builder:
    def __init__(self, lines: Lines, words: Sequence[Lexeme]) -> None:
        self.declarations: dict[Symbol, Declaration] = {}
        self.occurrences: dict[int, Occurrence] = {}
        self._lines = lines
        self._words = words
        self._positions = {word.start: position for position, word in enumerate(words)}

    def index(self) -> Index:
        """The names collected so far. An occurrence that declares a name may also use it."""
        declarations = {
            symbol: replace(declaration, place=declaration.place and self.occurrences[declaration.place.start])
            for symbol, declaration in self.declarations.items()
        }
        return Index(declarations, self.occurrences.values())

    # --- declarations

    def declare_all(self, root: syntax.SkillsetSyntax) -> None:
        self._declare(NameScope("skillset"), root.name, root)
        for element in root.elements:
            match element:
                case syntax.DataSyntax(items=items):
                    self._declare_each(_DATA, items)
                case syntax.EnumSyntax(name=name, values=values):
                    self._declare(TYPES, name, element)
                    for value in values:
                        self._declare(NameScope("value", name.text), value, value)
                case syntax.StructSyntax(name=name, fields=fields):
                    self._declare(TYPES, name, element)
                    self._declare_each(NameScope("field", name.text), fields)
                case syntax.ResourceSyntax():
                    self._declare(_RESOURCES, element.name, element)
                    self._declare_states(element)
                case syntax.EventSyntax():
                    self._declare(NameScope("event"), element.name, element)
                case syntax.SkillSyntax():
                    self._declare(NameScope("skill"), element.name, element)
                    for section in element.sections:
                        self._declare_section(section, element.name.text)

    def _declare_states(self, resource: syntax.ResourceSyntax) -> None:
        """Declare the states: by the `state { }` list, or by their first mention if there is no list."""
        scope = NameScope("state", resource.name.text)
        listed = [word for item in resource.items if isinstance(item, syntax.StatesSyntax) for word in item.names]
        if listed:
            for word in listed:
                self._declare(scope, word, resource)
            return
        for word in _mentions(resource):
            if Symbol(scope, word.text) not in self.declarations:
                self._declare(scope, word, resource)

    def _declare_section(self, section: syntax.Section, skill: str) -> None:
        match section:
            case syntax.FieldsSection(keyword=keyword, fields=fields):
                self._declare_each(NameScope(_fields_kind(keyword), skill), fields)
            case syntax.ProgressSection(fields=fields):
                self._declare_each(NameScope("feedback", skill), fields)
            case syntax.EffectSection(effects=effects):
                self._declare_each(NameScope("effect", skill), effects)
            case syntax.PreconditionSection(checks=checks):
                self._declare_each(NameScope("precondition", skill), checks)
            case syntax.InvariantSection(invariants=invariants):
                self._declare_each(NameScope("invariant", skill), invariants)
            case syntax.ResultSection(results=results):
                self._declare_each(NameScope("result", skill), results)
            case _:
                pass

    def _declare_each(self, scope: NameScope, nodes: Iterable[_Named]) -> None:
        for node in nodes:
            self._declare(scope, node.name, node)

    def _declare(self, scope: NameScope, word: Word, node: object) -> None:
        if not word.text:
            return
        symbol = Symbol(scope, word.text)
        place = self._note(word, (scope,), symbol, declares=True)
        self.declarations.setdefault(symbol, Declaration(node, place))

    # --- uses

    def use_all(self, root: syntax.SkillsetSyntax) -> None:
        for element in root.elements:
            match element:
                case syntax.DataSyntax(items=items):
                    for item in items:
                        self._use_type(item.type)
                case syntax.StructSyntax(fields=fields):
                    self._use_fields(fields)
                case syntax.ResourceSyntax(name=name):
                    for word in _mentions(element):
                        self._use(word, NameScope("state", name.text))
                case syntax.EventSyntax():
                    self._use_event(element)
                case syntax.SkillSyntax(name=name, sections=sections):
                    for section in sections:
                        self._use_section(section, name.text)
                case syntax.EnumSyntax():
                    pass

    def _use_event(self, event: syntax.EventSyntax) -> None:
        for item in event.items:
            if isinstance(item, syntax.GuardSyntax):
                self._use_predicate(item.predicate, None)
            else:
                self._use_changes(item.changes)

    def _use_section(self, section: syntax.Section, skill: str) -> None:
        match section:
            case syntax.FieldsSection(fields=fields) | syntax.ProgressSection(fields=fields):
                self._use_fields(fields)
            case syntax.EffectSection(effects=effects):
                for effect in effects:
                    self._use_changes(effect.changes)
            case _:
                pass
        for predicate in _predicates(section):
            self._use_predicate(predicate, skill)
        for word in _applied(section):
            self._use(word, NameScope("effect", skill))

    def _use_fields(self, fields: Iterable[syntax.FieldSyntax]) -> None:
        for field in fields:
            self._use_type(field.type)
            if isinstance(field.default, NamedValue):
                for word in self._words_from(field.default.span, 1):
                    self._use(word, NameScope("value", field.type.name.text))

    def _use_type(self, use: syntax.TypeUse) -> None:
        if use.name.text not in SCALARS:
            self._use(use.name, TYPES)

    def _use_changes(self, changes: Iterable[syntax.ChangeSyntax]) -> None:
        for change in changes:
            self._use(change.resource, _RESOURCES)
            self._use(change.target, NameScope("state", change.resource.text))

    def use_unread(self) -> None:
        """Resources and states in words that no node contains: in an element with a syntax error, or because the `.rl`
        dialect merges equal effects. They are recognised by the sign between them.
        """
        for subject, sign, state in zip(self._words, self._words[1:], self._words[2:], strict=False):
            known = Symbol(_RESOURCES, subject.text) in self.declarations
            if known and sign.kind in _SIGNS and not {subject.start, state.start} & self.occurrences.keys():
                self._use(subject, _RESOURCES)
                self._use(state, NameScope("state", subject.text))

    # --- predicates

    def _use_predicate(self, predicate: syntax.PredicateSyntax, skill: str | None) -> None:
        """Collect the names of a predicate. skill: the one whose inputs it may name."""
        inputs = () if skill is None else (NameScope("input", skill),)
        for leaf in terms(predicate.expression):
            if predicate.kind == "resource":
                self._use_states(leaf)
            else:
                self._use_values(leaf, (*inputs, _DATA))

    def _use_states(self, leaf: Term) -> None:
        """`resource == STATE`, either side first."""
        sides = [leaf.left, leaf.right] if isinstance(leaf, Comparison) else [leaf]
        names = [side for side in sides if isinstance(side, Name)]
        subject = next((name for name in names if Symbol(_RESOURCES, name.path) in self.declarations), None)
        if subject is None and names:
            subject = names[0]
        for name in names:
            scope = _RESOURCES if subject is None or name is subject else NameScope("state", subject.path)
            self._use_path(name, (scope,))

    def _use_values(self, leaf: Term, scopes: tuple[NameScope, ...]) -> None:
        """Collect data, inputs and their fields. Another word may be a value of the other side's enum."""
        sides = [leaf.left, leaf.right] if isinstance(leaf, Comparison) else [leaf]
        for side, other in zip(sides, reversed(sides), strict=True):
            if not isinstance(side, Name):
                continue
            enum = self._type_of(other, scopes) if isinstance(other, Name) and other is not side else None
            values = () if enum is None else (NameScope("value", enum),)
            self._use_path(side, (*scopes, *values))

    def _use_path(self, name: Name, scopes: tuple[NameScope, ...]) -> None:
        """Collect the name itself, and behind each dot a field of the value before it."""
        for word in self._words_from(name.span, 1 + len(name.fields)):
            symbol = self._use(word, *scopes)
            inner = None if symbol is None else self._declared_type(symbol)
            scopes = () if inner is None else (NameScope("field", inner),)

    def _words_from(self, span: Span | None, count: int) -> Iterator[Lexeme]:
        """The words of a path, with dots between them."""
        if span is None:
            return
        first = self._positions.get(self._lines.offset(span.line, span.column))
        if first is not None:
            yield from self._words[first : first + 2 * count : 2]

    def _type_of(self, name: Name, scopes: tuple[NameScope, ...]) -> str | None:
        """The declared type of a datum or input, or of its field."""
        found: str | None = None
        for step, text in enumerate((name.root, *name.fields)):
            places = scopes if step == 0 else (NameScope("field", found or ""),)
            symbol = next((s for s in (Symbol(scope, text) for scope in places) if s in self.declarations), None)
            found = None if symbol is None else self._declared_type(symbol)
        return found

    def _declared_type(self, symbol: Symbol) -> str | None:
        node = self.declarations[symbol].node
        if isinstance(node, syntax.FieldSyntax | syntax.DatumSyntax) and not node.type.arrays:
            return node.type.name.text
        return None

    # --- occurrences

    def _use(self, word: Word, *scopes: NameScope) -> Symbol | None:
        candidates = (Symbol(scope, word.text) for scope in scopes)
        symbol = next((candidate for candidate in candidates if candidate in self.declarations), None)
        self._note(word, scopes, symbol, declares=False)
        return symbol

    def _note(
        self, word: Word, scopes: tuple[NameScope, ...], symbol: Symbol | None, declares: bool
    ) -> Occurrence | None:
        """Note an occurrence. Synthesised words, which are not in the text, are left out."""
        if not isinstance(word, Lexeme) or self._lines.text[word.start : word.end] != word.text:
            return None
        known = self.occurrences.get(word.start)
        if known is None:
            known = Occurrence(word.text, word.start, word.end, scopes, symbol, declares, uses=not declares)
        elif not declares:
            known = replace(known, uses=True)
        self.occurrences[word.start] = known
        return known


def _fields_kind(keyword: Word) -> SymbolKind:
    return "output" if keyword.text == "output" else "input"


def _mentions(resource: syntax.ResourceSyntax) -> Iterator[Word]:
    """The states that a resource mentions, its initial one first."""
    for item in resource.items:
        if isinstance(item, syntax.InitialSyntax):
            yield item.state
    for item in resource.items:
        if isinstance(item, syntax.TransitionSyntax):
            yield from (side for side in (item.source, item.target) if side.text != _ANY)


def _predicates(section: syntax.Section) -> Iterator[syntax.PredicateSyntax]:
    match section:
        case syntax.PreconditionSection(checks=checks):
            yield from (check.predicate for check in checks)
        case syntax.InvariantSection(invariants=invariants):
            yield from (invariant.predicate for invariant in invariants)
        case syntax.ResultSection(results=results):
            yield from (result.post for result in results if result.post is not None)
        case _:
            pass


def _applied(section: syntax.Section) -> Iterator[Word]:
    """The effects that a section applies, by name."""
    match section:
        case syntax.PreconditionSection(success=success, failure=failure):
            yield from (*success, *failure)
        case syntax.InvariantSection(invariants=invariants):
            yield from (invariant.violation for invariant in invariants if invariant.violation is not None)
        case syntax.ResultSection(results=results):
            yield from (result.apply.effect for result in results if result.apply is not None)
        case syntax.EndSection(applies=applies):
            yield from (apply.effect for apply in applies)
        case _:
            pass
