"""Syntax nodes: a `.skillset` file as it was written, before names are resolved.

Every node keeps the spans of its words, so that the checker can report the exact word. Predicates use the nodes of
`expressions.py`, with unresolved names.

Nodes are never changed. They are not frozen, because making a frozen one takes four times as long, and a large file has
a hundred thousand.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias, cast

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.expressions import Expression, Literal, NamedValue
from skillwing.dsl.model import PredicateKind
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.spans import Span, Word


@dataclass(slots=True, eq=False)
class CoinedWord:
    """A word that is not in the source in this form. `span`: the text that it was made of."""

    text: str
    span: Span


@dataclass(slots=True, eq=False)
class Number:
    """A number as written; `value` is an int only if it was written without point and exponent."""

    value: int | float
    span: Span


@dataclass(slots=True, eq=False)
class TypeUse:
    """A type in use: `float64`, `Position[]`. arrays: one length (None for open) per pair of brackets."""

    name: Word
    arrays: tuple[Word, ...]


@dataclass(slots=True, eq=False)
class BoundsSyntax:
    low: Number
    high: Number


@dataclass(slots=True, eq=False)
class FieldSyntax:
    name: Word
    type: TypeUse
    unit: Word | None
    bounds: BoundsSyntax | None
    default: Literal | NamedValue | None
    modifiable: Word | None = None


@dataclass(slots=True, eq=False)
class DatumSyntax:
    name: Word
    type: TypeUse
    unit: Word | None
    period: Number | None
    bounds: BoundsSyntax | None = None


@dataclass(slots=True, eq=False)
class DataSyntax:
    items: tuple[DatumSyntax, ...]


@dataclass(slots=True, eq=False)
class EnumSyntax:
    name: Word
    values: tuple[Word, ...]


@dataclass(slots=True, eq=False)
class StructSyntax:
    name: Word
    fields: tuple[FieldSyntax, ...]


@dataclass(slots=True, eq=False)
class StatesSyntax:
    names: tuple[Word, ...]


@dataclass(slots=True, eq=False)
class InitialSyntax:
    state: Word


@dataclass(slots=True, eq=False)
class TransitionSyntax:
    """`source -> target`; a side of `*` stands for every state."""

    source: Word
    target: Word
    extern: bool


@dataclass(slots=True, eq=False)
class ResourceSyntax:
    name: Word
    items: tuple[StatesSyntax | InitialSyntax | TransitionSyntax, ...]


@dataclass(slots=True, eq=False)
class ChangeSyntax:
    """`resource -> STATE` within an effect."""

    resource: Word
    target: Word


@dataclass(slots=True, eq=False)
class EffectSyntax:
    name: Word
    changes: tuple[ChangeSyntax, ...]


@dataclass(slots=True, eq=False)
class PredicateSyntax:
    """`resource=(...)` or `data=(...)`."""

    kind: PredicateKind
    expression: Expression
    span: Span


@dataclass(slots=True, eq=False)
class GuardSyntax:
    predicate: PredicateSyntax


@dataclass(slots=True, eq=False)
class EventEffectSyntax:
    changes: tuple[ChangeSyntax, ...]


@dataclass(slots=True, eq=False)
class EventSyntax:
    name: Word
    items: tuple[GuardSyntax | EventEffectSyntax, ...]


@dataclass(slots=True, eq=False)
class CheckSyntax:
    name: Word
    predicate: PredicateSyntax


@dataclass(slots=True, eq=False)
class InvariantSyntax:
    name: Word
    predicate: PredicateSyntax
    violation: Word | None


@dataclass(slots=True, eq=False)
class ApplySyntax:
    """`apply=effect`."""

    effect: Word


@dataclass(slots=True, eq=False)
class ResultSyntax:
    """A result. partition: "success" or "failure", None for an unmarked result."""

    name: Word
    partition: str | None
    apply: ApplySyntax | None
    post: PredicateSyntax | None


# The sections of a skill. `keyword` is where the section starts: a section given twice is reported there.


@dataclass(slots=True, eq=False)
class ProgressSection:
    keyword: Word
    period: Number
    fields: tuple[FieldSyntax, ...]


@dataclass(slots=True, eq=False)
class LimitSection:
    """`deadline=...` or `dispatch_timeout=...`."""

    keyword: Word
    seconds: Number


@dataclass(slots=True, eq=False)
class PolicySection:
    """`owner_lost=...`."""

    keyword: Word
    policy: Word


@dataclass(slots=True, eq=False)
class FieldsSection:
    """`input { ... }` or `output { ... }`."""

    keyword: Word
    fields: tuple[FieldSyntax, ...]


@dataclass(slots=True, eq=False)
class EffectSection:
    keyword: Word
    effects: tuple[EffectSyntax, ...]


@dataclass(slots=True, eq=False)
class PreconditionSection:
    keyword: Word
    checks: tuple[CheckSyntax, ...]
    success: tuple[Word, ...]
    failure: tuple[Word, ...]


@dataclass(slots=True, eq=False)
class InvariantSection:
    keyword: Word
    invariants: tuple[InvariantSyntax, ...]


@dataclass(slots=True, eq=False)
class ResultSection:
    keyword: Word
    results: tuple[ResultSyntax, ...]


@dataclass(slots=True, eq=False)
class EndSection:
    """`interrupt { ... }` or `lost { ... }`."""

    keyword: Word
    applies: tuple[ApplySyntax, ...]
    timeouts: tuple[Number, ...]


Section: TypeAlias = (
    ProgressSection
    | LimitSection
    | PolicySection
    | FieldsSection
    | EffectSection
    | PreconditionSection
    | InvariantSection
    | ResultSection
    | EndSection
)


@dataclass(slots=True, eq=False)
class SkillSyntax:
    name: Word
    sections: tuple[Section, ...]


Element: TypeAlias = DataSyntax | EnumSyntax | StructSyntax | ResourceSyntax | EventSyntax | SkillSyntax


@dataclass(slots=True, eq=False)
class SkillsetSyntax:
    """A whole file. remarks: diagnostics of its dialect on features that these nodes cannot represent.

    is_library: its types are for other files.
    """

    name: Word
    elements: tuple[Element, ...]
    remarks: tuple[Diagnostic, ...] = ()
    is_library: bool = False


# --- looking into nodes


def spans(node: object) -> Iterator[Span]:
    """The spans of a syntax node and of all its parts, in no order; none for any other object."""
    left = [node]  # no recursion: a predicate may be nested as deeply as a file is long
    while left:
        part = left.pop()
        if isinstance(part, Span):
            yield part
        elif isinstance(part, Lexeme):
            yield part.span
        elif isinstance(part, tuple | list):
            left += cast("Iterable[object]", part)
        else:
            left += [getattr(part, name) for name in field_names(type(part))]


@cache
def field_names(kind: type) -> tuple[str, ...]:
    """The names of the fields of a dataclass; none of another class."""
    return tuple(field.name for field in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else ()
