"""Advice that would mislead: what it says has to help with the slip at hand."""

from __future__ import annotations

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


def found(elements: str, file: str = "f") -> dict[str, Diagnostic]:
    return {item.code: item for item in check(f"skillset s {{ {elements} }}", file).diagnostics}


def test_states_that_never_come_together_are_told_apart() -> None:
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
