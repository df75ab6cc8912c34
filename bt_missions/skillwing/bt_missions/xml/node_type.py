"""Node types: the tags of tree files, their ports, and the conversion to nodes and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.planning.detour import Position, RoutePlanner
from skillwing.bt_missions.planning.waypoints import Route
from skillwing.bt_missions.xml.blackboard import Blackboard
from skillwing.dsl.suggest import did_you_mean

T = TypeVar("T")
D = TypeVar("D")
BOOLEANS = {"true": True, "false": False}
DATA = "data."
"""Start of the names of entries for the robot's data."""
MILLISECONDS = 1000.0
NOWHERE: tuple[Position, ...] = ((0.0, 0.0, 0.0),)
"""Route in place of one that cannot be read."""


class Category(StrEnum):
    """Categories of nodes in Groot2. A CONTROL has any number of children, a DECORATOR one, the others none."""

    CONTROL = "Control"
    DECORATOR = "Decorator"
    ACTION = "Action"
    CONDITION = "Condition"


@dataclass(frozen=True, slots=True)
class Port:
    """An attribute of a tag. kind: its type, as an editor shows it; default: None for a required one."""

    name: str
    about: str = ""
    kind: str = "string"
    default: str | None = None
    output: bool = False


def _not_described(node: Behaviour) -> None:
    """No attributes: a node of this type is not written."""


@dataclass(frozen=True, slots=True)
class NodeType:
    """A tag. make: builds the node, or raises PortError. describe: the attributes for `make` to build the same node
    again; None for a node of another type. Without it, no node of the type is written.

    standard: BehaviorTree.CPP has this node. children: the numbers of children that a CONTROL takes; empty for any.
    """

    tag: str
    category: Category
    make: Callable[[NodeConfig], Behaviour]
    describe: Callable[[Behaviour], Mapping[str, str] | None] = _not_described
    ports: tuple[Port, ...] = ()
    standard: bool = False
    children: tuple[int, ...] = ()

    def port(self, name: str) -> Port | None:
        return next((port for port in self.ports if port.name == name), None)


def milliseconds_text(seconds: float) -> str:
    """The text for `NodeConfig.seconds` to read."""
    return str(round(seconds * MILLISECONDS))


class PortError(Exception):
    """An attribute that cannot be used; `str()` is a sentence about it."""


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """Configuration of one node: its ports as they are written, or their defaults, and its children.

    A port that cannot be used is noted in `problems` and read as some value of its type. So all problems of a tag are
    found at once, and the caller of `make` refuses the node then.
    absent: missing ports that are reported already. unread: ports without a readable text.
    early: entries that are read before the run and have no value yet, each with the problem to report if they get
    one in the run.
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
        """The entry that a port refers to as `{name}`; None for a port with a plain value.

        `{data.NAME}` is an entry whose value is the latest reading of that datum.
        """
        text = self.ports[port].strip()
        if not (text.startswith("{") and text.endswith("}") and ":" not in text):
            return None
        name = text[1:-1]
        if not name.startswith(DATA):
            return self.blackboard.entry(name)
        entry = BlackboardEntry(name)
        entry.source = LatestReading(self.context, name.removeprefix(DATA))
        return entry

    def live(self, port: str) -> BlackboardEntry | LatestReading | None:
        """The source of a value that is read in the run. None for a plain value and an option, which can be checked
        before."""
        entry = self.entry(port)
        if entry is None or entry.is_constant:
            return None
        return entry.source if isinstance(entry.source, LatestReading) else entry

    def output(self, port: str) -> BlackboardEntry:
        """The entry that an output port sets."""
        entry = self.entry(port)
        if entry is None:
            text = self.ports[port]
            self.problems.append(f"`{port}` is `{text}`; it takes the name of an entry in braces: `{{{port}}}`.")
        return entry or BlackboardEntry(port)

    def written(self, port: str) -> BlackboardEntry:
        """The entry that an output port writes in the run. It can be neither an option nor data of the robot."""
        entry = self.output(port)
        if isinstance(entry.source, LatestReading):
            self.problems.append(f"`{port}` sets `{self.ports[port]}`, which is data of the robot; take another name.")
        elif entry.is_constant:
            self.problems.append(f"`{port}` sets `{self.ports[port]}`, which has a fixed value; take another name.")
        else:
            entry.announce()
            return entry
        return BlackboardEntry(port)

    def value(self, port: str, use: Callable[[object], T], instead: D) -> T | D:
        """The result of `use` on the value of a port before the run: the value of an option, or the text itself.

        use: may raise PortError. instead: result for a port that cannot be used.
        """
        entry = self.entry(port)
        if port in self.absent or (entry is not None and entry.may_be_empty and not entry.is_filled):
            return instead
        try:
            if entry is not None and not entry.is_constant:
                text = f"`{port}` is `{self.ports[port]}`, but it has to be known before the run."
                self.early.append((entry, text))
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

    def seconds(self, port: str) -> float:
        """The seconds of a port in milliseconds, which is `unsigned` as in BehaviorTree.CPP."""
        milliseconds = self.count(port)
        if milliseconds < 0:
            self.problems.append(f"`{port}` is {milliseconds}; it takes 0 or more.")
        return abs(milliseconds) / MILLISECONDS

    def boolean(self, port: str) -> bool:
        text = self.choice(port, tuple(BOOLEANS))
        return BOOLEANS[text]

    def choice(self, port: str, known: Sequence[str]) -> str:
        def use(value: object) -> str:
            text = str(value).strip()
            if text in known:
                return text
            hint = did_you_mean(text, known, f"; it takes one of {', '.join(known)}.")
            raise PortError(f"`{port}` is `{text}`{hint}")

        return self.value(port, use, known[0])

    def route(self, port: str) -> Route:
        """The route that a PlanRoute before this node has written."""

        def use(value: object) -> Route:
            if not isinstance(value, Route):
                raise PortError(f"`{port}` is `{self.ports[port]}`, which is not a plan; put a PlanRoute before it.")
            return value

        return self.value(port, use, Route(self.context, RoutePlanner(NOWHERE)))
