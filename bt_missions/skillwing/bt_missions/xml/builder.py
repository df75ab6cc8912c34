"""Builder of the nodes of a tree file, which collects all problems of the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from string import digits

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.checking.intended_names import intended_name
from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.placeholder import PlaceholderNode, mark_guessed, mark_incomplete
from skillwing.bt_missions.leaves.robot_group import MissingRobotError
from skillwing.bt_missions.leaves.source_location import set_source_location
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.bt_missions.xml.document import Element, FileProblem
from skillwing.bt_missions.xml.installed_nodes import unusable_reason
from skillwing.bt_missions.xml.node_type import Category, NodeConfig, NodeType, PortError
from skillwing.bt_missions.xml.node_types import node_types
from skillwing.bt_missions.xml.tree_file import RESCUE, SUBTREE, TreeFile, TreeModel
from skillwing.dsl.model import UnknownNameError
from skillwing.dsl.suggest import closest, did_you_mean, listed

_AUTOREMAP = "_autoremap"
ROBOT = "robot"
"""Attribute that chooses a robot, in a mission on several."""
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}
_EDITOR_ATTRIBUTES = ("_uid", "_fullpath", "_description", "_collapsed")
"""Attributes in which editors store the layout of a node."""
_REPLACEMENTS = {
    **dict.fromkeys(("Script", "ScriptCondition", "Precondition"), "use ResourceIs or DataCompare."),
    "WhileDoElse": "put its parts into ReactiveSequence and ReactiveFallback.",
    "SetBlackboard": "write the value where it is read, or declare a port of the tree with that default.",
    "Sleep": "use Delay.",
}
"""Nodes of BehaviorTree.CPP that are not supported, each with its replacement."""


@dataclass(frozen=True, slots=True)
class _Reference:
    entry: BlackboardEntry
    port: str
    line: int


class Builder:
    """Builder for one build of the trees of one file.

    In a mission on several robots the attribute `robot` of a tag chooses the robot for it and for all below.
    """

    def __init__(self, source: TreeFile, context: MissionContext) -> None:
        self.problems: list[FileProblem] = []
        self._source = source
        self._mission = context
        self._context = context
        self._types_by_robot = {name: node_types(own.skillset) for name, own in context.robots.items()}
        self._references: list[_Reference] = []
        self._early: list[tuple[BlackboardEntry, FileProblem]] = []
        self._callers: dict[str, list[int]] = {}
        """Lines that call unknown trees, by the name of the tree."""
        self._open: list[str] = []
        self._built: set[str] = set()

    def build(self, tree: str, blackboard: Blackboard, robot: str = "") -> Behaviour:
        """The top node of a tree. A `PlaceholderNode` replaces each node that cannot be built, or is missing.

        robot: for the tags that name none; by default that of the caller.
        """
        if tree not in self._source.trees:
            return PlaceholderNode(tree)
        before = self._context
        self._context = self._mission.of(robot) if robot else before
        self._built.add(tree)
        self._open.append(tree)
        top = self._node(self._source.trees[tree], blackboard)
        self._open.pop()
        self._context = before
        return top

    def build_unused(self) -> Iterator[Behaviour]:
        """The trees without a caller until now. Entries that a caller would set may stay empty."""
        for tree in self._source.trees:
            if tree not in self._built:
                element, outer = self._source.trees[tree], Blackboard(may_be_empty=True)
                board = Blackboard(outer, self._defaults(tree, element, outer), may_be_empty=True)
                yield self.build(tree, board, next(iter(self._mission.robots)))

    def finish(self) -> None:
        """Report missing trees and entries without a value, each once for all uses. Call it after all builds."""
        readers: dict[BlackboardEntry, list[_Reference]] = {}
        for reference in self._references:
            if not (reference.entry.is_filled or reference.entry.may_be_empty):
                readers.setdefault(reference.entry, []).append(reference)
        for entry, references in readers.items():
            first, lines = references[0], [reference.line for reference in references]
            text = f"`{first.port}` reads `{{{entry.name}}}`, which nothing fills; declare it as a port of the tree."
            self.problems.append(FileProblem(first.line, text + _other_lines(lines)))
            entry.allow_empty()
        self.problems += [problem for entry, problem in self._early if entry.is_filled]
        for tree, lines in self._callers.items():
            hint = did_you_mean(tree, self._source.trees, f"; there is {listed(self._source.trees)}.")
            self.problems.append(FileProblem(lines[0], f"There is no tree `{tree}`{hint}{_other_lines(lines)}"))

    def _node(self, element: Element, blackboard: Blackboard) -> Behaviour:
        tag, attributes = _plain_form(element)
        before = self._context
        self._choose_robot(element, attributes)
        try:
            if tag == SUBTREE or self._is_misspelt_subtree(element, tag, attributes):
                node = self._subtree(element, attributes, blackboard)
            else:
                children = [self._node(child, blackboard) for child in element.children]
                node = self._made(element, tag, attributes, children, blackboard)
        except MissingRobotError as error:
            self._note(element, f"`{tag}` has to name a robot. {error}")
            node = PlaceholderNode(tag)
        finally:
            self._context = before
        set_source_location(node, self._source.file, element.line, element.column)
        return node

    def _choose_robot(self, element: Element, attributes: dict[str, str]) -> None:
        """Take the robot of a tag for it and all below. In a mission on one robot `robot` is a port as any other."""
        if list(self._mission.robots) == [""] or ROBOT not in attributes:
            return
        robot = attributes.pop(ROBOT)
        try:
            self._context = self._mission.of(robot)
        except UnknownNameError as error:
            self._note(element, str(error))
            self._context = next(iter(self._mission.robots.values()))

    @property
    def _types(self) -> Mapping[str, NodeType]:
        """The tags of the present robot; without one those of all robots, which then ask for a robot."""
        found = self._types_by_robot.get(self._context.robot)
        return found or {tag: kind for types in self._types_by_robot.values() for tag, kind in types.items()}

    def _is_misspelt_subtree(self, element: Element, tag: str, attributes: Mapping[str, str]) -> bool:
        found = "ID" in attributes and tag not in self._types and closest(tag, (*self._types, SUBTREE)) == SUBTREE
        if found:
            self._note(element, f"There is no node `{tag}`; did you mean `{SUBTREE}`?")
        return found

    def _made(
        self, element: Element, tag: str, attributes: dict[str, str], children: list[Behaviour], blackboard: Blackboard
    ) -> Behaviour:
        name = attributes.pop("name", f"{self._context.robot}: {tag}" if self._context.robot else tag)
        known = self._types.get(tag) or self._intended_type(element, tag, attributes, children)
        if known is None:
            self._allow_empty(attributes.values(), blackboard)
            return PlaceholderNode(name, children)
        given = _read_attributes(known, attributes)
        self._allow_empty((text for text in attributes.values() if text not in given.ports.values()), blackboard)
        self._note(element, *given.problems)
        ports = {port.name: given.ports.get(port.name, port.default) or "" for port in known.ports}
        lacking = frozenset(port.name for port in known.ports if port.default is None and port.name not in given.ports)
        config = NodeConfig(name, ports, children, blackboard, self._context, absent=lacking)
        for port in known.ports:
            entry = None if port.output else config.entry(port.name)
            if entry is not None:
                self._references.append(_Reference(entry, port.name, element.line))
        child_problems = list(_child_problems(known, children))
        self._note(element, *child_problems)
        node = PlaceholderNode(name, children) if child_problems else self._called(element, known, config)
        self._early += [(entry, FileProblem(element.line, text, element.column)) for entry, text in config.early]
        if given.is_incomplete or ((config.problems or config.early) and children):
            mark_incomplete(node)
        return node

    def _allow_empty(self, texts: Iterable[str], blackboard: Blackboard) -> None:
        """Excuse the entries of unknown attributes: one of them may be meant to be an output, which fills it."""
        for text in texts:
            entry = NodeConfig("", {"": text}, (), blackboard, self._context).entry("")
            if entry is not None:
                entry.allow_empty()

    def _called(self, element: Element, known: NodeType, config: NodeConfig) -> Behaviour:
        try:
            node = known.make(config)
        except PortError as error:
            self._note(element, *config.problems, str(error))
            return PlaceholderNode(config.name, config.children)
        self._note(element, *config.problems)
        if config.unread:
            mark_guessed(node)
        return node

    def _intended_type(
        self, element: Element, tag: str, attributes: Mapping[str, str], children: list[Behaviour]
    ) -> NodeType | None:
        """The type that an unknown tag probably stands for, so that its attributes and children can be checked."""
        if not tag:
            return None  # the problem of the file's frame is reported already
        if tag in _REPLACEMENTS:
            self._note(element, f"`{tag}` of BehaviorTree.CPP is not supported; {_REPLACEMENTS[tag]}")
            return None
        reason = unusable_reason(tag)
        if reason is not None:
            self._note(element, reason)
            return None
        intended = self._nearest_type(tag, attributes, children)
        hint = f"did you mean `{intended.tag}`?" if intended else "`skillwing mission nodes` lists those there are."
        self._note(element, f"There is no node `{tag}`; {hint}")
        fits = (
            intended
            and not any(_child_problems(intended, children))
            and not _read_attributes(intended, attributes).is_incomplete
        )
        return intended if fits else None

    def _nearest_type(self, tag: str, attributes: Mapping[str, str], children: list[Behaviour]) -> NodeType | None:
        """The type with the nearest tag. Of tags that differ in their number only, the one that fits best."""
        near = closest(tag, self._types)
        if near is None:
            return None
        family = [each for each in self._types if each.rstrip(digits) == near.rstrip(digits)]
        types = [self._types[each] for each in sorted(family, key=lambda each: each != near)]
        return min(
            types,
            key=lambda each: (len(_read_attributes(each, attributes).problems), any(_child_problems(each, children))),
        )

    def _subtree(self, element: Element, attributes: dict[str, str], blackboard: Blackboard) -> Behaviour:
        called = self._called_tree(element, attributes)
        name = attributes.pop("name", called)
        inherit = self._inherits(element, attributes)
        given = {port: text for port, text in attributes.items() if not port.startswith("_")}
        links = {port: self._link(port, text, element, blackboard) for port, text in given.items()}
        tree = intended_name(called, self._source.trees)
        if called and called not in (tree, RESCUE):
            # A missing rescue is reported as a problem of the file.
            self._callers.setdefault(called, []).append(element.line)
        if tree is None:
            return PlaceholderNode(name)
        if tree in self._open:
            self._note(element, f"Tree `{tree}` contains itself and would never end.")
            return PlaceholderNode(name)
        links = self._defaults(tree, element, blackboard) | links
        return self.build(tree, Blackboard(blackboard, links, inherit=inherit))

    def _called_tree(self, element: Element, attributes: dict[str, str]) -> str:
        """The tree that a SubTree names; empty, with a problem noted, if it names none."""
        name = intended_name("ID", attributes)
        if name is None:
            self._note(element, f"This {SUBTREE} names no tree; give it the ID of one.")
            return ""
        if name != "ID":
            self._note(element, f"`{SUBTREE}` has no `{name}`; did you mean `ID`?")
        return attributes.pop(name)

    def _inherits(self, element: Element, attributes: Mapping[str, str]) -> bool:
        """True if a SubTree sees all names around it. Other attributes with an underscore are problems."""
        text = "false"
        for name in (each for each in attributes if each.startswith("_")):
            near = intended_name(name, (_AUTOREMAP,))
            if near is None:
                self._note(element, _script(name))
            elif near != name:
                self._note(element, f"`{SUBTREE}` has no `{name}`; did you mean `{near}`?")
            text = text if near is None else attributes[name].lower()
        if text not in _BOOLEANS:
            self._note(element, f"`{_AUTOREMAP}` is `{text}`; it takes `true` or `false`.")
        return _BOOLEANS.get(text, True)

    def _defaults(self, tree: str, element: Element, blackboard: Blackboard) -> dict[str, BlackboardEntry]:
        """The ports of a tree that have a default."""
        ports = self._source.models.get(tree, TreeModel()).ports
        return {
            port.name: self._link(port.name, port.default, element, blackboard)
            for port in ports
            if port.default is not None
        }

    def _link(self, port: str, text: str, element: Element, blackboard: Blackboard) -> BlackboardEntry:
        entry = NodeConfig("", {port: text}, (), blackboard, self._context).entry(port)
        if entry is None:
            return BlackboardEntry(port).set(text)
        self._references.append(_Reference(entry, port, element.line))
        return entry

    def _note(self, element: Element, *texts: str) -> None:
        self.problems.extend(FileProblem(element.line, text, element.column) for text in texts)


def _plain_form(element: Element) -> tuple[str, dict[str, str]]:
    """Tag and attributes; `<Action ID="goto"/>` is `<goto/>`."""
    attributes = {name: text for name, text in element.attributes.items() if name not in _EDITOR_ATTRIBUTES}
    if element.tag in set(Category) and "ID" in attributes:
        return attributes.pop("ID"), attributes
    return element.tag, attributes


@dataclass(frozen=True, slots=True)
class _Given:
    """The attributes of a tag. ports: known and misspelt ports; is_incomplete: other attributes remain that resemble no
    port."""

    ports: Mapping[str, str]
    problems: tuple[str, ...]
    is_incomplete: bool


def _read_attributes(known: NodeType, attributes: Mapping[str, str]) -> _Given:
    names = [port.name for port in known.ports]
    ports = {name: text for name, text in attributes.items() if name in names}
    problems: list[str] = []
    is_incomplete = False
    for name in (each for each in attributes if each not in names):
        near = closest(name, names)
        if name.startswith("_"):
            problems.append(_script(name))
        elif near is None:
            is_incomplete = True
            problems.append(f"`{known.tag}` has no port `{name}`; it has {listed(names)}.")
        else:
            ports.setdefault(near, attributes[name])
            problems.append(f"`{known.tag}` has no port `{name}`; did you mean `{near}`?")
    if not is_incomplete:
        problems += (
            f"`{known.tag}` lacks its port `{port.name}`: {port.about or port.kind}."
            for port in known.ports
            if port.default is None and port.name not in ports
        )
    return _Given(ports, tuple(problems), is_incomplete)


def _script(name: str) -> str:
    return f"`{name}` is a script of BehaviorTree.CPP, which is not supported; remove it."


def _other_lines(lines: Iterable[int]) -> str:
    """Sentence with the further lines of the same problem."""
    match sorted(set(lines)):
        case [_, other]:
            return f" The same in line {other}."
        case [_, *others, last]:
            return f" The same in lines {', '.join(map(str, others))} and {last}."
        case _:
            return ""


def _child_problems(known: NodeType, children: list[Behaviour]) -> Iterator[str]:
    count = len(children)
    match known.category:
        case Category.CONTROL if known.children and count not in known.children:
            written = "1 child" if count == 1 else f"{count} children"
            yield f"`{known.tag}` has {written}; it takes {' or '.join(map(str, known.children))}."
        case Category.CONTROL if not count:
            yield f"`{known.tag}` has no children; give it one at least."
        case Category.DECORATOR if count != 1:
            yield f"`{known.tag}` has {count} children; it takes one."
        case Category.ACTION | Category.CONDITION if count:
            yield f"`{known.tag}` is a leaf; remove its children."
        case _:
            pass
