"""Signals: constants, sequences, ramps, and values from a goal's inputs.

In a script file they are plain values, interpreted by the type of the field:

    12.5                            constant; also `{value: 12.5}`
    {each: [10, 8, 5]}              one per sample, the last one stays
    {from: 10, to: 0, over: 5}      a ramp of 5 s; without `from` it starts at the value before
    {input: "target.x"}             an input of the goal
    {x: 1, z: {input: "height"}}    some fields of a structure; the others keep the value before

Pure: no clock, no I/O.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias, cast

from skillwing.dsl.model import ArrayType, Field, ScalarType, StructType, Type
from skillwing.dsl.suggest import did_you_mean, listed
from skillwing.services.core.values import fit_fields, type_text

KEYS = ("value", "each", "from", "to", "over", "input")


@dataclass(frozen=True, slots=True)
class SignalContext:
    """The context of an evaluation.

    elapsed: seconds since the signal began; sample: number of its values so far; inputs: of its goal; before: the value
    before it began; span: duration in seconds of a ramp without its own.
    """

    before: Any
    elapsed: float = 0.0
    sample: int = 0
    inputs: Mapping[str, Any] = field(default_factory=dict[str, Any])
    span: float = 0.0


@dataclass(frozen=True, slots=True)
class Constant:
    value: Any


@dataclass(frozen=True, slots=True)
class ListOf:
    values: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class Ramp:
    """A ramp. start: None for the value before. over: seconds, None for the span of the context."""

    kind: Type
    start: Signal | None
    end: Signal
    over: float | None


@dataclass(frozen=True, slots=True)
class FromInput:
    path: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Fields:
    parts: Mapping[str, Signal]


Signal: TypeAlias = "Constant | ListOf | Ramp | FromInput | Fields"


def value_at(signal: Signal, context: SignalContext) -> Any:
    """The signal's value, as plain values. Raises KeyError if it names an input that the context lacks."""
    match signal:
        case Constant(value):
            return value
        case ListOf(values):
            return values[min(context.sample, len(values) - 1)]
        case FromInput(path):
            value: Any = context.inputs
            for name in path:
                value = value[name]
            return value
        case Fields(parts):
            before = cast(Mapping[str, Any], context.before)
            return {**before, **{name: value_at(part, _inside(context, name)) for name, part in parts.items()}}
        case Ramp():
            over = context.span if signal.over is None else signal.over
            share = 1.0 if over <= 0.0 else min(1.0, max(0.0, context.elapsed / over))
            start = context.before if signal.start is None else value_at(signal.start, context)
            return _between(start, value_at(signal.end, context), share, signal.kind)


def _inside(context: SignalContext, name: str) -> SignalContext:
    """The context for a field of a structure."""
    return SignalContext(context.before[name], context.elapsed, context.sample, context.inputs, context.span)


def _between(start: Any, end: Any, share: float, kind: Type) -> Any:
    """Linear interpolation for numbers. Other values jump at the end."""
    match kind:
        case ScalarType() if kind.is_number:
            value = start + (end - start) * share
            return round(value) if kind.is_integer else value
        case StructType(fields=fields):
            return {each.name: _between(start[each.name], end[each.name], share, each.type) for each in fields}
        case ArrayType(element=element) if len(start) == len(end):
            return [_between(a, b, share, element) for a, b in zip(start, end, strict=True)]
        case _:
            return start if share < 1.0 else end


# --- reading ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SignalReader:
    """A reader of signals that reports their problems.

    inputs: fields of the goal that a signal may refer to, None if there is no goal. report: receives the sentences.
    has_duration: the owner of the signal has a duration, which is the default of a ramp.
    """

    report: Callable[[str], None]
    inputs: tuple[Field, ...] | None = None
    has_duration: bool = True

    def read(self, raw: Any, target: Field, where: str) -> Signal | None:
        """The signal for a field, or None if it was reported. where: name of the place in sentences."""
        match target.type, raw:
            case StructType(fields=fields), Mapping() if not self._is_signal(raw, fields):
                return self._read_fields(cast(Mapping[str, Any], raw), fields, where)
            case _, Mapping():
                return self._read_form(cast(Mapping[str, Any], raw), target, where)
            case _:
                return self._constant(raw, target, where)

    def read_fields(self, raw: Mapping[str, Any], fields: Sequence[Field], where: str) -> Fields:
        """Signals for the given fields. Unknown ones are reported."""
        return self._read_fields(raw, fields, where)

    def _is_signal(self, raw: Mapping[Any, Any], fields: Sequence[Field]) -> bool:
        """True if a table is a signal. Fields of a structure have priority, because one may be called `from`."""
        names = {each.name for each in fields}
        return not names & raw.keys() and bool(raw) and set(raw) <= set(KEYS)

    def _read_fields(self, raw: Mapping[str, Any], fields: Sequence[Field], where: str) -> Fields:
        known = {each.name: each for each in fields}
        parts: dict[str, Signal] = {}
        for name, value in raw.items():
            if name not in known:
                self.report(f"{where} has no field `{name}`{_hint(name, known)}")
                continue
            part = self.read(value, known[name], f"{where}.{name}")
            if part is not None:
                parts[name] = part
        return Fields(parts)

    def _read_form(self, raw: Mapping[str, Any], target: Field, where: str) -> Signal | None:
        unknown = [name for name in raw if name not in KEYS]
        for name in unknown:
            self.report(f"{where} has no `{name}`{_hint(name, KEYS)}")
        if unknown:
            return None
        match dict(raw):
            case {"value": value, **rest} if not rest:
                return self._constant(value, target, where)
            case {"each": [*values], **rest} if not rest and values:
                fitted = [self._constant(value, target, f"{where}.each[{n}]") for n, value in enumerate(values)]
                return ListOf(tuple(each.value for each in fitted if each is not None))
            case {"input": str() as path, **rest} if not rest:
                return self.from_input(path, target, where)
            case {"to": _, **rest} if rest.keys() <= {"from", "over"}:
                return self._ramp(raw, target, where)
            case _:
                forms = "`value`, a list `each`, `to` with `from` and `over`, or `input`"
                self.report(f"{where} cannot be read. Give {forms}.")
                return None

    def _ramp(self, raw: Mapping[str, Any], target: Field, where: str) -> Signal | None:
        over = raw.get("over")
        if over is not None and not (_is_number(over) and math.isfinite(over) and over >= 0.0):
            self.report(f"{where}.over is `{over}`; it takes a number of seconds.")
            return None
        if over is None and "from" in raw and not self.has_duration:
            self.report(f"{where} does not say how long it takes. Add `over`, in seconds.")
            return None
        start = self.read(raw["from"], target, f"{where}.from") if "from" in raw else None
        end = self.read(raw["to"], target, f"{where}.to")
        if end is None or ("from" in raw and start is None):
            return None
        return Ramp(target.type, start, end, None if over is None else float(over))

    def from_input(self, path: str, target: Field, where: str) -> FromInput | None:
        """The input at a path, for a field; None if a problem was reported."""
        if self.inputs is None:
            self.report(f"{where} takes an input, and there is no goal here to take it from. Give a value.")
            return None
        names = path.split(".")
        fields: Sequence[Field] = self.inputs
        kind: Type | None = None
        for name in names:
            found = next((each for each in fields if each.name == name), None)
            if found is None:
                self.report(
                    f"{where} takes the input `{path}`, which there is not{_hint(name, [f.name for f in fields])}"
                )
                return None
            kind = found.type
            fields = kind.fields if isinstance(kind, StructType) else ()
        if kind is None or not _fits(kind, target.type):
            told = "nothing" if kind is None else type_text(kind)
            self.report(f"{where} takes {type_text(target.type)}; the input `{path}` is {told}.")
            return None
        return FromInput(tuple(names))

    def _constant(self, raw: Any, target: Field, where: str) -> Constant | None:
        fitted, problems = fit_fields((target,), {target.name: raw})
        for problem in problems:
            self.report(f"{where}: {problem.sentence}")
        return None if problems else Constant(fitted[target.name])


def _fits(given: Type, wanted: Type) -> bool:
    match given, wanted:
        case ScalarType(), ScalarType() if given.is_number and wanted.is_float:
            return True
        case _:
            return given == wanted


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _hint(name: str, known: Mapping[str, Any] | Sequence[str]) -> str:
    return did_you_mean(name, known, f"; there is {listed(known)}.")
