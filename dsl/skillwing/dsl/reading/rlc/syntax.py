"""The nodes of a file of compositions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from skillwing.dsl.reading.lexemes import Lexeme


@dataclass(frozen=True, slots=True)
class TypeNode:
    """A type: a name, and `[]` for a list."""

    name: Lexeme
    array: Lexeme | None


@dataclass(frozen=True, slots=True)
class ParameterNode:
    """A parameter: an input, or a robot if its type is the skillset."""

    name: Lexeme
    type: TypeNode


@dataclass(frozen=True, slots=True)
class EndNode:
    """A result that a composition declares. kind: `success` or `failure`."""

    kind: Lexeme
    name: Lexeme


@dataclass(frozen=True, slots=True)
class ArgumentNode:
    """An argument. name: None for one that is given by its position."""

    name: Lexeme | None
    value: Lexeme


@dataclass(frozen=True, slots=True)
class SkillCallNode:
    """`robot.skill(arguments)`."""

    robot: Lexeme
    skill: Lexeme
    arguments: tuple[ArgumentNode, ...]


@dataclass(frozen=True, slots=True)
class CallNode:
    """A call of another composition of the file."""

    name: Lexeme
    arguments: tuple[ArgumentNode, ...]


@dataclass(frozen=True, slots=True)
class SequenceNode:
    """Steps with `>>` between them."""

    steps: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class ParallelNode:
    """Branches with `||` between them. sign: the first of these."""

    sign: Lexeme
    branches: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class RaceNode:
    """`race(branch, branch)`."""

    keyword: Lexeme
    branches: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class PatternNode:
    """The left side of a branch. kind: `success`, `failure` or `_`; result: None for `_`; outputs: their new names."""

    kind: Lexeme
    result: Lexeme | None
    outputs: tuple[Lexeme, ...]


@dataclass(frozen=True, slots=True)
class OutcomeNode:
    """The end of a composition. kind: `success` or `failure`; result: its name, if there is one."""

    kind: Lexeme
    result: Lexeme | None


@dataclass(frozen=True, slots=True)
class ArmNode:
    """A branch of a `match`."""

    pattern: PatternNode
    body: Node


@dataclass(frozen=True, slots=True)
class MatchNode:
    """`match robot.skill() { | pattern => body }`."""

    keyword: Lexeme
    call: SkillCallNode
    arms: tuple[ArmNode, ...]


@dataclass(frozen=True, slots=True)
class BrokenNode:
    """A body with a mistake, which is reported already. parts: those before and after it."""

    parts: tuple[Node, ...] = ()


Node: TypeAlias = (
    SkillCallNode | CallNode | SequenceNode | ParallelNode | RaceNode | MatchNode | OutcomeNode | BrokenNode
)


@dataclass(frozen=True, slots=True)
class DefinitionNode:
    """`def name(parameters) -> (ends) { body }`."""

    name: Lexeme
    parameters: tuple[ParameterNode, ...]
    ends: tuple[EndNode, ...]
    body: Node


@dataclass(frozen=True, slots=True)
class CompositionsNode:
    """A whole file. An `include` leaves no node: the skillset is known already."""

    definitions: tuple[DefinitionNode, ...]
