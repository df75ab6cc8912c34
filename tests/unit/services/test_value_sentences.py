"""What is said of a value that does not fit: nobody has to know how Python writes it."""

from __future__ import annotations

import pytest

from skillwing.dsl import parse
from skillwing.dsl.model import Field, ScalarType
from skillwing.services.core.values import LONGEST_TEXT, PROBLEMS_TOLD, fit_fields, sendable_text


@pytest.mark.parametrize(
    ("value", "shown"), [(True, "true"), (None, "nothing"), ((3.0, 1.0), "[3.0, 1.0]"), ([[False]], "[[false]]")]
)
def test_a_value_is_shown_as_it_is_typed(value: object, shown: str) -> None:
    _, problems = fit_fields((Field("dist", ScalarType("int8")),), {"dist": value})
    assert [problem.sentence for problem in problems] == [f"`dist` is {shown}; it takes a whole number (int8)."]


TYPES = parse(
    """
    skillset typed {
        enum Mode { SLOW FAST }
        type Point { x: float64 [m]  y: float64 [m] }
        skill go {
            input {
                on: bool = true
                name: string = "a"
                count: uint8 = 1
                far: float64 [m] in 0.5..9.0 = 1.0
                deep: float32 = 1.0
                mode: Mode = SLOW
                pair: float64[2]
                many: int32[]
                at: Point
                length: float64 [m]
            }
            effect { none {} }
            precondition { success none }
            result { DONE: apply=none }
        }
    }
    """
)
FITTING: dict[str, object] = {"pair": (1, 2.5), "many": [], "at": {"x": 1, "y": 2.0}, "length": 3}


def problems(**given: object) -> list[tuple[str, str, str]]:
    _, found = fit_fields(TYPES.skill("go").inputs, FITTING | given)
    return [(problem.path, problem.kind, problem.sentence) for problem in found]


def test_what_fits_is_widened_and_completed_in_the_order_of_the_skillset() -> None:
    fitted, found = fit_fields(TYPES.skill("go").inputs, FITTING)
    assert found == []
    assert list(fitted.items()) == [
        ("on", True),
        ("name", "a"),
        ("count", 1),
        ("far", 1.0),
        ("deep", 1.0),
        ("mode", "SLOW"),
        ("pair", [1.0, 2.5]),
        ("many", []),
        ("at", {"x": 1.0, "y": 2.0}),
        ("length", 3.0),
    ]


@pytest.mark.parametrize(
    ("given", "kind", "sentence"),
    [
        ({"on": 1}, "type", "`on` is 1; it takes true or false."),
        ({"name": 1}, "type", "`name` is 1; it takes a text."),
        ({"count": 1.5}, "type", "`count` is 1.5; it takes a whole number (uint8)."),
        ({"count": 300}, "type", "`count` is 300; it has to lie between 0 and 255."),
        ({"far": "x"}, "type", "`far` is 'x'; it takes a finite number."),
        ({"far": float("inf")}, "type", "`far` is inf; it takes a finite number."),
        ({"far": 0.25}, "range", "`far` is 0.25 m; it has to lie between 0.5 and 9 m."),
        ({"far": 9.5}, "range", "`far` is 9.5 m; it has to lie between 0.5 and 9 m."),
        ({"mode": "FSAT"}, "type", "`mode` is 'FSAT'; it takes one of `SLOW` and `FAST`. Did you mean `FAST`?"),
        ({"mode": 7}, "type", "`mode` is 7; it takes one of `SLOW` and `FAST`."),
        ({"pair": [1.0]}, "type", "`pair` has 1 elements; it takes 2."),
        ({"pair": 1.0}, "type", "`pair` is 1.0; it takes a list of 2: each a finite number."),
        ({"many": 1}, "type", "`many` is 1; it takes a list of any length: each a whole number (int32)."),
        ({"at": 1}, "type", "`at` is 1; it takes a structure with the fields `x` and `y`."),
        ({"count": "x" * 70}, "type", f"`count` is '{'x' * 56}...; it takes a whole number (uint8)."),
    ],
)
def test_what_does_not_fit_is_named_with_what_would(given: dict[str, object], kind: str, sentence: str) -> None:
    [name] = given
    assert problems(**given) == [(name, kind, sentence)]


def test_what_is_deep_inside_is_named_by_its_path() -> None:
    assert problems(at={"x": "left", "z": 1.0}, many=[1, "two"]) == [
        ("many[1]", "type", "`many[1]` is 'two'; it takes a whole number (int32)."),
        ("at.z", "unknown", "There is no field `at.z`; there is `x` and `y`."),
        ("at.x", "type", "`at.x` is 'left'; it takes a finite number."),
        ("at.y", "missing", "`at.y` is missing; it is a finite number in m."),
    ]


def test_a_name_that_is_like_no_other_is_told_all_there_are() -> None:
    [(path, kind, sentence)] = problems(zzzzzzzz=1)
    assert (path, kind) == ("zzzzzzzz", "unknown")
    assert sentence.startswith("There is no field `zzzzzzzz`; there is `on`, `name`, ")


def test_the_limits_themselves_are_within() -> None:
    assert problems(far=0.5) == problems(far=9.0) == problems(count=0) == problems(count=255) == []


def test_a_long_text_is_cut_and_one_without_an_encoding_is_mended() -> None:
    assert sendable_text("x" * LONGEST_TEXT) == "x" * LONGEST_TEXT
    assert sendable_text("x" * (LONGEST_TEXT + 1)) == "x" * LONGEST_TEXT + "..."
    assert sendable_text("a\udc80b") == "a?b"


def test_of_much_that_is_wrong_the_beginning_is_told() -> None:
    unknown = problems(**{f"stranger{number}": 0 for number in range(1000)})
    assert [kind for _, kind, _ in unknown] == ["unknown"] * PROBLEMS_TOLD
    wrong = problems(many=[*range(10), *["no"] * 1000])
    assert [path for path, _, _ in wrong] == [*(f"many[{10 + number}]" for number in range(PROBLEMS_TOLD)), "many"]
    assert wrong[-1][1:] == ("type", "`many` was not looked at any further: too much of it is wrong.")


def test_a_long_name_is_cut() -> None:
    [(path, _, sentence)] = problems(**{"x" * 1000: 0})
    assert len(path) < 80
    assert len(sentence) < 300
