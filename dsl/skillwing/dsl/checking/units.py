"""Units of numbers: symbols, dimensions and scales.

Pint has the table of units. It takes longer to import than most checks take. So it is imported only for a unit that is
not among the usual ones, and for a comparison of two different units.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from math import exp, inf, isclose, log
from typing import Any, TypeAlias, cast

from skillwing.dsl.suggest import closest

_Factors: TypeAlias = tuple[tuple[str, int], ...]
_EQUAL = 1e-9
_LARGEST = 709.0
"""Logarithms of factors: of 1 but for rounding, and of the largest float."""
_SYMBOL = r"[^\W\d_]+|[%°]\w*"
_FACTOR = re.compile(rf"(?P<sign>[/*.·]?)(?:1(?!\w)|(?P<symbol>{_SYMBOL})(?:\^?(?P<power>-?\d{{1,2}}))?)")
_UNIT = re.compile(rf"(?:1|(?:{_SYMBOL})(?:\^?-?\d{{1,2}})?)(?:[/*.·](?:{_SYMBOL})(?:\^?-?\d{{1,2}})?)*")
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
    if not all(factors) or sorted(factors[0]) == sorted(factors[1]):
        return None
    return _difference(*factors)


_COMMON_NAMES = ("meter", "metre", "second", "minute", "hour", "degree", "radian", "percent", "volt", "ampere", "watt")


def _factors(unit: str) -> _Factors:
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


def is_in_table(symbol: str) -> bool:
    """True if Pint has a unit of this symbol or name."""
    return _name(symbol) is not None


@cache
def _name(symbol: str) -> str | None:
    """The name of a unit; None for any other word. Pint reads longer texts as expressions."""
    from pint import UndefinedUnitError  # noqa: PLC0415 - as above

    word = _NAMES.get(symbol, symbol)
    if not word.isalpha():
        return None
    try:
        return str(_registry().get_name(word)) or None
    except UndefinedUnitError:
        return None


def _resolved(factors: _Factors) -> Any:
    unit = _registry().Unit("")
    for symbol, power in factors:
        unit *= _unit(symbol) ** power
    return unit


def _unit(symbol: str) -> Any:
    return _registry().Unit(_name(symbol))


def _difference(left: _Factors, right: _Factors) -> OtherDimension | OtherScale | None:
    units = _resolved(left), _resolved(right)
    if units[0].dimensionality != units[1].dimensionality:
        return OtherDimension(*map(_dimension, units))
    if not isclose(_zero(left), _zero(right)):
        return OtherScale(None)
    magnitude = _magnitude(left) - _magnitude(right)
    if abs(magnitude) < _EQUAL:
        return None
    return OtherScale(exp(magnitude) if magnitude < _LARGEST else inf)


def _zero(factors: _Factors) -> float:
    """Zero of a unit in base units. It counts for single units such as °C, and not for °C/s."""
    (symbol, power), *others = factors
    if others or power != 1:
        return 0.0
    return float(_registry().Quantity(0.0, _unit(symbol)).to_base_units().magnitude)


def _magnitude(factors: _Factors) -> float:
    """The natural logarithm of the size in base units, since high powers of small units are no floats."""
    sizes = ((_registry().get_base_units(_unit(symbol), check_nonmult=False)[0], power) for symbol, power in factors)
    return sum(power * log(size) for size, power in sizes)


def _dimension(unit: Any) -> str:
    """The dimension of a unit in words: "length / time^2"."""
    powers = sorted((str(name).strip("[]"), power) for name, power in unit.dimensionality.items())
    above = " * ".join(f"{name}{_exponent(power)}" for name, power in powers if power > 0)
    below = "".join(f" / {name}{_exponent(-power)}" for name, power in powers if power < 0)
    return f"{above or '1'}{below}" if powers else "a number"


def _exponent(power: float) -> str:
    return "" if power == 1 else f"^{power:g}"
