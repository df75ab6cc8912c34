"""Random skillsets for property tests: every one can be written down and read without an error in its words.

What a skillset *means* is left to chance: a precondition may never hold, a state may be out of reach. Tests of the
checker want just that; others keep to what the reader says.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal as OneOf
from typing import cast

from hypothesis import strategies as st

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.expressions import And, Comparison, Expression, Implies, Literal, Name, NamedValue, Not, Operator, Or
from skillwing.dsl.model import (
    ArrayType,
    DataItem,
    Effect,
    EnumType,
    Event,
    Field,
    Interrupt,
    Invariant,
    Precondition,
    Predicate,
    Resource,
    Result,
    ScalarType,
    Skill,
    Skillset,
    StructType,
    Transition,
    Type,
    Value,
)

_UNITS = ["m", "m/s", "m/s^2", "1/s", "%", "rad", "N*m"]
_WORDS = ["initial", "state", "data", "skill", "apply", "timeout"]  # of the language, and names too
_TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\r", exclude_categories=["Cs"]), max_size=8)
_SECONDS = st.floats(1e-3, 1e6)


def _names(prefix: str, at_most: int, at_least: int = 0) -> st.SearchStrategy[list[str]]:
    return st.lists(st.sampled_from(_numbered(prefix, at_most)), min_size=at_least, max_size=at_most, unique=True)


def _labels(prefix: str, at_most: int) -> st.SearchStrategy[list[str]]:
    """Names with a colon behind them, where words of the language may be names."""
    return st.lists(st.sampled_from([*_numbered(prefix, at_most), *_WORDS]), max_size=at_most, unique=True)


def _numbered(prefix: str, count: int) -> list[str]:
    return [f"{prefix}{number}" for number in range(count)]


# --- types, fields, data


def _types(named: Sequence[EnumType | StructType]) -> st.SearchStrategy[Type]:
    plain = st.sampled_from([*SCALARS.values(), *named])
    return plain | st.builds(ArrayType, plain, st.none() | st.integers(1, 9))


@st.composite
def _fields(draw: st.DrawFn, prefix: str, named: Sequence[EnumType | StructType], most: int = 3) -> tuple[Field, ...]:
    return tuple(draw(_field(name, draw(_types(named)))) for name in draw(_labels(prefix, most)))


@st.composite
def _field(draw: st.DrawFn, name: str, declared: Type) -> Field:
    unit = draw(st.none() | st.sampled_from(_UNITS))
    low, high = None, None
    if isinstance(declared, ScalarType) and declared.is_number and draw(st.booleans()):
        low, high = sorted([draw(_number(declared)), draw(_number(declared))])
    default = draw(st.none() | _default(declared, low, high))
    return Field(name, declared, unit, low, high, default)


def _number(declared: ScalarType) -> st.SearchStrategy[int | float]:
    if declared.bounds is None:
        return st.floats(-1e9, 1e9)
    smallest, largest = declared.bounds
    return st.integers(max(smallest, -(10**9)), min(largest, 10**9))


def _default(declared: Type, low: float | None, high: float | None) -> st.SearchStrategy[Value | None]:
    match declared:
        case EnumType(values=values):
            return st.sampled_from(values)
        case ScalarType(name="bool"):
            return st.booleans()
        case ScalarType(name="string"):
            return _TEXTS
        case ScalarType() if low is not None:
            return st.sampled_from([low, high])
        case ScalarType():
            return _number(declared)
        case _:
            return st.none()


@st.composite
def _named_types(draw: st.DrawFn) -> tuple[EnumType | StructType, ...]:
    enums = [EnumType(f"Kind{n}", tuple(draw(_names("V", 3, 1)))) for n in range(draw(st.integers(0, 2)))]
    structs = [StructType(f"Record{n}", draw(_fields("f", enums))) for n in range(draw(st.integers(0, 2)))]
    return (*enums, *structs)


@st.composite
def _data(draw: st.DrawFn, named: Sequence[EnumType | StructType]) -> tuple[DataItem, ...]:
    return tuple(
        DataItem(ranged.name, ranged.type, ranged.unit, draw(st.none() | _SECONDS), ranged.low, ranged.high)
        for ranged in draw(_fields("d", named))
    )


# --- resources


@st.composite
def resources(draw: st.DrawFn, name: str, most_states: int = 3) -> Resource:
    """A state machine whose transitions lead between any of its states."""
    states = draw(_names("S", most_states, 1))
    pairs = [(a, b, extern) for a in states for b in states for extern in (False, True)]
    edges = draw(st.lists(st.sampled_from(pairs), max_size=5, unique=True))
    return Resource(name, tuple(states), draw(st.sampled_from(states)), tuple(Transition(*edge) for edge in edges))


@st.composite
def _effect(draw: st.DrawFn, name: str, known: Sequence[Resource]) -> Effect:
    changed = draw(st.lists(st.sampled_from(known), max_size=2, unique=True)) if known else []
    return Effect(name, tuple((resource.name, draw(st.sampled_from(resource.states))) for resource in changed))


# --- predicates


def _combined(atoms: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    def wider(inner: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
        pairs = st.tuples(st.sampled_from([And, Or, Implies]), inner, inner)
        return st.builds(Not, inner) | pairs.map(lambda pair: pair[0](pair[1], pair[2]))

    return st.recursive(atoms, wider, max_leaves=4)


def about_resources(known: Sequence[Resource]) -> st.SearchStrategy[Expression]:
    """Predicates over these resources."""

    @st.composite
    def atom(draw: st.DrawFn) -> Expression:
        if not known:
            return Literal(draw(st.booleans()))
        resource = draw(st.sampled_from(known))
        sides = Name(resource.name, "resource"), NamedValue(draw(st.sampled_from(resource.states)))
        return Comparison(draw(st.sampled_from(["==", "!="])), *sides)

    return _combined(atom())


def _about_values(inputs: Sequence[Field], data: Sequence[DataItem]) -> st.SearchStrategy[Expression]:
    hidden = {field.name for field in inputs}
    values: list[tuple[Name, Type]] = [(Name(field.name, "input"), field.type) for field in inputs]
    values += [(Name(item.name, "data"), item.type) for item in data if item.name not in hidden]
    values += [
        (Name(f"{name.path}.{field.name}", name.scope), field.type)
        for name, declared in values
        if isinstance(declared, StructType)
        for field in declared.fields
    ]
    comparable = [(name, declared) for name, declared in values if isinstance(declared, ScalarType | EnumType)]

    @st.composite
    def atom(draw: st.DrawFn) -> Expression:
        if not comparable:
            return Literal(draw(st.booleans()))
        name, declared = draw(st.sampled_from(comparable))
        equal = cast(Operator, draw(st.sampled_from(["==", "!="])))
        match declared:
            case ScalarType(name="bool"):
                return name if draw(st.booleans()) else Comparison(equal, name, Literal(draw(st.booleans())))
            case ScalarType(name="string"):
                return Comparison(equal, name, Literal(draw(_TEXTS)))
            case EnumType(values=words):
                known = {known.root for known, _ in values}
                word = draw(st.sampled_from(words))
                other = name if word in known else NamedValue(word)
                return Comparison(equal, name, other)
            case _:
                sign = cast(Operator, draw(st.sampled_from(["==", "!=", "<", "<=", ">", ">="])))
                return Comparison(sign, name, Literal(draw(st.floats(-1e6, 1e6) | st.integers(-9, 9))))

    return _combined(atom())


# --- skills


@st.composite
def skills(
    draw: st.DrawFn,
    name: str,
    known: Sequence[Resource],
    data: Sequence[DataItem] = (),
    named: Sequence[EnumType | StructType] = (),
) -> Skill:
    """A skill over these resources, data and types, that says what an interruption applies wherever it has to."""
    inputs = draw(_fields("i", named))
    effects = tuple(draw(_effect(effect, known)) for effect in draw(_names("e", 3, 1)))
    some = st.sampled_from([effect.name for effect in effects])

    def predicate() -> tuple[OneOf["resource", "data"], Expression]:
        if draw(st.booleans()):
            return "resource", draw(about_resources(known))
        return "data", draw(_about_values(inputs, data))

    checks = tuple(Predicate(check, *predicate()) for check in draw(_labels("p", 2)))
    invariants = tuple(
        Invariant(invariant, *predicate(), draw(st.none() | some)) for invariant in draw(_labels("v", 2))
    )
    post = st.none() | about_resources(known)
    results = tuple(
        Result(result, draw(st.booleans()), draw(st.none() | some), draw(post)) for result in draw(_names("R", 3))
    )
    agreed = {result.apply for result in results}
    interrupt = agreed.pop() if len(agreed) == 1 and draw(st.booleans()) else draw(some)
    lost = interrupt if interrupt is None or draw(st.booleans()) else draw(some)
    progress = draw(st.none() | _SECONDS)
    return Skill(
        name=name,
        progress_period=progress,
        feedback=() if progress is None else draw(_fields("b", named, 2)),
        inputs=inputs,
        outputs=draw(_fields("o", named, 2)),
        effects=effects,
        preconditions=Precondition(checks, draw(st.none() | some), draw(st.none() | some)),
        invariants=invariants,
        results=results,
        interrupt=Interrupt(interrupt, draw(st.just(5.0) | _SECONDS)),
        lost=lost,
        deadline=draw(st.none() | _SECONDS),
        dispatch_timeout=draw(st.just(1.0) | _SECONDS),
        owner_lost=draw(st.sampled_from(("interrupt", "continue"))),
    )


@st.composite
def skillsets(draw: st.DrawFn, most_skills: int = 2, most_resources: int = 3) -> Skillset:
    """A whole skillset with every kind of element."""
    types = draw(_named_types())
    data = draw(_data(types))
    known = [draw(resources(name)) for name in draw(_names("r", most_resources))]
    guards = st.none() | about_resources(known) | _about_values((), data)
    events = tuple(Event(name, draw(guards), draw(_effect(name, known))) for name in draw(_names("ev", 2)))
    chosen = tuple(draw(skills(name, known, data, types)) for name in draw(_names("k", most_skills)))
    return Skillset("random", types, data, tuple(known), events, chosen)
