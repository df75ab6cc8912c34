"""Builds the nodes of a tree file, and collects everything that is wrong with it on the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.places import put_place
from skillwing.bt_missions.leaves.unbuilt import Unbuilt, mark_guessed
from skillwing.bt_missions.xml.document import Element
from skillwing.bt_missions.xml.node_type import Call, Category, NodeType, PortError
from skillwing.bt_missions.xml.problems import Problem
from skillwing.bt_missions.xml.scope import Cell, Scope
from skillwing.bt_missions.xml.tree_file import TreeFile, TreeModel
from skillwing.dsl.suggest import closest, listed

SUBTREE = "SubTree"
_OF_EDITORS = ("_uid", "_fullpath", "_description", "_collapsed")
"""Attributes with which editors remember how a node looks."""
_SCRIPTS = ("Script", "ScriptCondition", "Precondition", "Switch2", "Switch3", "IfThenElse", "WhileDoElse")


@dataclass(frozen=True, slots=True)
class _Reference:
    cell: Cell
    port: str
    line: int


class Builder:
    """One building of the trees of one file."""

    def __init__(self, source: TreeFile, types: Mapping[str, NodeType], context: MissionContext) -> None:
        self.problems: list[Problem] = []
        self._source = source
        self._types = types
        self._context = context
        self._references: list[_Reference] = []
        self._open: list[str] = []
        self._built: set[str] = set()

    def build(self, tree: str, scope: Scope) -> Behaviour:
        """The node at the top of a tree. `Unbuilt` stands for what cannot be built, or is not there."""
        if tree not in self._source.trees:
            return Unbuilt(tree)
        self._built.add(tree)
        self._open.append(tree)
        top = self._node(self._source.trees[tree], scope)
        self._open.pop()
        return top

    def build_unused(self) -> Iterator[Behaviour]:
        """The trees that nobody has called until now; what their callers would give them is not missed."""
        for tree in self._source.trees:
            if tree not in self._built:
                element, scope = self._source.trees[tree], Scope(excused=True)
                yield self.build(tree, Scope(scope, self._defaults(tree, element, scope), excused=True))

    def finish(self) -> None:
        """Report the cells that are read and that nothing fills: to be called when all trees are built."""
        for reference in self._references:
            if not (reference.cell.is_filled or reference.cell.is_excused):
                name = reference.cell.name
                text = f"`{reference.port}` reads `{{{name}}}`, which nothing fills; declare it as a port of the tree."
                self.problems.append(Problem(reference.line, text))

    def _node(self, element: Element, scope: Scope) -> Behaviour:
        tag, attributes = _plain_form(element)
        if tag == SUBTREE:
            node = self._subtree(element, attributes, scope)
        else:
            children = [self._node(child, scope) for child in element.children]
            node = self._made(element, tag, attributes, children, scope)
        put_place(node, self._source.file, element.line)
        return node

    def _made(
        self, element: Element, tag: str, attributes: dict[str, str], children: list[Behaviour], scope: Scope
    ) -> Behaviour:
        name = attributes.pop("name", tag)
        known = self._types.get(tag) or self._meant(element, tag, children)
        if known is None:
            return Unbuilt(name, children)
        self._note(element, *_attribute_problems(known, attributes))
        ports = {port.name: attributes.get(port.name, port.default) or "" for port in known.ports}
        lacking = frozenset(port.name for port in known.ports if port.default is None and port.name not in attributes)
        call = Call(name, ports, children, scope, self._context, absent=lacking)
        for port in known.ports:
            cell = None if port.output else call.cell(port.name)
            if cell is not None:
                self._references.append(_Reference(cell, port.name, element.line))
        misfits = list(_child_problems(known, children))
        self._note(element, *misfits)
        return Unbuilt(name, children) if misfits else self._called(element, known, call)

    def _called(self, element: Element, known: NodeType, call: Call) -> Behaviour:
        try:
            node = known.make(call)
        except PortError as error:
            self._note(element, *call.problems, str(error))
            return Unbuilt(call.name, call.children)
        self._note(element, *call.problems)
        if call.unread:
            mark_guessed(node)
        return node

    def _meant(self, element: Element, tag: str, children: list[Behaviour]) -> NodeType | None:
        """What an unknown tag is probably meant to be, so that the rest of it can be looked at all the same."""
        if tag in _SCRIPTS:
            script = f"`{tag}` runs a script of BehaviorTree.CPP, which is not known here"
            self._note(element, f"{script}; use ResourceIs or DataCompare.")
            return None
        near = closest(tag, self._types)
        hint = f"did you mean `{near}`?" if near else "`skillwing mission nodes` lists those there are."
        self._note(element, f"There is no node `{tag}`; {hint}")
        meant = self._types[near] if near else None
        return None if meant is None or any(_child_problems(meant, children)) else meant

    def _subtree(self, element: Element, attributes: dict[str, str], scope: Scope) -> Behaviour:
        tree = attributes.pop("ID", "")
        name = attributes.pop("name", tree)
        inherit = attributes.pop("_autoremap", "false").lower() in ("true", "1")
        given = {port: text for port, text in attributes.items() if not port.startswith("_")}
        links = {port: self._link(port, text, element, scope) for port, text in given.items()}
        if tree not in self._source.trees:
            self._note(element, f"There is no tree `{tree}`; there is {listed(self._source.trees)}.")
            return Unbuilt(name)
        if tree in self._open:
            self._note(element, f"Tree `{tree}` stands in itself and would never end.")
            return Unbuilt(name)
        links = self._defaults(tree, element, scope) | links
        return self.build(tree, Scope(scope, links, inherit=inherit))

    def _defaults(self, tree: str, element: Element, scope: Scope) -> dict[str, Cell]:
        """The ports of a tree that have a value of their own."""
        ports = self._source.models.get(tree, TreeModel()).ports
        return {
            port.name: self._link(port.name, port.default, element, scope) for port in ports if port.default is not None
        }

    def _link(self, port: str, text: str, element: Element, scope: Scope) -> Cell:
        cell = Call("", {port: text}, (), scope, self._context).cell(port)
        if cell is None:
            return Cell(port).hold(text)
        self._references.append(_Reference(cell, port, element.line))
        return cell

    def _note(self, element: Element, *texts: str) -> None:
        self.problems.extend(Problem(element.line, text) for text in texts)


def _plain_form(element: Element) -> tuple[str, dict[str, str]]:
    """Tag and attributes; `<Action ID="goto"/>` is `<goto/>`."""
    attributes = {name: text for name, text in element.attributes.items() if name not in _OF_EDITORS}
    if element.tag in set(Category) and "ID" in attributes:
        return attributes.pop("ID"), attributes
    return element.tag, attributes


def _attribute_problems(known: NodeType, attributes: Mapping[str, str]) -> Iterator[str]:
    for name in attributes:
        if name.startswith("_"):
            yield f"`{name}` is a script of BehaviorTree.CPP, which is not known here; take it out."
        elif known.port(name) is None:
            ports = [port.name for port in known.ports]
            near = closest(name, ports)
            yield f"`{known.tag}` has no port `{name}`; " + (
                f"did you mean `{near}`?" if near else f"it has {listed(ports)}."
            )
    for port in known.ports:
        if port.default is None and port.name not in attributes:
            yield f"`{known.tag}` lacks its port `{port.name}`: {port.about or port.kind}."


def _child_problems(known: NodeType, children: list[Behaviour]) -> Iterator[str]:
    count = len(children)
    match known.category:
        case Category.CONTROL if not count:
            yield f"`{known.tag}` has no children; give it one at least."
        case Category.DECORATOR if count != 1:
            yield f"`{known.tag}` has {count} children; it takes one."
        case Category.ACTION | Category.CONDITION if count:
            yield f"`{known.tag}` is a leaf; take out what stands in it."
        case _:
            pass
