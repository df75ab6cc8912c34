"""Predicates on numbers that no number satisfies, and those that look alike and are possible."""

from __future__ import annotations

import operator
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.checking.checker import check

COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}


def diagnostics(predicate: str, section: str = "precondition") -> list[tuple[str, str | None]]:
    text = f"""skillset s {{
        data {{ battery: float64  b: bool }}
        skill k {{
            input {{ v: float64 in 0.0..5.0  small: uint8  n: int64 in 0..9 }}
            {section} {{ p: data=({predicate}) }}
            result {{ D }}
        }}
    }}"""
    return [(diagnostic.code, diagnostic.help) for diagnostic in check(text, "f").diagnostics]


@pytest.mark.parametrize(
    "predicate",
    [
        "v > 10.0",
        "10.0 < v",
        "v < 0.0",
        "v >= 0 and v > 5.0",
        "small == 300",
        "n > 4 and n < 5",
        "n == 2.5",
        "battery > 20 and battery < 10",
        "battery > 20 and b and battery <= 20.0",
        "v > 10.0 or v < -1.0",
        "b and (v > 10.0 or v < -1.0)",
    ],
)
def test_what_no_number_satisfies_is_reported(predicate: str) -> None:
    assert [code for code, _ in diagnostics(predicate)] == ["SW050"]
    assert [code for code, _ in diagnostics(predicate, "invariant")] == ["SW051"]


@pytest.mark.parametrize(
    "predicate",
    [
        "v >= 5.0",
        "v == 0",
        "small == 255",
        "n > 4 and n <= 5",
        "battery > 20 or battery < 10",
        "battery > 1000",
        "v > 10.0 or b",
        "not (v > 10.0)",
        "v > 10.0 => b",
        "battery < v",
    ],
)
def test_what_may_hold_is_not(predicate: str) -> None:
    assert diagnostics(predicate) == []


def test_a_range_of_a_datum_limits_it() -> None:
    text = """skillset s {{
        data {{ level: float64 [%] in 0.0..100.0 period=1.0  count: int32 in 0..3 }}
        resource r {{ initial A  extern A -> B  extern B -> A }}
        event e {{ guard data=({guard}) effect {{ r -> B }} }}
        skill k {{ {inputs} precondition {{ p: data=({guard}) }} result {{ DONE }} }}
    }}"""

    def found(guard: str, inputs: str = "") -> list[tuple[str, str | None]]:
        return [(item.code, item.help) for item in check(text.format(guard=guard, inputs=inputs), "f").diagnostics]

    assert found("level > 20.0") == []
    advice = "Ask for what `level` can be: 0.0..100.0."
    assert found("level > 100.0") == [("SW055", advice), ("SW050", advice)]
    assert [code for code, _ in found("count > 1 and count < 2")] == ["SW055", "SW050"]
    hidden = "input { level: float64 }"
    assert [code for code, _ in found("level > 100.0", hidden)] == ["SW055"]


def test_a_range_of_a_datum_is_checked_like_that_of_an_input() -> None:
    data = "a: float64 in 5.0..1.0  b: string in 0..1  c: uint8 in 0..300 period=1.0"
    assert [item.code for item in check(f"skillset s {{ data {{ {data} }} }}", "f").diagnostics] == ["SW022"] * 3


def test_the_range_is_named() -> None:
    assert diagnostics("v > 10.0") == [("SW050", "Ask for what `v` can be: 0.0..5.0.")]
    assert diagnostics("small > 255") == [("SW050", "Ask for what `small` can be: 0..255.")]


@given(st.lists(st.tuples(st.sampled_from(sorted(COMPARE)), st.integers(-2, 12)), min_size=1, max_size=4))
def test_whole_numbers_are_judged_as_if_tried(bounds: list[tuple[str, int]]) -> None:
    """`!=` is not looked at, so that what only it makes impossible is missed; nothing is invented."""
    possible = any(all(COMPARE[sign](n, bound) for sign, bound in bounds) for n in range(10))
    reported = bool(diagnostics(" and ".join(f"n {sign} {bound}" for sign, bound in bounds)))
    assert reported <= (not possible)
    if all(sign != "!=" for sign, _ in bounds):
        assert reported is not possible
