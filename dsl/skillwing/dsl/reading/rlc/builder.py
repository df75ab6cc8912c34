"""The node builder of `.rlc` files."""

from __future__ import annotations

from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.rlc.syntax import (
    ArgumentNode,
    ArmNode,
    BrokenNode,
    CallNode,
    CompositionsNode,
    DefinitionNode,
    EndNode,
    MatchNode,
    Node,
    OutcomeNode,
    ParallelNode,
    ParameterNode,
    PatternNode,
    RaceNode,
    SequenceNode,
    SkillCallNode,
    TypeNode,
)


class RlcBuilder:
    """A builder of the nodes. The method named after a rule gets the nodes and words within it."""

    arm, outcome, argument = ArmNode, OutcomeNode, ArgumentNode
    parameter, type = ParameterNode, TypeNode

    def compositions(self, *parts: DefinitionNode | None) -> CompositionsNode:
        return CompositionsNode(tuple(part for part in parts if part is not None))

    def include(self, *_files: Lexeme) -> None:
        """Leave it out: a skillset is chosen by the command and by the manager."""

    def definition(
        self, name: Lexeme, parameters: tuple[ParameterNode, ...], ends: tuple[EndNode, ...] | None, body: Node
    ) -> DefinitionNode:
        return DefinitionNode(name, parameters, ends or (), body)

    def body(self, *parts: Node | None) -> Node:
        found = tuple(part for part in parts if part is not None)
        return found[0] if len(found) == 1 else BrokenNode(found)

    branch = body

    def parameters(self, *found: ParameterNode | None) -> tuple[ParameterNode, ...]:
        return tuple(each for each in found if each is not None)

    def ends(self, *found: EndNode) -> tuple[EndNode, ...]:
        return found

    def end(self, kind: Lexeme, name: Lexeme, *_outputs: Lexeme) -> EndNode:
        return EndNode(kind, name)

    def parallel(self, first: Node, sign: Lexeme, *others: Node | Lexeme) -> ParallelNode:
        branches = tuple(each for each in others if not isinstance(each, Lexeme))
        return ParallelNode(sign, (first, *branches))

    def sequence(self, *steps: Node) -> SequenceNode:
        return SequenceNode(steps)

    def race(self, keyword: Lexeme, *branches: Node) -> RaceNode:
        return RaceNode(keyword, branches)

    def match(self, keyword: Lexeme, call: SkillCallNode, *arms: ArmNode) -> MatchNode:
        return MatchNode(keyword, call, arms)

    def pattern(self, kind: Lexeme, result: Lexeme | None = None, *outputs: Lexeme) -> PatternNode:
        return PatternNode(kind, result, outputs)

    def skill_call(self, robot: Lexeme, skill: Lexeme, *arguments: ArgumentNode | None) -> SkillCallNode:
        return SkillCallNode(robot, skill, tuple(each for each in arguments if each is not None))

    def call(self, name: Lexeme, *arguments: ArgumentNode | None) -> CallNode:
        return CallNode(name, tuple(each for each in arguments if each is not None))
