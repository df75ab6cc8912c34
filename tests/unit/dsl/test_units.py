"""Units: symbols that exist, and comparisons of numbers with two of them."""

from __future__ import annotations

import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.dsl.checking.checker import check
from skillwing.dsl.checking.units import USUAL, OtherScale, difference, is_in_table, is_unit, unknown_symbol
from skillwing.dsl.diagnostics.diagnostic import Diagnostic

SYMBOLS = sorted(USUAL)


def diagnostics(guard: str, **units: str) -> tuple[Diagnostic, ...]:
    """The diagnostics of a file whose inputs a, b, ... have these units."""
    inputs = "  ".join(f"{name}: float64 {f'[{unit}]' if unit else ''}" for name, unit in units.items())
    skill = f"skill k {{ input {{ {inputs} }} precondition {{ p: data=({guard}) }} result {{ DONE }} }}"
    return check(f"skillset s {{ {skill} }}", "f.skillset").diagnostics


def codes(guard: str, **units: str) -> list[str]:
    return [item.code for item in diagnostics(guard, **units)]


# --- comparisons


@pytest.mark.parametrize(
    ("left", "right"),
    [("m", "m"), ("m/s", "m/s"), ("N*m", "m*N"), ("m/s^2", "m/s/s"), ("1/s", "Hz"), ("kWh", "kW*h"), ("l", "dm^3")],
)
def test_numbers_of_one_dimension_and_scale_are_compared(left: str, right: str) -> None:
    assert codes("a < b", a=left, b=right) == []


@pytest.mark.parametrize(
    ("left", "right", "message", "advice"),
    [
        (
            "m",
            "s",
            "`a` is in `m`, `b` in `s`: they cannot be compared.",
            "Compare numbers of one dimension: length is not time.",
        ),
        (
            "m/s",
            "m/s^2",
            "`a` is in `m/s`, `b` in `m/s^2`: they cannot be compared.",
            "Compare numbers of one dimension: length / time is not length / time^2.",
        ),
        (
            "%",
            "V",
            "`a` is in `%`, `b` in `V`: they cannot be compared.",
            "Compare numbers of one dimension: a number is not length^2 * mass / current / time^3.",
        ),
    ],
)
def test_different_dimensions_are_not_compared(left: str, right: str, message: str, advice: str) -> None:
    assert [(item.code, item.message, item.help) for item in diagnostics("a < b", a=left, b=right)] == [
        ("SW071", message, advice)
    ]


@pytest.mark.parametrize(
    ("left", "right", "advice"),
    [
        ("km/h", "m/s", "1 km/h is 0.277778 m/s: declare both in one unit."),
        ("m", "cm", "1 m is 100 cm: declare both in one unit."),
        ("deg", "rad", "1 deg is 0.0174533 rad: declare both in one unit."),
        ("Mbit/s", "bit/s", "1 Mbit/s is 1e+06 bit/s: declare both in one unit."),
        ("°C", "K", "The zeros of the two differ: declare both in one unit."),
        ("°C", "°F", "The zeros of the two differ: declare both in one unit."),
    ],
)
def test_different_scales_are_an_error_with_the_factor(left: str, right: str, advice: str) -> None:
    assert [(item.code, item.help) for item in diagnostics("a >= b", a=left, b=right)] == [("SW072", advice)]


@pytest.mark.parametrize("guard", ["a < 3", "3.0 >= a", "a < b", "b == a"])
def test_numbers_without_a_unit_compare_with_anything(guard: str) -> None:
    assert codes(guard, a="m", b="") == []


def test_data_inputs_and_fields_are_compared_wherever_a_guard_is() -> None:
    text = """skillset s {
        type Point { x: float64 [m]  age: float64 [s] }
        data { place: Point  wind: float64 [m/s]  gust: float64 [km/h] }
        resource r { initial A  extern A -> B  extern B -> A }
        event e { guard data=(wind < gust) effect { r -> B } }
        skill k {
            input { wind: float64 [m]  at: Point }
            precondition { a: data=(place.x < at.age)  b: data=(place.x < wind and not (wind > gust)) }
            invariant { c: data=(place.age == at.x or place.age == at.age) }
            result { DONE: post data=(place.x > gust) }
        }
    }"""
    found = [(item.code, item.span.line) for item in check(text, "f.skillset").diagnostics]
    assert found == [("SW072", 5), ("SW071", 8), ("SW071", 8), ("SW071", 9), ("SW071", 10)]


def test_a_comparison_of_different_units_hides_no_other_error() -> None:
    resource = "resource r { initial A  A -> B  B -> A }"
    inputs = "input { a: float64 [m] in 0.0..1.0  b: float64 [s] }"
    guards = "precondition { p: data=(a < b)  q: data=(a > 2.0)  r: resource=(r == A and r == B) }"
    text = f"skillset s {{ {resource} skill k {{ {inputs} {guards} result {{ DONE }} }} }}"
    errors = [item.code for item in check(text, "f.skillset").diagnostics if item.severity == "error"]
    assert errors == ["SW071", "SW050", "SW050"]


# --- symbols


@pytest.mark.parametrize(
    "unit", ["knot", "mph", "µm", "Ω", "kΩ*m", "°", "°C/min", "N·m", "m3", "meters/second", "1/min", "m^-2", "1"]
)
def test_units_of_the_table_exist(unit: str) -> None:
    assert is_unit(unit)
    assert unknown_symbol(unit) is None


@pytest.mark.parametrize(
    ("unit", "wrong", "advice"),
    [
        ("bananas", "bananas", "Take a unit such as `m`, `s`, `m/s`, `rad` or `%`. A count has none."),
        ("metr/s", "metr", "Did you mean `metre`?"),
        ("m/sek", "sek", None),
        ("KM", "KM", "Did you mean `km`?"),
        ("RPM", "RPM", "Did you mean `rpm`?"),
        ("Mbits*bananas", "bananas", None),
    ],
)
def test_other_words_are_no_units(unit: str, wrong: str, advice: str | None) -> None:
    text = f"skillset s {{ data {{ a: float64 [{unit}] }} }}"
    (found,) = check(text, "f.skillset").diagnostics
    assert (found.code, found.message) == ("SW070", f"There is no unit `{wrong}`.")
    assert advice is None or found.help == advice
    assert found.span.column == text.index("[") + 1


def test_an_unknown_unit_is_one_error() -> None:
    assert codes("a < b and b < a", a="bananas", b="m") == ["SW070"]


@pytest.mark.parametrize("symbol", SYMBOLS)
def test_the_usual_symbols_are_in_the_table(symbol: str) -> None:
    assert is_in_table(symbol)


def _unit(draw: st.DrawFn) -> str:
    factors = draw(st.lists(st.tuples(st.sampled_from(SYMBOLS), st.integers(-2, 3)), min_size=1, max_size=3))
    return "*".join(f"{symbol}^{power}" for symbol, power in factors if power) or "1"


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("km^99*km^99", "m^99*m^99"),
        ("mm^-99*mm^-99*mm^-99", "m^-99*m^-99*m^-99"),
        ("dB", "%"),
        ("°C/s", "dB"),
    ],
)
def test_units_that_nobody_writes_are_compared(left: str, right: str) -> None:
    assert difference(left, right) is not None and difference(right, left) is not None


@pytest.mark.parametrize("unit", ["nan", "m²", "½", "²", "W⁰", "%a", "°X", "ﬁ", "İ", "lambda2", "m^100", "m" * 3000])
def test_a_word_that_the_table_reads_as_an_expression_is_no_unit(unit: str) -> None:
    found = {item.code for item in diagnostics("a < 1", a=unit)}
    assert found <= {"SW070", "SW021", "SW004"} and (found or unit == "lambda2")


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_differences_are_the_same_from_both_sides(data: st.DataObject) -> None:
    left, right = data.draw(st.composite(_unit)()), data.draw(st.composite(_unit)())
    there, back = difference(left, right), difference(right, left)
    assert type(there) is type(back)
    assert difference(left, left) is None
    if isinstance(there, OtherScale) and isinstance(back, OtherScale) and there.factor and back.factor:
        assert there.factor * back.factor == pytest.approx(1.0)


def test_usual_units_are_checked_without_the_table() -> None:
    """Most files need no look-up, and then pay nothing for it."""
    text = "skillset s { data { a: float64 [m/s]  b: float64 [m/s] } event e { guard data=(a < b) effect {} } }"
    program = f"import sys; from skillwing.dsl import parse; parse({text!r}); sys.exit('pint' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
