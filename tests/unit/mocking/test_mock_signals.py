"""Values that change with time, and what is wrong with the ones that do not fit."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, StructType
from skillwing.services.mocking.signals import SignalContext, SignalReader, value_at

NUMBER = ScalarType("float64")
POINT = StructType("Point", (Field("x", NUMBER), Field("z", NUMBER)))
SPAN = StructType("Span", (Field("from", NUMBER), Field("to", NUMBER)))
INPUTS = (Field("height", NUMBER), Field("target", POINT), Field("count", ScalarType("int32")))
HIGH = {"x": 9.0, "z": 9.0}
KINDS = {
    "number": NUMBER,
    "whole": ScalarType("int32"),
    "text": ScalarType("string"),
    "colour": EnumType("Colour", ("RED", "BLUE")),
    "point": POINT,
    "span": SPAN,
    "list": ArrayType(NUMBER, None),
}


def read(raw: Any, kind: str, inputs: tuple[Field, ...] | None = INPUTS) -> tuple[Any, list[str]]:
    problems: list[str] = []
    signal = SignalReader(problems.append, inputs).read(raw, Field(kind, KINDS[kind]), "it")
    return signal, problems


def value(raw: Any, kind: str, **context: Any) -> Any:
    signal, problems = read(raw, kind)
    assert problems == []
    return value_at(signal, SignalContext(**{"before": None, **context}))


@pytest.mark.parametrize(
    ("raw", "kind", "context", "expected"),
    [
        (12, "number", {}, 12.0),
        ({"value": 12}, "number", {}, 12.0),
        ({"each": [3, 2, 1]}, "whole", {"sample": 1}, 2),
        ({"each": [3, 2, 1]}, "whole", {"sample": 9}, 1),
        ({"from": 10, "to": 0, "over": 5}, "number", {"elapsed": 2.5}, 5.0),
        ({"from": 10, "to": 0, "over": 5}, "number", {"elapsed": 50.0}, 0.0),
        ({"from": 10, "to": 0}, "number", {"elapsed": 1.0, "span": 4.0}, 7.5),
        ({"to": 0, "over": 4}, "number", {"elapsed": 1.0, "before": 8.0}, 6.0),
        ({"from": 0, "to": 3, "over": 2}, "whole", {"elapsed": 1.0}, 2),
        ({"from": "RED", "to": "BLUE", "over": 2}, "colour", {"elapsed": 1.9}, "RED"),
        ({"from": "RED", "to": "BLUE", "over": 2}, "colour", {"elapsed": 2.0}, "BLUE"),
        ({"from": [0, 0], "to": [1, 2], "over": 2}, "list", {"elapsed": 1.0}, [0.5, 1.0]),
        ([1, 2], "list", {}, [1.0, 2.0]),
        ({"input": "height"}, "number", {"inputs": {"height": 3.0}}, 3.0),
        ({"input": "target.z"}, "number", {"inputs": {"target": {"x": 1.0, "z": 2.0}}}, 2.0),
        ({"x": 1, "z": 2}, "point", {"before": {"x": 9.0, "z": 9.0}}, {"x": 1.0, "z": 2.0}),
        ({"z": {"input": "height"}}, "point", {"before": HIGH, "inputs": {"height": 3.0}}, {"x": 9.0, "z": 3.0}),
        ({"to": {"x": 5, "z": 1}, "over": 2}, "point", {"before": HIGH, "elapsed": 1.0}, {"x": 7.0, "z": 5.0}),
        ({"from": 1, "to": 2}, "span", {"before": {"from": 0.0, "to": 0.0}}, {"from": 1.0, "to": 2.0}),
    ],
)
def test_values(raw: Any, kind: str, context: dict[str, Any], expected: Any) -> None:
    assert value(raw, kind, **context) == expected


@pytest.mark.parametrize(
    ("raw", "kind", "sentence"),
    [
        ("a", "number", "it takes a finite number"),
        ("GREEN", "colour", "one of `RED` and `BLUE`"),
        ({"each": [1, "a"]}, "number", "it.each[1]"),
        ({"each": []}, "number", "it cannot be read"),
        ({"form": 1, "to": 2}, "number", "did you mean `from`?"),
        ({"from": 1}, "number", "it cannot be read"),
        ({"value": 1, "to": 2}, "number", "it cannot be read"),
        ({"to": 1, "over": -1}, "number", "a number of seconds"),
        ({"to": 1, "over": float("inf")}, "number", "a number of seconds"),
        ({"x": 1, "y": 2}, "point", "has no field `y`"),
        ({"input": "heigth"}, "number", "did you mean `height`?"),
        ({"input": "target"}, "number", "the input `target` is a structure"),
        ({"input": "height"}, "whole", "the input `height` is a finite number"),
    ],
)
def test_problems(raw: Any, kind: str, sentence: str) -> None:
    signal, problems = read(raw, kind)
    assert len(problems) == 1
    assert sentence in problems[0]
    assert problems[0].endswith((".", "?"))
    del signal


def test_without_a_goal_there_are_no_inputs() -> None:
    _, problems = read({"input": "height"}, "number", inputs=None)
    assert "no goal" in problems[0]


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(0.001, 1e3), st.floats(-1.0, 1e4))
def test_a_ramp_stays_between_its_ends(start: float, end: float, over: float, elapsed: float) -> None:
    found = value({"from": start, "to": end, "over": over}, "number", elapsed=elapsed)
    margin = 1e-9 * max(1.0, abs(start), abs(end))
    assert min(start, end) - margin <= found <= max(start, end) + margin
