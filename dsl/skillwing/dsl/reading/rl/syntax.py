"""Syntax nodes that only `.rl` files have. `lowering.py` turns them into those of `reading/syntax.py`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from skillwing.dsl.reading.syntax import (
    ChangeSyntax,
    CheckSyntax,
    DataSyntax,
    EventSyntax,
    FieldsSection,
    FieldSyntax,
    PredicateSyntax,
    ProgressSection,
    ResourceSyntax,
    Word,
)

EVERY_STATE = "*"
"""The state of a transition from, or into, any state."""


@dataclass(frozen=True, slots=True)
class IncludeNode:
    """`include "other.rl"`, with the quotes."""

    files: tuple[Word, ...]


@dataclass(frozen=True, slots=True)
class TypesNode:
    """`type A`, `type { A B }` or, behind the name of the skillset, `<A, B>`."""

    names: tuple[Word, ...]


@dataclass(frozen=True, slots=True)
class ParametersNode:
    """`parameter x: T` or `parameter { x: T ... }`, of a skillset or of a skill."""

    keyword: Word
    fields: tuple[FieldSyntax, ...]


@dataclass(frozen=True, slots=True)
class ChecksNode:
    """`precondition n: expression` or a block of them."""

    keyword: Word
    checks: tuple[CheckSyntax, ...]


@dataclass(frozen=True, slots=True)
class StartNode:
    """`start resource -> STATE` or a block of changes."""

    keyword: Word
    changes: tuple[ChangeSyntax, ...]


@dataclass(frozen=True, slots=True)
class InvariantNode:
    """`n { guard expression effect ... }`."""

    name: Word
    guard: PredicateSyntax
    changes: tuple[ChangeSyntax, ...]


@dataclass(frozen=True, slots=True)
class InvariantsNode:
    """`invariant n { ... }` or a block of them."""

    keyword: Word
    invariants: tuple[InvariantNode, ...]


@dataclass(frozen=True, slots=True)
class PostNode:
    """`postcondition expression`, in some files with a name: `postcondition n: expression`."""

    name: Word | None
    predicate: PredicateSyntax


@dataclass(frozen=True, slots=True)
class InterruptNode:
    """`interrupt { interrupting true effect ... postcondition ... }`."""

    keyword: Word
    changes: tuple[ChangeSyntax, ...]
    posts: tuple[PostNode, ...]


@dataclass(frozen=True, slots=True)
class ResultNode:
    """`n { effect ... postcondition ... }`."""

    name: Word
    changes: tuple[ChangeSyntax, ...]
    posts: tuple[PostNode, ...]


@dataclass(frozen=True, slots=True)
class ResultsNode:
    """`success n { ... }` or a block of them, and the same with `failure`, by the keyword."""

    keyword: Word
    results: tuple[ResultNode, ...]


SectionNode: TypeAlias = (
    ParametersNode
    | FieldsSection
    | ChecksNode
    | StartNode
    | InvariantsNode
    | ProgressSection
    | InterruptNode
    | ResultsNode
)


@dataclass(frozen=True, slots=True)
class SkillNode:
    name: Word
    sections: tuple[SectionNode, ...]


Node: TypeAlias = IncludeNode | TypesNode | ParametersNode | DataSyntax | ResourceSyntax | EventSyntax | SkillNode


@dataclass(frozen=True, slots=True)
class RlFile:
    """A whole file. name: of its skillset; None for a library of types."""

    name: Word | None
    nodes: tuple[Node, ...]
