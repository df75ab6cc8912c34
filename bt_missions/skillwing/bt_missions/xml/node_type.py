"""What a tag of a tree file stands for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.planning.detour import Position, RoutePlanner
from skillwing.bt_missions.planning.waypoints import Route
from skillwing.bt_missions.xml.blackboard import Blackboard, BlackboardEntry
from skillwing.dsl.suggest import closest

T = TypeVar("T")
D = TypeVar("D")
BOOLEANS = {"true": True, "false": False}
NOWHERE: tuple[Position, ...] = ((0.0, 0.0, 0.0),)
"""The route of a plan that is none."""


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
    make: Callable[[NodeConfig], Behaviour]
    describe: Callable[[Behaviour], Mapping[str, str] | None]
    ports: tuple[Port, ...] = ()
    standard: bool = False

    def port(self, name: str) -> Port | None:
        return next((port for port in self.ports if port.name == name), None)


class PortError(Exception):
    """An attribute that cannot be used; `str()` is a sentence."""


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """One tag that is about to become a node: its ports as they were written, or their defaults.

    A port that cannot be used is noted in `problems`, and read as some value of its kind, so that all that is wrong
    with a tag is found at once; who calls `make` refuses the node then. absent: ports whose lack has been told already.
    unread: names that are not known, so that nobody can judge what they stand for. early: entries that are read before
    the flight and that nothing has filled until then, each with what to say if something fills it in flight.
    """

    name: str
    ports: Mapping[str, str]
    children: Sequence[Behaviour]
    blackboard: Blackboard
    context: MissionContext
    absent: frozenset[str] = frozenset()
    problems: list[str] = field(default_factory=list[str])
    unread: set[str] = field(default_factory=set[str])
    early: list[tuple[BlackboardEntry, str]] = field(default_factory=list[tuple[BlackboardEntry, str]])

    def entry(self, port: str) -> BlackboardEntry | None:
        """The entry that a port refers to as `{name}`; None for a port with a plain value."""
        text = self.ports[port].strip()
        return (
            self.blackboard.entry(text[1:-1])
            if text.startswith("{") and text.endswith("}") and ":" not in text
            else None
        )

    def output(self, port: str) -> BlackboardEntry:
        """The entry that an output port fills."""
        entry = self.entry(port)
        if entry is None:
            self.problems.append(f"`{port}` is `{self.ports[port]}`; it takes a entry's name in braces: `{{{port}}}`.")
        return entry or BlackboardEntry(port)

    def value(self, port: str, use: Callable[[object], T], instead: D) -> T | D:
        """What `use` makes of what the port holds before the flight: the value of an option, or the text itself.

        use: raises PortError. instead: for a port that cannot be used.
        """
        entry = self.entry(port)
        if port in self.absent or (entry is not None and entry.is_excused and not entry.is_filled):
            return instead
        try:
            if entry is not None and not entry.is_known:
                self.early.append(
                    (entry, f"`{port}` is `{self.ports[port]}`, but it has to be known before the flight.")
                )
                return instead
            return use(self.ports[port] if entry is None else entry())
        except PortError as error:
            self.problems.append(str(error))
            return instead

    def text(self, port: str) -> str:
        text = self.value(port, str, None)
        if text is None:
            self.unread.add(port)
        return text or ""

    def words(self, port: str) -> tuple[str, ...]:
        """Names with spaces, commas or semicolons between them."""
        return self.value(port, lambda value: tuple(str(value).replace(",", " ").replace(";", " ").split()), ())

    def number(self, port: str) -> float:
        def use(value: object) -> float:
            try:
                return float(str(value))
            except ValueError:
                raise PortError(f"`{port}` is `{value}`; it takes a number.") from None

        return self.value(port, use, 1.0)

    def count(self, port: str) -> int:
        number = self.number(port)
        if not number.is_integer():
            self.problems.append(f"`{port}` is `{number:g}`; it takes a whole number.")
            return 1
        return int(number)

    def boolean(self, port: str) -> bool:
        text = self.choice(port, tuple(BOOLEANS))
        return BOOLEANS[text]

    def choice(self, port: str, known: Sequence[str]) -> str:
        def use(value: object) -> str:
            text = str(value).strip()
            if text in known:
                return text
            near = closest(text, known)
            hint = f"did you mean `{near}`?" if near else "it takes one of " + ", ".join(known) + "."
            raise PortError(f"`{port}` is `{text}`; {hint}")

        return self.value(port, use, known[0])

    def exactly(self, count: int) -> Sequence[Behaviour]:
        """Its children, which have to be so many. Raises PortError."""
        if len(self.children) != count:
            raise PortError(f"`{self.name}` has {len(self.children)} children; it takes {count}.")
        return self.children

    def route(self, port: str) -> Route:
        """The route that a PlanRoute before this node has put into a entry."""

        def use(value: object) -> Route:
            if not isinstance(value, Route):
                raise PortError(f"`{port}` is `{self.ports[port]}`, which is no plan; put a PlanRoute before it.")
            return value

        return self.value(port, use, Route(self.context, RoutePlanner(NOWHERE)))
