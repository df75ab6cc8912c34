"""What a tag of a tree file stands for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.planning.waypoints import Route
from skillwing.bt_missions.xml.scope import Cell, Scope
from skillwing.dsl.suggest import closest

TRUTHS = {"true": True, "false": False}


class Category(StrEnum):
    """As Groot2 names them. The first two have children: any number of them, or exactly one."""

    CONTROL = "Control"
    DECORATOR = "Decorator"
    ACTION = "Action"
    CONDITION = "Condition"


@dataclass(frozen=True, slots=True)
class Port:
    """An attribute of a tag. kind: its type, as an editor shows it; default: None where it has to be given."""

    name: str
    about: str = ""
    kind: str = "string"
    default: str | None = None
    output: bool = False


@dataclass(frozen=True, slots=True)
class NodeType:
    """make: builds the node, and raises PortError. describe: the attributes with which `make` would build a node
    again, None for a node that is none of this type. standard: BehaviorTree.CPP knows it without being told."""

    tag: str
    category: Category
    make: Callable[[Call], Behaviour]
    describe: Callable[[Behaviour], Mapping[str, str] | None]
    ports: tuple[Port, ...] = ()
    standard: bool = False

    def port(self, name: str) -> Port | None:
        return next((port for port in self.ports if port.name == name), None)


class PortError(Exception):
    """An attribute that cannot be used; `str()` is a sentence."""


@dataclass(frozen=True, slots=True)
class Call:
    """One tag that is about to become a node: its ports as they were written, or their defaults."""

    name: str
    ports: Mapping[str, str]
    children: Sequence[Behaviour]
    scope: Scope
    context: MissionContext

    def cell(self, port: str) -> Cell | None:
        """The cell that a port refers to as `{name}`; None for a port with a plain value."""
        text = self.ports[port].strip()
        return self.scope.cell(text[1:-1]) if text.startswith("{") and text.endswith("}") and ":" not in text else None

    def output(self, port: str) -> Cell:
        """The cell that an output port fills."""
        cell = self.cell(port)
        if cell is None:
            raise PortError(f"`{port}` is `{self.ports[port]}`; it takes the name of a cell in braces: `{{{port}}}`.")
        return cell

    def value(self, port: str) -> object:
        """What the port holds before the flight: the value of an option, or the text itself."""
        cell = self.cell(port)
        if cell is None:
            return self.ports[port]
        if not cell.is_known:
            raise PortError(f"`{port}` is `{self.ports[port]}`, but it has to be known before the flight.")
        return cell()

    def text(self, port: str) -> str:
        return str(self.value(port))

    def words(self, port: str) -> tuple[str, ...]:
        """Names with spaces, commas or semicolons between them."""
        return tuple(self.text(port).replace(",", " ").replace(";", " ").split())

    def number(self, port: str) -> float:
        value = self.value(port)
        try:
            return float(str(value))
        except ValueError:
            raise PortError(f"`{port}` is `{value}`; it takes a number.") from None

    def count(self, port: str) -> int:
        number = self.number(port)
        if number != int(number):
            raise PortError(f"`{port}` is `{number:g}`; it takes a whole number.")
        return int(number)

    def truth(self, port: str) -> bool:
        text = self.text(port).strip().lower()
        if text not in TRUTHS:
            raise PortError(f"`{port}` is `{text}`; it takes `true` or `false`.")
        return TRUTHS[text]

    def choice(self, port: str, known: Sequence[str]) -> str:
        text = self.text(port).strip()
        if text not in known:
            near = closest(text, known)
            hint = f"did you mean `{near}`?" if near else "it takes one of " + ", ".join(known) + "."
            raise PortError(f"`{port}` is `{text}`; {hint}")
        return text

    def exactly(self, count: int) -> Sequence[Behaviour]:
        """Its children, which have to be so many."""
        if len(self.children) != count:
            raise PortError(f"`{self.name}` has {len(self.children)} children; it takes {count}.")
        return self.children

    def route(self, port: str) -> Route:
        """The route that a PlanRoute before this node has put into a cell."""
        value = self.value(port)
        if not isinstance(value, Route):
            raise PortError(f"`{port}` is `{self.ports[port]}`, which is no plan; put a PlanRoute before this node.")
        return value
