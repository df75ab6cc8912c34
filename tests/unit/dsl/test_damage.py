"""Files with errors: what is sound in them is judged, and what is damaged may be anything."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.reading.dialect import lex

HERE = Path(__file__).parent
YARD = HERE.parents[2] / "examples" / "yard" / "yard.skillset"
FILES = sorted(
    [*HERE.glob("cases/valid/*.skillset"), HERE.parents[2] / "services" / "skillwing" / "m600" / "m600.skillset", YARD]
)
SYNTAX = {f"SW00{digit}" for digit in range(1, 7)}

IMPOSSIBLE = """
    resource lamp { initial OFF  extern OFF -> ON }
    skill glow {
        precondition { never: resource=(lamp == ON and lamp == OFF) }
        result { DONE }
    }
"""
PUSHED = """
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }
    skill wait_for_arm { precondition { busy: resource=(arm == BUSY) } result { DONE } }
"""


def codes(elements: str) -> list[str]:
    return [diagnostic.code for diagnostic in check(f"skillset s {{ {elements} }}", "f").diagnostics]


@pytest.mark.parametrize(
    ("damage", "code"),
    [
        ("skill k { input { x: flot64 } result { DONE } }", "SW013"),
        ("skill k { precondition { p: resource=(lump == ON) } result { DONE } }", "SW010"),
        ("skill k { precondition { p: resource=(lamp == OM) } result { DONE } }", "SW011"),
        ("skill k { effect { go: lamp -> ON } result { A: apply=go B } }", "SW060"),
        ("resource broken { A -> B  B -> A }", "SW030"),
        ("skill k { precondition p: resource=(lamp == ON) } result { DONE } }", "SW005"),
    ],
)
def test_an_error_hides_none_elsewhere(damage: str, code: str) -> None:
    found = codes(damage + IMPOSSIBLE)
    assert {code, "SW050"} <= set(found)


@pytest.mark.parametrize("use", ["apply=bak", "apply=back"])
def test_what_a_damaged_skill_may_do_counts_as_done(use: str) -> None:
    damaged = f"skill k {{ effect {{ go: arm -> BUSY  back: arm -> IDLE }} result {{ DONE: {use} }} precondition {{"
    assert set(codes(f"{PUSHED} {damaged} p: resource=(arn == IDLE) success go }} }}")) == {"SW010"} | (
        {"SW012"} if use == "apply=bak" else set()
    )


def test_what_no_damaged_skill_names_is_judged_as_ever() -> None:
    unrelated = "resource leg { initial A  A -> B } skill k { effect { go: leg -> C } precondition { success go } }"
    assert {"SW011", "SW050"} <= set(codes(PUSHED + unrelated))


def test_a_damaged_resource_may_be_in_any_of_its_states() -> None:
    skill = "resource r { A -> B } skill k { precondition { p: resource=(%s) } result { D } }"
    assert codes(skill % "r == B") == ["SW030"]
    assert codes(skill % "r == A and r == B") == ["SW030", "SW050"]


@pytest.mark.parametrize(
    ("sound", "broken", "code"),
    [
        ("data=(pad_empty > 2.0)", "data=(pad_empty >> 2.0)", "SW002"),
        ("resource=(pad == FREE)", "resource=(pad = FREE)", "SW005"),
        ("resource=(pad == HELD)", "resource=(pad == HLD)", "SW011"),
        ("resource=(pad == HELD)", "resource=(pd == HELD)", "SW010"),
    ],
)
def test_an_effect_that_skills_and_extern_may_take_is_no_error_beside_a_damaged_guard(
    sound: str, broken: str, code: str
) -> None:
    text = YARD.read_text(encoding="utf-8")
    assert [item.code for item in check(text.replace(sound, broken, 1), "yard").diagnostics] == [code]


def test_an_effect_that_is_extern_alone_is_reported_beside_damage() -> None:
    resource = "resource lock { initial OPEN  OPEN -> SHUT  extern SHUT -> OPEN }"
    guard = "precondition { p: resource=(lock == SHT) success free }"
    skill = f"skill k {{ effect {{ free: lock -> OPEN }} {guard} result {{ DONE }} }}"
    assert codes(resource + skill) == ["SW040", "SW011"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_broken_syntax_raises_no_false_alarm(path: Path) -> None:
    """These files have no error but the one that is put in."""
    text = path.read_text(encoding="utf-8")
    words = [word for word in lex(text, path.name) if word.text]
    chance = random.Random(path.name)
    for _ in range(40):
        word = chance.choice(words)
        sign = chance.choice(["$ ", "{ ", "} ", "-> "])
        end = word.end if word.text in "{}()" and chance.random() < 0.5 else word.start
        broken = text[: word.start] + ("" if end > word.start else sign) + text[end:]
        found = check(broken, path.name).diagnostics
        codes = {item.code for item in found if item.severity == "error"}
        if codes & SYNTAX:
            assert codes <= SYNTAX, broken


def test_names_of_other_kinds_are_judged_beside_a_datum_that_cannot_be_read() -> None:
    text = """skillset q {
    type P { x: double }
    data { a: float64 period=1s
        wind float64 }
    resource r { initial A  A -> B }
    skill p { effect { t: r -> C } precondition { calm: data=(wind < 5.0) } result { D: apply=relase } }
}
"""
    assert [each.code for each in check(text, "q.skillset").diagnostics] == ["SW013", "SW002", "SW011", "SW012"]
