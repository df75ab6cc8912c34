"""Trees of the compositions in an `.rlc` file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from skillwing.bt_missions.checking.preflight import possible_endings
from skillwing.bt_missions.mission.files import read_source
from skillwing.bt_missions.xml.document import Element, FileProblem
from skillwing.bt_missions.xml.node_type import PortError
from skillwing.bt_missions.xml.skills import input_port, output_port, type_name
from skillwing.bt_missions.xml.tree_file import SUBTREE, DeclaredPort, TreeFile, TreeModel
from skillwing.bt_missions.xml.values import attribute_text, read_attribute
from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.default_values import default_value
from skillwing.dsl.diagnostics.diagnostic import excerpt
from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, Skill, Skillset, Type
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.node_builder import literal_value
from skillwing.dsl.reading.rlc.parser import parse_compositions
from skillwing.dsl.reading.rlc.syntax import (
    ArgumentNode,
    ArmNode,
    BrokenNode,
    CallNode,
    CompositionsNode,
    DefinitionNode,
    MatchNode,
    Node,
    OutcomeNode,
    ParallelNode,
    PatternNode,
    RaceNode,
    SequenceNode,
    SkillCallNode,
    TypeNode,
)
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import closest, did_you_mean, listed
from skillwing.dsl.text_files import text_in
from skillwing.services.core.values import fit_fields, type_text
from skillwing.services.errors import InvalidOptionError

RLC = ".rlc"
_ALL, _ONE = "-1", "1"
_TAKEN = ("name", "ID")


@dataclass(frozen=True, slots=True)
class _Robot:
    """A name for the robot, which is no value."""


_Scope: TypeAlias = "Mapping[str, Type | _Robot | None]"
"""The names that a composition can use, with their types; None for those with a problem that is reported already."""


def read_composition(file: Path, skillset: Skillset) -> TreeFile:
    """The trees of an `.rlc` file: one for each `def`. The last one is the main tree, and its parameters are the ports.

    `problems` holds all mistakes, each with its place and an excerpt. Raises InvalidOptionError for a file that cannot
    be read.
    """
    try:
        text = text_in(read_source(file))
    except ValueError as error:
        raise InvalidOptionError("tree", f"`{file}` cannot be read: {error}. Save it as UTF-8.") from error
    root, diagnostics = parse_compositions(text, str(file))
    translation = _Translation(skillset, text, root, is_damaged=bool(diagnostics))
    for each in diagnostics:
        translation.report(each.span, f"{each.message} {each.help or ''}".rstrip())
    return translation.tree_file(file)


class _Translation:
    """The trees, models and problems of one file."""

    def __init__(self, skillset: Skillset, text: str, root: CompositionsNode, *, is_damaged: bool) -> None:
        self._skillset = skillset
        self._text = text
        self._root = root
        self._is_damaged = is_damaged
        self._types: dict[str, Type] = {**SCALARS, **{kind.name: kind for kind in skillset.types}}
        self._skills = {skill.name: skill for skill in skillset.skills}
        self._definitions: dict[str, DefinitionNode] = {}
        self._problems: list[FileProblem] = []
        self._excerpts: dict[tuple[int, int], str] = {}

    def report(self, span: Span, text: str) -> None:
        """Note a problem. text: sentences about it and its fix."""
        lines = [text, *excerpt(span, self._text)]
        self._problems.append(FileProblem(span.line, "\n".join(lines), span.column))

    def tree_file(self, file: Path) -> TreeFile:
        for each in self._root.definitions:
            if self._definitions.setdefault(each.name.text, each) is not each:
                self.report(each.name.span, f"There are two compositions `{each.name.text}`. Rename one of them.")
        if not self._definitions and not self._is_damaged:
            self.report(Span(str(file), 1, 1, 1, 2), "There is no composition. Write `def NAME() { ... }`.")
        trees: dict[str, Element] = {}
        models: dict[str, TreeModel] = {}
        for name, each in self._definitions.items():
            scope = self._parameters(each)
            models[name] = TreeModel(list(self._ports(each, scope)), self._results(each))
            trees[name] = self._node(each.body, scope, each)
        main = next(reversed(self._definitions), "")
        return TreeFile(file, main, trees, models, tuple(self._problems), self._excerpts)

    # --- declarations

    def _parameters(self, definition: DefinitionNode) -> _Scope:
        scope: dict[str, Type | _Robot | None] = {}
        for each in definition.parameters:
            name, kind = each.name.text, self._type(each.type)
            if name in scope:
                self.report(each.name.span, f"There are two parameters `{name}`. Rename one of them.")
            elif name in _TAKEN or name.startswith("_"):
                # An attribute of a SubTree with such a name is no port.
                self.report(each.name.span, f"A parameter cannot be called `{name}`. Choose another name.")
                kind = None
            scope[name] = kind
        return scope

    def _type(self, node: TypeNode) -> Type | _Robot | None:
        name = node.name.text
        if name == self._skillset.name and node.array is None:
            return _Robot()
        if name not in self._types:
            known = [*self._types, self._skillset.name]
            self.report(node.name.span, f"There is no type `{name}`{did_you_mean(name, known, f'; {listed(known)}.')}")
            return None
        return self._types[name] if node.array is None else ArrayType(self._types[name], None)

    def _ports(self, definition: DefinitionNode, scope: _Scope) -> Iterator[DeclaredPort]:
        for each in definition.parameters:
            kind = scope[each.name.text]
            if kind is not None and not isinstance(kind, _Robot):
                yield DeclaredPort(each.name.text, type_name(kind), None, each.name.span.line)

    def _results(self, definition: DefinitionNode) -> dict[str, str]:
        """The names of the results, by `success` and `failure`."""
        names: dict[str, str] = {}
        for each in definition.ends:
            if names.setdefault(each.kind.text, each.name.text) != each.name.text:
                text = f"A tree has one {each.kind.text}, and `{names[each.kind.text]}` is it. Remove this one."
                self.report(each.name.span, text)
        return names

    # --- compositions

    def _node(self, node: Node, scope: _Scope, within: DefinitionNode) -> Element:
        """The element of a composition. One without a tag replaces what cannot be translated."""
        match node:
            case SkillCallNode():
                made = self._skill_call(node, scope)
            case CallNode():
                made = self._call(node, scope)
            case SequenceNode(steps=steps):
                children = [self._node(each, scope, within) for each in steps]
                made = Element("Sequence", {}, children[0].line, children, children[0].column)
            case ParallelNode(sign=sign, branches=branches):
                made = self._parallel(sign, branches, _ALL, scope, within)
            case RaceNode(keyword=keyword, branches=branches):
                if len(branches) < 2:
                    self.report(keyword.span, "A race has two branches at least. Add one, or write the one alone.")
                made = self._parallel(keyword, branches, _ONE, scope, within)
            case MatchNode():
                made = self._match(node, scope, within)
            case OutcomeNode(kind=kind, result=result):
                if result is not None:
                    self._check_outcome(kind, result, within)
                made = self._element("AlwaysSuccess" if kind.text == "success" else "AlwaysFailure", {}, kind.span)
            case BrokenNode(parts=parts):
                children = [self._node(each, scope, within) for each in parts]
                made = Element("", {}, within.name.span.line, children)
        return made

    def _parallel(
        self, sign: Lexeme, branches: Sequence[Node], needed: str, scope: _Scope, within: DefinitionNode
    ) -> Element:
        counts = {"name": sign.text, "success_count": needed, "failure_count": "1"}
        return self._element("Parallel", counts, sign.span, [self._node(each, scope, within) for each in branches])

    def _check_outcome(self, kind: Lexeme, result: Lexeme, within: DefinitionNode) -> None:
        names = [each.name.text for each in within.ends if each.kind.text == kind.text]
        if result.text not in names:
            other = f". Declare it: `-> ({kind.text} {result.text})`."
            text = f"`{within.name.text}` has no {kind.text} `{result.text}`{did_you_mean(result.text, names, other)}"
            self.report(result.span, text)

    # --- calls

    def _skill_call(self, node: SkillCallNode, scope: _Scope) -> Element:
        self._check_robot(node.robot, scope)
        skill = self._skills.get(node.skill.text)
        if skill is None:
            name = node.skill.text
            hint = did_you_mean(name, self._skills, f"; there is {listed(self._skills)}.")
            self.report(node.skill.span, f"There is no skill `{name}`{hint}")
            for each in node.arguments:
                self._value(each.value, None, scope)
            return self._element("", {}, node.skill.span)
        attributes = {"name": skill.name}
        inputs = {field.name: field for field in skill.inputs}
        bound = self._bind(node.arguments, list(inputs), f"`{skill.name}`", "input", scope)
        for name, field in inputs.items():
            if name in bound:
                attributes[input_port(name)] = self._value(bound[name].value, field, scope)
            elif field.default is None:
                text = f"`{skill.name}` lacks its input `{name}`: {type_text(field.type)}. Add it: `{name}=...`."
                self.report(node.skill.span, text)
                attributes[input_port(name)] = _some_value(field)
        return self._element(skill.name, attributes, node.robot.span.to(node.skill.span))

    def _check_robot(self, word: Lexeme, scope: _Scope) -> None:
        robots = [*(name for name, kind in scope.items() if isinstance(kind, _Robot)), self._skillset.name]
        if word.text not in robots:
            hint = did_you_mean(word.text, robots, f"; there is {listed(robots)}.")
            self.report(word.span, f"There is no robot `{word.text}` here{hint}")

    def _call(self, node: CallNode, scope: _Scope) -> Element:
        name = node.name.text
        called = self._definitions.get(name)
        if called is None:
            if name in self._skills:
                self.report(node.name.span, f"`{name}` is a skill. Write `{self._skillset.name}.{name}(...)`.")
            elif not self._is_damaged:
                hint = did_you_mean(name, self._definitions, f"; there is {listed(self._definitions)}.")
                self.report(node.name.span, f"There is no composition `{name}`{hint}")
            return self._element("", {}, node.name.span)
        names = [each.name.text for each in called.parameters]
        bound = self._bind(node.arguments, names, f"`{name}`", "parameter", scope)
        attributes = {"ID": name}
        for each in called.parameters:
            kind = self._quiet_type(each.type)
            given = bound.get(each.name.text)
            if given is None:
                text = f"`{name}` lacks its parameter `{each.name.text}`: `{each.type.name.text}`. Add it."
                self.report(node.name.span, text)
            elif isinstance(kind, _Robot):
                self._check_robot(given.value, scope)
            if kind is not None and not isinstance(kind, _Robot):
                field = Field(each.name.text, kind)
                attributes[field.name] = _some_value(field) if given is None else self._value(given.value, field, scope)
        return self._element(SUBTREE, attributes, node.name.span)

    def _quiet_type(self, node: TypeNode) -> Type | _Robot | None:
        if node.name.text == self._skillset.name or node.name.text in self._types:
            return self._type(node)
        return None

    def _bind(
        self, arguments: Iterable[ArgumentNode], names: Sequence[str], owner: str, noun: str, scope: _Scope
    ) -> dict[str, ArgumentNode]:
        """The arguments by the name of their input. A misspelt name counts as the nearest one."""
        bound: dict[str, ArgumentNode] = {}
        for position, each in enumerate(arguments):
            if each.name is not None:
                name = each.name.text if each.name.text in names else closest(each.name.text, names)
                if name != each.name.text:
                    hint = did_you_mean(each.name.text, names, f"; there is {listed(names)}.")
                    self.report(each.name.span, f"{owner} has no {noun} `{each.name.text}`{hint}")
            else:
                name = names[position] if position < len(names) else None
                if name is None:
                    self.report(each.value.span, f"{owner} has {len(names) or 'no'} {noun}s. Remove this argument.")
            if name is None:
                self._value(each.value, None, scope)
            elif name in bound:
                self.report((each.name or each.value).span, f"{owner} gets `{name}` twice. Remove one of them.")
            else:
                bound[name] = each
        return bound

    def _value(self, word: Lexeme, field: Field | None, scope: _Scope) -> str:
        """The text of an attribute. field: the input that takes it, None if it is unknown."""
        if word.kind == "NAME" and word.text in scope:
            kind = scope[word.text]
            if isinstance(kind, _Robot):
                self.report(word.span, f"`{word.text}` is the robot, which is no value. Write another name.")
            elif kind is not None and field is not None and _fits(kind, field.type):
                return f"{{{word.text}}}"
            elif kind is not None and field is not None:
                takes = f"`{field.name}` takes {type_text(field.type)}. Change one of them."
                self.report(word.span, f"`{word.text}` is {type_text(kind)}; {takes}")
        elif word.kind == "NAME":
            values = field.type.values if field is not None and isinstance(field.type, EnumType) else ()
            if word.text in values:
                return word.text
            known = [*values, *(name for name, kind in scope.items() if not isinstance(kind, _Robot))]
            self.report(word.span, f"Nothing is called `{word.text}` here{did_you_mean(word.text, known)}")
        elif field is not None:
            text = str(literal_value(word)) if word.kind == "STRING" else word.text
            problem = _misfit(text, word, field)
            if problem is None:
                return text
            self.report(word.span, problem)
        return "" if field is None else _some_value(field)

    # --- branches

    def _match(self, node: MatchNode, scope: _Scope, within: DefinitionNode) -> Element:
        """The skill, in one OnEnding for each branch. Each end of the skill is a failure there, which starts it."""
        element = self._skill_call(node.call, scope)
        skill = self._skills.get(node.call.skill.text)
        labels = self._labels(node, skill)
        outputs: dict[str, str] = {}
        bodies = [self._node(arm.body, self._arm_scope(arm, skill, outputs, scope), within) for arm in node.arms]
        if skill is None:
            return element
        element.attributes["failure_on"] = " ".join(f"S_{result.name}" for result in skill.results)
        element.attributes |= {output_port(skill, name): f"{{{entry}}}" for name, entry in outputs.items()}
        for arm, names, body in zip(node.arms, labels, bodies, strict=True):
            if names:
                attributes = {"name": f"match {skill.name}", "endings": " ".join(names)}
                element = self._element("OnEnding", attributes, arm.pattern.kind.span, [element, body])
        return element

    def _labels(self, node: MatchNode, skill: Skill | None) -> list[list[str]]:
        """The endings that each branch is for. Reports branches that are unknown, missing or never reached."""
        if skill is None:
            return [[] for _ in node.arms]
        left = {f"S_{result.name}": result for result in skill.results}
        has_rest = False
        found: list[list[str]] = []
        for pattern in (arm.pattern for arm in node.arms):
            names: list[str] = []
            if has_rest:
                self.report(pattern.kind.span, "This branch is never reached. Put `_` behind all others.")
            elif pattern.result is None:
                has_rest = True
                kept = {f"S_{result.name}" for result in skill.results} - left.keys()
                names = [label for label in possible_endings(skill) if label not in kept]
            else:
                label = self._result_label(pattern.kind, pattern.result, skill)
                if label is not None and left.pop(label, None) is None:
                    self.report(pattern.result.span, f"`{pattern.result.text}` has two branches. Remove one of them.")
                elif label is not None:
                    names = [label]
            found.append(names)
        if left and not has_rest:
            missing = listed(f"{'success' if each.success else 'failure'} {each.name}" for each in left.values())
            self.report(node.keyword.span, f"This `match` has no branch for {missing}. Add it, or a branch `_`.")
        return found

    def _result_label(self, kind: Lexeme, word: Lexeme, skill: Skill) -> str | None:
        """The label of the result that a branch names, or of the nearest one. None if no result is near."""
        results = {result.name: result for result in skill.results}
        name = word.text if word.text in results else closest(word.text, results)
        if name != word.text:
            hint = did_you_mean(word.text, results, f"; there is {listed(results)}.")
            self.report(word.span, f"`{skill.name}` has no result `{word.text}`{hint}")
        elif results[word.text].success is (kind.text != "success"):
            right = "failure" if kind.text == "success" else "success"
            self.report(kind.span, f"`{word.text}` of `{skill.name}` is a {right}. Write `{right} {word.text}`.")
        return None if name is None else f"S_{name}"

    def _arm_scope(self, arm: ArmNode, skill: Skill | None, outputs: dict[str, str], scope: _Scope) -> _Scope:
        """The names in a branch. outputs: entry of each output, by its name; those of this branch are added."""
        if skill is None:
            return scope
        return {**scope, **dict(self._bound_outputs(arm.pattern, skill, outputs, scope))}

    def _bound_outputs(
        self, pattern: PatternNode, skill: Skill, outputs: dict[str, str], scope: _Scope
    ) -> Iterator[tuple[str, Type]]:
        for position, word in enumerate(pattern.outputs):
            if word.text == "_":
                continue
            if position >= len(skill.outputs):
                self.report(word.span, f"`{skill.name}` has {len(skill.outputs) or 'no'} outputs. Remove this name.")
                continue
            field = skill.outputs[position]
            if word.text in scope:
                self.report(word.span, f"`{word.text}` is a parameter. Choose another name.")
            elif outputs.setdefault(field.name, word.text) != word.text:
                text = f"Output `{field.name}` is `{outputs[field.name]}` in another branch. Write one name for both."
                self.report(word.span, text)
            yield word.text, field.type

    def _element(self, tag: str, attributes: dict[str, str], span: Span, children: Sequence[Element] = ()) -> Element:
        self._excerpts[span.line, span.column] = "\n".join(excerpt(span, self._text))
        return Element(tag, attributes, span.line, list(children), span.column)


def _fits(given: Type, taken: Type) -> bool:
    if isinstance(given, ScalarType) and isinstance(taken, ScalarType) and given.is_number and taken.is_number:
        return taken.is_float or given.is_integer
    return given == taken


def _misfit(text: str, word: Lexeme, field: Field) -> str | None:
    """The problem of a constant as this input."""
    is_text = isinstance(field.type, ScalarType) and field.type.name == "string"
    if is_text and word.kind != "STRING":
        return f'`{field.name}` is `{text}`; it takes a text. Write `"{text}"`.'
    try:
        value = read_attribute(text, field.type, field.name)
    except PortError as error:
        return str(error)
    problems = fit_fields((field,), {field.name: value})[1]
    return " ".join(problem.sentence for problem in problems) or None


def _some_value(field: Field) -> str:
    """A value in place of a wrong one, so that the rest of the call can be checked."""
    return attribute_text(default_value(field))
