"""The skillset model: the meaning of a checked `.skillset` file.

Everything is immutable and in declaration order. Names of effects are local to their skill. Spans of elements take no
part in equality or in the schema hash.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol, TypeAlias, TypeVar, cast
from typing import Literal as OneOf

from skillwing.dsl.expressions import And, Comparison, Expression, Implies, Literal, Name, Not, Or, to_text
from skillwing.dsl.spans import Span
from skillwing.dsl.suggest import did_you_mean, listed

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

STALE_AFTER_PERIODS = 3
DEFAULT_INTERRUPT_TIMEOUT = 5.0
DEFAULT_DISPATCH_TIMEOUT = 1.0

Value: TypeAlias = bool | int | float | str
PredicateKind: TypeAlias = OneOf["resource", "data"]
OwnerPolicy: TypeAlias = OneOf["interrupt", "continue"]


class UnknownNameError(LookupError):
    """A name that the skillset does not declare.

    kind: "skill", "resource", "input of goto", ...; name: the unknown name; known: the declared names.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.known = tuple(known)
        hint = did_you_mean(name, self.known)
        what, of, owner = kind.partition(" of ")
        where = f" of `{owner}`" if of else ""
        super().__init__(f"There is no {what} `{name}`{where}{hint} What exists: {listed(self.known, limit=30)}.")


# --- types ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ScalarType:
    """`bool`, `int8` ... `int64`, `uint8` ... `uint64`, `float32`, `float64` or `string`."""

    name: str

    @property
    def is_integer(self) -> bool:
        return self.name.startswith(("int", "uint"))

    @property
    def is_float(self) -> bool:
        return self.name.startswith("float")

    @property
    def is_number(self) -> bool:
        return self.name not in ("bool", "string")

    @property
    def bounds(self) -> tuple[int, int] | None:
        """Smallest and largest value of an integer type; None for every other."""
        if not self.is_integer:
            return None
        bits = int(self.name.lstrip("uint"))
        return (0, 2**bits - 1) if self.name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


@dataclass(frozen=True, slots=True)
class EnumType:
    """`enum Name { A B C }`."""

    name: str
    values: tuple[str, ...]
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ArrayType:
    """`T[]` (length None) or `T[n]`."""

    element: Type
    length: int | None


@dataclass(frozen=True, slots=True)
class StructType:
    """`type Name { field: T ... }`."""

    name: str
    fields: tuple[Field, ...]
    span: Span | None = field(default=None, compare=False, repr=False)

    def field(self, name: str) -> Field:
        return _lookup("field", name, self.fields)


Type: TypeAlias = "ScalarType | EnumType | ArrayType | StructType"


@dataclass(frozen=True, slots=True)
class Field:
    """`name: type [unit] in low..high = default`; everything after the type is optional. Bounds are inclusive.

    modifiable: an input that a client can change while the goal runs (`ModifyGoal`).
    """

    name: str
    type: Type
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    default: Value | None = None
    span: Span | None = field(default=None, compare=False, repr=False)
    modifiable: bool = False


@dataclass(frozen=True, slots=True)
class DataItem:
    """A datum of the functional layer. period: promised publishing period in seconds, or None for no promise.

    low, high: the values that the functional layer publishes; None for no promise.
    """

    name: str
    type: Type
    unit: str | None = None
    period: float | None = None
    low: float | None = None
    high: float | None = None
    span: Span | None = field(default=None, compare=False, repr=False)

    @property
    def stale_after(self) -> float | None:
        """Age in seconds at which the datum becomes stale; None: never."""
        return None if self.period is None else STALE_AFTER_PERIODS * self.period


# --- resources -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Transition:
    """`source -> target`. extern: only the functional layer may take it."""

    source: str
    target: str
    extern: bool = False
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Resource:
    """A named state machine."""

    name: str
    states: tuple[str, ...]
    initial: str
    transitions: tuple[Transition, ...]
    span: Span | None = field(default=None, compare=False, repr=False)

    def allows(self, source: str, target: str, extern: bool) -> bool:
        """True if a caller may bring the resource from `source` to `target`.

        Skills (`extern=False`) take internal transitions only, the functional layer (`extern=True`) extern ones only. A
        transition to the present state changes nothing and is open to both.
        """
        if source == target:
            return source in self.states
        return any((edge.source, edge.target, edge.extern) == (source, target, extern) for edge in self.transitions)


@dataclass(frozen=True, slots=True)
class Effect:
    """Transitions applied together or not at all, as (resource, target state) pairs; `e {}` has none.

    spans: of the transitions.
    """

    name: str
    transitions: tuple[tuple[str, str], ...]
    span: Span | None = field(default=None, compare=False, repr=False)
    spans: tuple[Span, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Event:
    """A named set of external transitions. guard: must hold for it to fire; None for no guard."""

    name: str
    guard: Expression | None
    effect: Effect
    span: Span | None = field(default=None, compare=False, repr=False)


# --- skills --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Predicate:
    """`name: resource=(expression)` or `name: data=(expression)`."""

    name: str
    kind: PredicateKind
    expression: Expression
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Precondition:
    """Checks that must hold together. success: effect of the start; failure: effect of a refusal; None for none."""

    checks: tuple[Predicate, ...] = ()
    success: str | None = None
    failure: str | None = None


@dataclass(frozen=True, slots=True)
class Invariant:
    """A condition for the whole run of the skill. violation: effect that is applied when it breaks."""

    name: str
    kind: PredicateKind
    expression: Expression
    violation: str | None
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Result:
    """One way to end. apply: effect, or None; post: must hold after the effect, or None."""

    name: str
    success: bool
    apply: str | None = None
    post: Expression | None = None
    span: Span | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Interrupt:
    """apply: effect once the skill has stopped, or None; timeout: seconds until a stop is forced."""

    apply: str | None = None
    timeout: float = DEFAULT_INTERRUPT_TIMEOUT


@dataclass(frozen=True, slots=True)
class Skill:
    """One capability of the robot.

    progress_period: seconds between two feedback messages, None without feedback. lost: effect that is applied when the
    manager dies. deadline: longest run in seconds, None for no limit. dispatch_timeout: longest run of `on_dispatch` in
    seconds. owner_lost: policy for a goal whose client is gone.
    """

    name: str
    progress_period: float | None = None
    feedback: tuple[Field, ...] = ()
    inputs: tuple[Field, ...] = ()
    outputs: tuple[Field, ...] = ()
    effects: tuple[Effect, ...] = ()
    preconditions: Precondition = Precondition()
    invariants: tuple[Invariant, ...] = ()
    results: tuple[Result, ...] = ()
    interrupt: Interrupt = Interrupt()
    lost: str | None = None
    deadline: float | None = None
    dispatch_timeout: float = DEFAULT_DISPATCH_TIMEOUT
    owner_lost: OwnerPolicy = "interrupt"
    span: Span | None = field(default=None, compare=False, repr=False)

    def effect(self, name: str) -> Effect:
        return _lookup(f"effect of {self.name}", name, self.effects)

    def transitions(self, effect: str | None) -> tuple[tuple[str, str], ...]:
        """The (resource, target) pairs of an effect given by name; none for None."""
        return () if effect is None else self.effect(effect).transitions

    def result(self, name: str) -> Result:
        return _lookup(f"result of {self.name}", name, self.results)

    def invariant(self, name: str) -> Invariant:
        return _lookup(f"invariant of {self.name}", name, self.invariants)

    def input(self, name: str) -> Field:
        return _lookup(f"input of {self.name}", name, self.inputs)

    @property
    def modifiable(self) -> tuple[Field, ...]:
        """The inputs that a client can change while the goal runs."""
        return tuple(item for item in self.inputs if item.modifiable)


@dataclass(frozen=True)
class Skillset:
    """A whole robot, or a subsystem of one."""

    name: str
    types: tuple[EnumType | StructType, ...] = ()
    data: tuple[DataItem, ...] = ()
    resources: tuple[Resource, ...] = ()
    events: tuple[Event, ...] = ()
    skills: tuple[Skill, ...] = ()
    span: Span | None = field(default=None, compare=False, repr=False)

    def skill(self, name: str) -> Skill:
        """Return the skill of that name. Raises UnknownNameError, as do the other look-ups."""
        return _lookup("skill", name, self.skills)

    def resource(self, name: str) -> Resource:
        return _lookup("resource", name, self.resources)

    def datum(self, name: str) -> DataItem:
        return _lookup("datum", name, self.data)

    def event(self, name: str) -> Event:
        return _lookup("event", name, self.events)

    def type(self, name: str) -> EnumType | StructType:
        return _lookup("type", name, self.types)

    @cached_property
    def schema_hash(self) -> str:
        """16 hex digits that change exactly when the meaning does.

        Comments, layout and the order of skills, resources, data, events and types do not count.
        """
        content: dict[str, object] = {"name": self.name}
        for group in ("types", "data", "resources", "events", "skills"):
            content[group] = {element.name: _content(element) for element in getattr(self, group)}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


# --- look-up and canonical form ------------------------------------------------------------------------------------


class _Named(Protocol):
    @property
    def name(self) -> str: ...


_N = TypeVar("_N", bound=_Named)


def _lookup(kind: str, name: str, elements: tuple[_N, ...]) -> _N:
    for element in elements:
        if element.name == name:
            return element
    raise UnknownNameError(kind, name, (element.name for element in elements))


def _canonical(value: object) -> object:
    """Reduce a part of an element to JSON values without spans. A named type in use becomes its name."""
    match value:
        case Comparison() | Not() | And() | Or() | Implies() | Name() | Literal():
            return to_text(value)
        case EnumType(name=name) | StructType(name=name):
            return name
        case tuple():
            return [_canonical(item) for item in cast(tuple[object, ...], value)]
        case _ if is_dataclass(value) and not isinstance(value, type):
            return _content(value)
        case _:
            return value


def _content(element: DataclassInstance) -> dict[str, object]:
    content = {item.name: _canonical(getattr(element, item.name)) for item in fields(element) if item.compare}
    if content.get("owner_lost") == "interrupt":
        # The default counts for nothing, so that hashes from before there was a choice stay valid.
        del content["owner_lost"]
    if content.get("modifiable") is False:
        del content["modifiable"]
    if isinstance(element, DataItem) and element.low is None:  # The same for data, which had no ranges.
        del content["low"], content["high"]
    return content
