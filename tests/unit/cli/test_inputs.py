"""Inputs as they are typed on the command line."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.model import (
    ArrayType,
    EnumType,
    Field,
    ScalarType,
    Skill,
    StructType,
    Type,
)
from skillwing.services.client.inputs import parse_inputs
from skillwing.services.errors import InvalidInputError

FLOAT, INT = ScalarType("float64"), ScalarType("int32")
POSITION = StructType("Position", (Field("x", FLOAT), Field("y", FLOAT), Field("z", FLOAT)))
ROW = StructType("Row", (Field("start", POSITION), Field("end", POSITION), Field("plants", INT)))
TYPES: dict[str, Type] = {
    "height": FLOAT,
    "laps": INT,
    "gently": ScalarType("bool"),
    "name": ScalarType("string"),
    "mode": EnumType("Mode", ("FAST", "SLOW")),
    "target": POSITION,
    "numbers": ArrayType(INT, None),
    "leg": StructType("Leg", (Field("end", POSITION),)),
    "row": ROW,
}
SKILL = Skill("try", inputs=tuple(Field(name, kind, default=0) for name, kind in TYPES.items()))
"""None of its inputs has to be given."""
GOTO = Skill(
    "goto", inputs=(Field("target", POSITION), Field("height", FLOAT, low=0.0, high=9.0), Field("laps", INT, default=1))
)


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ([], {}),
        (["height=5"], {"height": 5.0}),
        (["height=-1.5e1", "laps=3"], {"height": -15.0, "laps": 3}),
        (["gently=true"], {"gently": True}),
        (["gently=False"], {"gently": False}),
        (["name=a=b"], {"name": "a=b"}),
        (["name="], {"name": ""}),
        (["mode=FAST"], {"mode": "FAST"}),
        (["target=10, 5,4"], {"target": {"x": 10.0, "y": 5.0, "z": 4.0}}),
        (["target.x=10", "target.z=4"], {"target": {"x": 10.0, "z": 4.0}}),
        (['target={"x": 1, "y": 2, "z": 3}'], {"target": {"x": 1, "y": 2, "z": 3}}),
        (["leg.end.x=1"], {"leg": {"end": {"x": 1.0}}}),
        (["leg.end=1,2,3"], {"leg": {"end": {"x": 1.0, "y": 2.0, "z": 3.0}}}),
        (["numbers=1,2,3"], {"numbers": [1, 2, 3]}),
        (["numbers="], {"numbers": []}),
        (["numbers=[1, 2]"], {"numbers": [1, 2]}),
    ],
)
def test_words_become_values_of_their_types(words: list[str], values: dict[str, Any]) -> None:
    assert parse_inputs(SKILL, words) == values


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("5", "`5` is not of the form NAME=VALUE."),
        ("=5", "`=5` is not of the form NAME=VALUE."),
        ("height=abc", "`height` is `abc`; it takes a finite number."),
        ("height=nan", "`height` is `nan`; it takes a finite number."),
        ("laps=1.5", "`laps` is `1.5`; it takes a whole number (int32)."),
        ("gently=perhaps", "`gently` is `perhaps`; it takes true or false."),
        ("target=1,2", "`target` is `1,2`; it takes 3 values separated by commas, x,y,z."),
        (
            "row=0,0,10,0,1,2",
            "`row` is `0,0,10,0,1,2`; it takes `start`, `end` and `plants`: each by itself, as in `row.start=VALUE`, "
            "or all as JSON.",
        ),
        (
            'target={"x": 1,}',
            '`target` is `{"x": 1,}`; it takes a structure with the fields `x`, `y` and `z`, '
            "and as JSON it is wrong at `}`.",
        ),
        ("target=[1, NaN]", "`target` is `[1, NaN]`; it takes finite numbers only, and `NaN` is none."),
        ("target=[1e999]", "`target` is `[1e999]`; it takes finite numbers only, and `1e999` is none."),
        (
            f'target={{"x": {"1" * 5000}}}',
            f'`target` is `{{"x": {"1" * 74}...`; it takes finite numbers only, and `{"1" * 80}...` is none.',
        ),
        (
            f"numbers=[1,]{'2' * 5000}",
            f"`numbers` is `[1,]{'2' * 76}...`; it takes a list of any length: each a whole number (int32), "
            f"and as JSON it is wrong at `]{'2' * 79}...`.",
        ),
        (
            f"numbers={'[' * 100_000}",
            f"`numbers` is `{'[' * 80}...`; it takes a list of any length: each a whole number (int32), "
            "and as JSON it is nested too deeply.",
        ),
        (
            'numbers=["\\ud800"]',
            '`numbers` is `["\\ud800"]`; it takes a list of any length: each a whole number (int32), '
            "and as JSON it has half a character in a text: one of a surrogate pair without the other.",
        ),
        (
            'numbers=["\udcff"]',
            '`numbers` is `["\udcff"]`; it takes a list of any length: each a whole number (int32), '
            "and as JSON it has half a character in a text: one of a surrogate pair without the other.",
        ),
        (f"laps={'1' * 400}", f"`laps` is `{'1' * 80}...`; it takes a whole number (int32)."),
        ("target.w=1", "`target` has no field `w`; it is a structure with the fields `x`, `y` and `z`."),
        ("height.x=1", "`height` has no field `x`; it is a finite number."),
    ],
)
def test_a_word_that_cannot_be_read_gets_a_sentence(word: str, sentence: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        parse_inputs(SKILL, [word])
    assert list(caught.value.problems.values()) == [sentence]


def test_all_problems_are_reported_at_once() -> None:
    with pytest.raises(InvalidInputError) as caught:
        parse_inputs(SKILL, ["height=a", "laps=b", "lapz=2", "gently=true", "5"])
    assert set(caught.value.problems) == {"height", "laps", "lapz", "5"}


@pytest.mark.parametrize(
    ("words", "problems"),
    [
        (["laps=a"], {"laps", "target", "height"}),
        (["x=1", "y=2"], {"x", "y", "target", "height"}),
        (["target.x=1", "target.y=a", "height=99"], {"target.y", "target.z", "height"}),
        # What is meant, or wrong in a part, is not missing as well.
        (["heigth=1", "target=1,2"], {"heigth", "target"}),
        (["target.w=1", "height=1"], {"target.w"}),
        # What can be read is judged by who knows more than the words.
        (["height=99"], set()),
    ],
)
def test_missing_inputs_are_reported_with_unreadable_words(words: list[str], problems: set[str]) -> None:
    try:
        parse_inputs(GOTO, words)
        told = set[str]()
    except InvalidInputError as error:
        told = set(error.problems)
    assert told == problems


@pytest.mark.parametrize(
    "words", [["height=1", "height=2"], ["target=1,2,3", "target.x=1"], ["target.x=1", "target=1,2,3"]]
)
def test_nothing_is_given_twice(words: list[str]) -> None:
    with pytest.raises(InvalidInputError, match="given twice"):
        parse_inputs(SKILL, words)


def test_an_unknown_input_is_answered_with_what_exists() -> None:
    with pytest.raises(InvalidInputError) as caught:
        parse_inputs(SKILL, ["heigth=1"])
    assert "did you mean `height`" in str(caught.value)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**31), 2**31 - 1))
def test_numbers_survive_being_written_out(height: float, laps: int) -> None:
    assert parse_inputs(SKILL, [f"height={height!r}", f"laps={laps}"]) == {"height": height, "laps": laps}


@given(st.lists(st.text(max_size=20), max_size=4))
def test_no_word_makes_a_traceback(words: list[str]) -> None:
    try:
        parse_inputs(SKILL, words)
    except InvalidInputError as error:
        assert str(error)
