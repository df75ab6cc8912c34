"""Sentences about values that do not fit: their reader needs no Python."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from skillwing.dsl import parse
from skillwing.dsl.expressions import Comparison, Environment, Literal, Name
from skillwing.dsl.model import ArrayType, EnumType, Field, ScalarType, Type
from skillwing.services.core.guards import explain_failure
from skillwing.services.core.values import LONGEST_TEXT, MOST_PROBLEMS, fit_fields, sendable_text


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


def test_a_misspelt_name_gets_the_right_one() -> None:
    assert problems(lenght=1)[0] == ("lenght", "unknown", "There is no field `lenght`; did you mean `length`?")
    [inner] = problems(at={"x": 1.0, "y": 1.0, "X": 1.0})
    assert inner[2] == "There is no field `at.X`; did you mean `at.x`?"


def test_what_is_missing_is_described_with_a_unit_only_if_it_has_one() -> None:
    _, [pair, *_] = fit_fields(TYPES.skill("go").inputs, {})
    assert pair.sentence == "`pair` is missing; it is a list of 2: each a finite number."


def test_the_values_of_an_enum_are_listed_everywhere() -> None:
    modes = ArrayType(EnumType("Mode", ("SLOW", "FAST")), length=None)
    _, [problem] = fit_fields((Field("modes", modes),), {"modes": "FAST"})
    assert problem.sentence == "`modes` is 'FAST'; it takes a list of any length: each one of `SLOW` and `FAST`."


def test_an_unknown_name_gets_the_list_of_names() -> None:
    [(path, kind, sentence)] = problems(zzzzzzzz=1)
    assert (path, kind) == ("zzzzzzzz", "unknown")
    assert sentence.startswith("There is no field `zzzzzzzz`; there is `on`, `name`, ")


def test_the_limits_themselves_are_within() -> None:
    assert problems(far=0.5) == problems(far=9.0) == problems(count=0) == problems(count=255) == []


def test_truth_is_a_value_like_any_other() -> None:
    for value in (True, False):
        fitted, found = fit_fields(TYPES.skill("go").inputs, FITTING | {"on": value})
        assert (fitted["on"], found) == (value, [])


def test_the_limits_of_a_list_are_those_of_each_element() -> None:
    field = Field("speeds", ArrayType(ScalarType("float64"), length=None), low=0.5, high=9.0)
    fitted, found = fit_fields((field,), {"speeds": [0.5, 10, 9.0, 0.25]})
    assert fitted == {"speeds": [0.5, 10.0, 9.0, 0.25]}
    assert [(problem.path, problem.kind) for problem in found] == [("speeds[1]", "range"), ("speeds[3]", "range")]


@pytest.mark.parametrize(
    ("value", "kind"), [(-1, "type"), (0, "range"), (1, None), (200, None), (255, "range"), (256, "type")]
)
def test_what_the_type_has_room_for_is_a_matter_of_range_alone(value: int, kind: str | None) -> None:
    _, found = fit_fields((Field("count", ScalarType("uint8"), low=1, high=200),), {"count": value})
    assert [problem.kind for problem in found] == ([] if kind is None else [kind])


@pytest.mark.parametrize("kind", ["uint8", "float64"])
@pytest.mark.parametrize(("digits", "shown"), [(400, "1000000"), (5000, "a number beyond all bounds")])
def test_a_whole_number_beyond_all_floats_does_not_fit_and_breaks_nothing(kind: str, digits: int, shown: str) -> None:
    scalar: Type = ScalarType("uint8") if kind == "uint8" else ScalarType("float64")
    _, [problem] = fit_fields((Field("far", scalar),), {"far": 10**digits})
    assert problem.kind == "type"
    assert problem.sentence.startswith(f"`far` is {shown}")


@pytest.mark.parametrize(("length", "whole"), [(60, True), (61, False)])
def test_a_name_is_cut_where_it_gets_too_long(length: int, whole: bool) -> None:
    [(path, _, _)] = problems(**{"z" * length: 0})
    assert path == ("z" * 60 if whole else "z" * 57 + "...")


def test_after_so_much_that_is_wrong_nobody_looks_any_further() -> None:
    wrong = problems(many=[*["no"] * MOST_PROBLEMS, *range(1000)])
    assert wrong[-1][2] == "`many` was not looked at any further: too much of it is wrong."
    assert len(problems(many=["no"] * (MOST_PROBLEMS - 1))) == MOST_PROBLEMS - 1


def test_a_long_text_is_cut_and_one_without_an_encoding_is_repaired() -> None:
    assert sendable_text("x" * LONGEST_TEXT) == "x" * LONGEST_TEXT
    assert sendable_text("x" * (LONGEST_TEXT + 1)) == "x" * LONGEST_TEXT + "..."
    assert sendable_text("a\udc80b") == "a?b"


def test_of_many_problems_the_first_are_reported() -> None:
    unknown = problems(**{f"stranger{number}": 0 for number in range(1000)})
    assert [kind for _, kind, _ in unknown] == ["unknown"] * MOST_PROBLEMS
    wrong = problems(many=[*range(10), *["no"] * 1000])
    assert [path for path, _, _ in wrong] == [*(f"many[{10 + number}]" for number in range(MOST_PROBLEMS)), "many"]
    assert wrong[-1][1:] == ("type", "`many` was not looked at any further: too much of it is wrong.")


def test_a_long_name_is_cut() -> None:
    [(path, _, sentence)] = problems(**{"x" * 1000: 0})
    assert len(path) < 80
    assert len(sentence) < 300


@pytest.mark.parametrize("where", [{"at": {"z": 1.5}}, {"at": SimpleNamespace(z=1.5)}])
def test_of_a_structure_the_field_in_the_guard_is_reported(where: dict[str, object]) -> None:
    high = Literal(2.0)
    expression = Comparison(">", Name("at.z", "data"), high)
    assert explain_failure(expression, Environment(data=where)) == "`at.z > 2.0` does not hold: at.z is 1.5."
    expression = Comparison(">", Name("at.z", "input"), high)
    assert explain_failure(expression, Environment(inputs=where)) == "`at.z > 2.0` does not hold: at.z is 1.5."


def test_a_guard_that_names_nothing_never_holds() -> None:
    never = Comparison(">", Literal(1), Literal(2))
    assert explain_failure(never, Environment()) == "`1 > 2` does not hold: it never does."


def test_a_number_out_of_range_is_shown_in_short() -> None:
    [far] = problems(far=1234567.0)
    assert far[2] == "`far` is 1.23457e+06 m; it has to lie between 0.5 and 9 m."
