"""Units of numbers: symbols, dimensions and scales.

Pint has the table of units. It takes longer to import than most checks take. So it is imported only for a unit that is
not among the usual ones, and for a comparison of two different units.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from math import isclose
from typing import Any, cast

from skillwing.dsl.suggest import closest

_SYMBOL = r"[^\W\d_]+|[%°]\w*"
_FACTOR = re.compile(rf"(?P<sign>[/*.·]?)(?:1(?!\w)|(?P<symbol>{_SYMBOL})(?:\^?(?P<power>-?\d+))?)")
_UNIT = re.compile(rf"(?:1|(?:{_SYMBOL})(?:\^?-?\d+)?)(?:[/*.·](?:{_SYMBOL})(?:\^?-?\d+)?)*")
_NAMES = {"%": "percent", "°": "degree", "°C": "degC", "°F": "degF"}
"""Names of symbols that are no words."""
USUAL = frozenset(
    {
        *("m", "km", "cm", "mm", "s", "ms", "us", "min", "h", "kg", "g", "rad", "deg", "°", "%", "Hz", "kHz", "MHz"),
        *("rpm", "N", "Pa", "kPa", "hPa", "bar", "J", "kJ", "W", "kW", "Wh", "V", "mV", "A", "mA", "Ah", "K", "°C"),
        *("bit", "kbit", "Mbit", "byte", "T", "lx", "l", "mol"),
    }
)
"""Symbols that need no look-up, and that are suggested for a misspelt one."""


@dataclass(frozen=True, slots=True)
class OtherDimension:
    """Two units of different dimensions, each in words: "length / time"."""

    left: str
    right: str


@dataclass(frozen=True, slots=True)
class OtherScale:
    """Two units of one dimension. factor: one of the left in those of the right; None if their zeros differ."""

    factor: float | None


def is_unit(text: str) -> bool:
    """True if a text has the form of a unit."""
    return _UNIT.fullmatch(text) is not None


def unknown_symbol(unit: str) -> str | None:
    """The first symbol of a unit that is none; None if all are known."""
    return next((symbol for symbol, _ in _factors(unit) if symbol not in USUAL and not is_in_table(symbol)), None)


def similar_symbol(symbol: str) -> str | None:
    """The usual symbol or the common name of a unit that a wrong one resembles; None if none is close."""
    return closest(symbol, (*USUAL, *_COMMON_NAMES))


def difference(left: str, right: str) -> OtherDimension | OtherScale | None:
    """The difference between two units; None if their numbers can be compared."""
    factors = _factors(left), _factors(right)
    if sorted(factors[0]) == sorted(factors[1]):
        return None
    return _difference(_resolved(factors[0]), _resolved(factors[1]))


_COMMON_NAMES = ("meter", "metre", "second", "minute", "hour", "degree", "radian", "percent", "volt", "ampere", "watt")


def _factors(unit: str) -> tuple[tuple[str, int], ...]:
    """The symbols of a unit with their powers; none for `1`."""
    found = (match.group("sign", "symbol", "power") for match in _FACTOR.finditer(unit))
    return tuple(
        (symbol, (-1 if sign == "/" else 1) * int(power or 1)) for sign, symbol, power in found if symbol is not None
    )


# --- Pint, whose types are generic to a degree that says nothing here


@cache
def _registry() -> Any:
    from pint import UnitRegistry  # noqa: PLC0415 - slow to import, and few files need it

    return cast(Any, UnitRegistry())


@cache
def is_in_table(symbol: str) -> bool:
    """True if Pint has a unit of this symbol or name."""
    return _NAMES.get(symbol, symbol) in _registry()


def _resolved(factors: tuple[tuple[str, int], ...]) -> Any:
    registry = _registry()
    unit = registry.Unit("")
    for symbol, power in factors:
        unit *= registry.Unit(_NAMES.get(symbol, symbol)) ** power
    return unit


def _difference(left: Any, right: Any) -> OtherDimension | OtherScale | None:
    if left.dimensionality != right.dimensionality:
        return OtherDimension(_dimension(left), _dimension(right))
    if not isclose(_zero(left, right), 0.0, abs_tol=1e-12):
        return OtherScale(None)
    factor = _size(left) / _size(right)
    return None if isclose(factor, 1.0) else OtherScale(factor)


def _zero(left: Any, right: Any) -> float:
    """Zero of the left unit in the right one. Pint has none for units such as °C/s, where no zero counts."""
    from pint import OffsetUnitCalculusError  # noqa: PLC0415 - as above

    try:
        return float(_registry().Quantity(0.0, left).to(right).magnitude)
    except OffsetUnitCalculusError:
        return 0.0


def _size(unit: Any) -> float:
    """The size of a unit in base units."""
    return float(_registry().get_base_units(unit, check_nonmult=False)[0])


def _dimension(unit: Any) -> str:
    """The dimension of a unit in words: "length / time^2"."""
    powers = sorted((str(name).strip("[]"), power) for name, power in unit.dimensionality.items())
    above = " * ".join(f"{name}{_exponent(power)}" for name, power in powers if power > 0)
    below = "".join(f" / {name}{_exponent(-power)}" for name, power in powers if power < 0)
    return f"{above or '1'}{below}" if powers else "a number"


def _exponent(power: float) -> str:
    return "" if power == 1 else f"^{power:g}"
