"""Advice that would mislead: what it says has to help with the slip at hand."""

from __future__ import annotations

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import Diagnostic

TIED = """
    resource r { initial A  A -> B  B -> A }
    resource w { initial OK  OK -> BAD  BAD -> OK }
    skill both {
        effect { go { r -> B  w -> BAD }  back { r -> A  w -> OK } }
        precondition { free: resource=(r == A)  success go }
        result { DONE: apply=back }
    }
"""


def told(elements: str) -> list[tuple[str, str, str | None]]:
    """Code, message and help of each error."""
    diagnostics = check(f"skillset s {{ {elements} }}", "f").diagnostics
    return [(item.code, item.message, item.help) for item in diagnostics if item.severity == "error"]


def found(elements: str, file: str = "f") -> dict[str, Diagnostic]:
    return {item.code: item for item in check(f"skillset s {{ {elements} }}", file).diagnostics}


def test_states_that_never_come_together_are_distinguished() -> None:
    advice = found(TIED + "skill k { precondition { p: resource=(r == A and w == BAD) } result { D } }")["SW050"].help
    assert advice is not None
    assert "`r` can be A or B, `w` can be BAD or OK, but not in every combination" in advice
    assert "`r == A` and `w == OK`" in advice


def test_a_constant_is_not_advised_on_states() -> None:
    for kind in ("data", "resource"):
        advice = found(f"skill k {{ precondition {{ p: {kind}=(false) }} result {{ D }} }}")["SW050"].help
        assert advice == "It names nothing that could make it true: write what is meant, or remove it."


def test_numbers_have_no_fields() -> None:
    wrong = found("skill k { input { pos: float64 } precondition { p: data=(pos.x > 1.0) } result { D } }")["SW015"]
    assert (wrong.message, wrong.help) == ("`pos` is a float64, which has no fields.", "Compare `pos` itself.")


def test_an_interruption_is_not_advised_to_keep_what_was_taken() -> None:
    skill = "skill k {{ effect {{ take: r -> B {back} }} precondition {{ success take }} result {{ {results} }} }}"
    resource = "resource r { initial A  A -> B  B -> A }"
    some = found(resource + skill.format(back="free: r -> A", results="D: apply=free  E"))["SW060"].help
    none = found(resource + skill.format(back="", results=""))["SW060"].help
    assert some == "Write `interrupt { apply=free }`."
    assert none is not None and none.startswith("Declare an effect that gives back")


def test_the_robot_language_is_not_advised_to_write_what_it_cannot() -> None:
    text = """skillset s {
        data { battery: Float }
        resource { r { state { A B } initial A transition { A -> B } } }
        skill k { precondition { p: battery == A } success D { } }
    }"""
    advice = next(item.help for item in check("type Float " + text, "f.rl").diagnostics if item.code == "SW027")
    assert advice is not None and "convert" in advice and "data=" not in advice


@pytest.mark.parametrize(
    ("results", "written", "meant"),
    [
        ("sucess A  failure B", "sucess", "success"),
        ("success A  failur B", "failur", "failure"),
        ("Success A  failure B", "Success", "success"),
        ("sucess A: post resource=(r == B)", "sucess", "success"),
    ],
)
def test_a_misspelt_mark_of_a_result_is_no_result(results: str, written: str, meant: str) -> None:
    skill = f"skill k {{ effect {{ e: r -> B }} precondition {{ success e }} result {{ {results} }} }}"
    assert told(f"resource r {{ initial A  A -> B  B -> A }} {skill}") == [
        ("SW003", f"`{written}` is no word of the language.", f"Did you mean `{meant}`?")
    ]


@pytest.mark.parametrize("results", ["SUCCESS FAILURE", "failed late", "succes\n late", "failures: post data=(x) b"])
def test_a_result_may_be_called_almost_like_a_mark(results: str) -> None:
    assert told(f"data {{ x: bool }} skill k {{ result {{ {results} }} }}") == []


USER = "skill k { effect { go: r -> BUSY  back: r -> IN_AIR } precondition { success go } result { D: apply=back } }"


@pytest.mark.parametrize(
    ("transitions", "problem", "advice"),
    [
        (
            "IN_AIR -> BUSY  BSY -> IN_AIR",
            "No transition leads `r` from `IN_AIR` to `BSY`.",
            "Did you mean `BUSY`? Otherwise add",
        ),
        ("IN_AIR -> BUZY  BUSY -> IN_AIR", "Only a transition of `r` names the state `BUZY`.", "Did you mean `BUSY`?"),
        (
            "IN_AIR -> BUSY  LOST -> IN_AIR",
            "No transition leads `r` from `IN_AIR` to `LOST`.",
            "Add a transition such as `IN_AIR -> LOST`",
        ),
    ],
)
def test_a_state_that_nothing_leads_to_may_be_a_misspelt_one(transitions: str, problem: str, advice: str) -> None:
    error = found(f"resource r {{ initial IN_AIR  {transitions} }} {USER}")["SW031"]
    assert error.message == problem
    assert error.help is not None and error.help.startswith(advice)


def test_a_misspelt_initial_state_is_reported_once() -> None:
    transitions = "IN_AIR -> BUSY  BUSY -> IN_AIR"
    errors = [each for each in told(f"resource r {{ initial IN_AR  {transitions} }} {USER}") if each[0] == "SW031"]
    (_, message, advice) = errors[0]
    assert len(errors) == 1 and message == "No transition leads `r` out of `IN_AR`, its initial state."
    assert advice is not None and advice.startswith("Did you mean `initial IN_AIR`?")


def test_a_state_that_is_listed_is_no_typing_error() -> None:
    error = found("resource r { state { SHUT SHUTS OPEN } initial SHUT  SHUT -> OPEN  OPEN -> SHUT }")["SW031"]
    assert error.help == "Add a transition such as `SHUT -> SHUTS`, or remove the state."
