"""Builds the nodes of a tree file, and collects everything that is wrong with it on the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.places import put_place
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


class Unbuilt(Behaviour):
    """Stands where a node could not be built, so that everything around it can be looked at; never in a flight."""

    def update(self) -> Status:
        return Status.FAILURE


class Builder:
    """One building of the trees of one file."""

    def __init__(self, source: TreeFile, types: Mapping[str, NodeType], context: MissionContext) -> None:
        self.problems: list[Problem] = []
        self._source = source
        self._types = types
        self._context = context
        self._references: list[_Reference] = []
        self._open: list[str] = []

    def build(self, tree: str, scope: Scope) -> Behaviour:
        """The node at the top of a tree. `Unbuilt` stands for what cannot be built."""
        self._open.append(tree)
        top = self._node(self._source.trees[tree], scope)
        self._open.pop()
        return top

    def finish(self) -> None:
        """Report the cells that are read and that nothing fills: to be called when all trees are built."""
        for reference in self._references:
            if not reference.cell.is_filled:
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
        known = self._types.get(tag)
        if known is None:
            return self._refuse(element, name, self._unknown(tag))
        problems = [*_attribute_problems(known, attributes), *_child_problems(known, children)]
        for text in problems:
            self._refuse(element, name, text)
        if problems:
            return Unbuilt(name)
        ports = {port.name: attributes.get(port.name, port.default) or "" for port in known.ports}
        call = Call(name, ports, children, scope, self._context)
        for port in known.ports:
            cell = None if port.output else call.cell(port.name)
            if cell is not None:
                self._references.append(_Reference(cell, port.name, element.line))
        try:
            return known.make(call)
        except PortError as error:
            return self._refuse(element, name, str(error))

    def _subtree(self, element: Element, attributes: dict[str, str], scope: Scope) -> Behaviour:
        tree = attributes.pop("ID", "")
        name = attributes.pop("name", tree)
        inherit = attributes.pop("_autoremap", "false").lower() in ("true", "1")
        if tree not in self._source.trees:
            return self._refuse(element, name, f"There is no tree `{tree}`; there is {listed(self._source.trees)}.")
        if tree in self._open:
            return self._refuse(element, name, f"Tree `{tree}` stands in itself and would never end.")
        given = {port: text for port, text in attributes.items() if not port.startswith("_")}
        links = {port: self._link(port, text, element, scope) for port, text in given.items()}
        for port in self._source.models.get(tree, TreeModel()).ports:
            if port.name not in links and port.default is not None:
                links[port.name] = self._link(port.name, port.default, element, scope)
        return self.build(tree, Scope(scope, links, inherit=inherit))

    def _link(self, port: str, text: str, element: Element, scope: Scope) -> Cell:
        cell = Call("", {port: text}, (), scope, self._context).cell(port)
        if cell is None:
            return Cell(port).hold(text)
        self._references.append(_Reference(cell, port, element.line))
        return cell

    def _unknown(self, tag: str) -> str:
        if tag in _SCRIPTS:
            return f"`{tag}` runs a script of BehaviorTree.CPP, which is not known here; use ResourceIs or DataCompare."
        near = closest(tag, self._types)
        hint = f"did you mean `{near}`?" if near else "`skillwing mission nodes` lists those there are."
        return f"There is no node `{tag}`; {hint}"

    def _refuse(self, element: Element, name: str, text: str) -> Behaviour:
        self.problems.append(Problem(element.line, text))
        return Unbuilt(name)


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
