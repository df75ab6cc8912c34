"""One run reports every error: what an error leaves readable is judged, and one slip is one error."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading.dialect import lex

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[2] / "examples"
SHORT_FILES = [
    *(HERE / "cases" / "valid" / f"{name}.skillset" for name in ("everything", "paper", "leak")),
    *(EXAMPLES / "onera" / f"{name}.rl" for name in ("gimbal", "forklift")),
]
MOST_ENDS = 200
"""Approximate number of ends that are tried in a file."""
ARM = """
    data { battery: float64 }
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }
    resource light { initial OFF  extern OFF -> ON  extern ON -> OFF }
"""


def errors(elements: str) -> list[Diagnostic]:
    diagnostics = check(f"skillset s {{ {elements} }}", "f.skillset").diagnostics
    return [item for item in diagnostics if item.severity == "error"]


def codes(elements: str) -> list[str]:
    return [item.code for item in errors(elements)]


# --- what resolved is judged


@pytest.mark.parametrize("slip", ["resource=(armm == IDLE)", "resource=(arm == IDEL)", "data=(batery > 1)"])
@pytest.mark.parametrize(
    ("part", "code"),
    [
        ("precondition {{ slip: {}  p: resource=(arm == IDLE and arm == BUSY) }}", "SW050"),
        ("precondition {{ slip: {}  p: data=(battery < 1 and battery > 2) }}", "SW050"),
        ("precondition {{ slip: {}  p: resource=(light == ON)  q: resource=(light == OFF) }}", "SW054"),
        ("precondition {{ slip: {} }} invariant {{ i: resource=(arm != IDLE and arm != BUSY) }}", "SW051"),
        ("invariant {{ slip: {}  i: resource=(light == ON)  j: resource=(light == OFF) }}", "SW053"),
        ("invariant {{ slip: {} }} effect {{ on: light -> ON }}", "SW040"),
        ("invariant {{ slip: {} }} effect {{ on: light -> ON }} interrupt {{ apply=on }}", "SW040"),
    ],
)
def test_a_misspelt_name_hides_no_other_error_of_its_skill(slip: str, part: str, code: str) -> None:
    found = codes(f"{ARM} skill k {{ {part.format(slip)} result {{ DONE }} }}")
    assert len(found) == 2 and code in found


def test_a_postcondition_of_a_damaged_skill_is_judged_after_its_effect() -> None:
    skill = """skill k {
        effect { take: arm -> BUSY  drop: arm -> IDLE }
        precondition { p: resource=(arm == IDLE) success tak }
        interrupt { apply=drop }
        result { DONE: apply=drop post resource=(arm == BUSY) }
    }"""
    assert codes(ARM + skill) == ["SW012", "SW052"]


def test_a_postcondition_behind_a_damaged_effect_is_not_judged_by_it() -> None:
    skill = """skill k {
        effect { drop { arm -> IDLE  light -> OFFF } }
        result { DONE: apply=drop post resource=(arm == BUSY) }
    }"""
    assert codes(ARM + skill) == ["SW011"]


def test_a_misspelt_name_hides_no_contradiction_in_its_own_guard() -> None:
    guard = "resource=(armm == IDLE and arm == IDLE and arm == BUSY)"
    assert codes(f"{ARM} skill k {{ precondition {{ p: {guard} }} result {{ DONE }} }}") == ["SW010", "SW050"]
    event = "event e { guard resource=(armm == IDLE and arm == IDLE and arm == BUSY) effect { light -> ON } }"
    assert codes(ARM + event) == ["SW010", "SW055"]


@pytest.mark.parametrize("sign", ["or", "=>"])
def test_an_alternative_that_may_be_meant_is_no_contradiction(sign: str) -> None:
    guard = f"resource=(armm == IDLE {sign} arm == IDLE and arm == BUSY)"
    assert codes(f"{ARM} skill k {{ precondition {{ p: {guard} }} result {{ DONE }} }}") == ["SW010"]


def test_a_misspelt_state_of_a_resource_hides_no_contradiction_of_its_skills() -> None:
    resource = "resource arm { state { IDLE BUSY } initial IDLE  IDLE -> BUZY  BUSY -> IDLE }"
    guard = "resource=(arm == IDLE and arm == BUSY)"
    skill = f"effect {{ take: arm -> BUSY }} precondition {{ p: {guard} }} result {{ DONE: apply=take }}"
    assert codes(f"{resource} skill k {{ {skill} }}") == ["SW011", "SW050"]


def test_a_damaged_event_is_judged() -> None:
    event = "event e { guard resource=(light == ON and light == OFF) effect { arm -> BUSY  light -> ONN } }"
    assert codes(ARM + event) == ["SW055", "SW044", "SW011"]


def test_a_misspelt_word_of_the_language_hides_no_contradiction() -> None:
    skill = """skill k {
        effect { take: arm -> BUSY  drop: arm -> IDLE }
        precondtion { p: resource=(arm == IDLE and arm == BUSY) success take }
        result { DONE: aply=drop }
    }"""
    assert codes(ARM + skill) == ["SW003", "SW050", "SW003"]


def test_states_that_could_not_be_read_may_be_meant() -> None:
    resource = "resource r { initial A  A -> B  B -> C -> A }"
    skill = "skill k { precondition { p: resource=(r != A and r != B) } result { DONE } }"
    assert codes(resource + skill) == ["SW002"]


def test_an_effect_that_nothing_applies_drives_no_extern_transition() -> None:
    skill = "skill {} {{ effect {{ on: light -> ON }} result {{ DONE }} }}"
    assert codes(ARM + skill.format("k")) == ["SW040"]
    behaves_like_it = "skill j { effect { on {} } result { DONE } }"
    assert codes(ARM + behaves_like_it + skill.format("k") + skill.format("l")) == ["SW040", "SW040"]


def test_a_section_given_twice_hides_nothing() -> None:
    skill = """skill k {
        input { speed: float64 }
        input { height: float64  speed: float64 }
        precondition { p: data=(speed > height) }
        precondition { q: resource=(armm == IDLE)  r: resource=(arm == IDLE and arm == BUSY) }
        result { DONE }
    }"""
    assert codes(ARM + skill) == ["SW017", "SW017", "SW010", "SW050"]


# --- one slip is one error


@pytest.mark.parametrize(
    ("resource", "help_line"),
    [
        ("initial IDEL  IDLE -> BUSY  BUSY -> IDLE", "Did you mean `initial IDLE`?"),
        ("state { IDLE BUSY } initial IDEL  IDLE -> BUSY  BUSY -> IDLE", "Did you mean `IDLE`?"),
        ("initial READY  IDLE -> BUSY  BUSY -> IDLE", "Name another state, of `IDLE` and `BUSY`,"),
    ],
)
def test_a_misspelt_initial_state_is_reported_where_it_stands(resource: str, help_line: str) -> None:
    skill = "skill k { effect { e: arm -> BUSY } precondition { p: resource=(arm == IDLE) success e } result { DONE } }"
    text = f"resource arm {{ {resource} }} {skill}"
    (error,) = errors(text)
    assert error.span.column == len("skillset s { ") + text.index(resource.partition("initial ")[2]) + 1
    assert error.help is not None and error.help.startswith(help_line)


@pytest.mark.parametrize("states", ["", "state { OFF ON }"])
def test_a_misspelt_initial_state_hides_no_effect_on_an_extern_transition(states: str) -> None:
    skill = "skill k { effect { bad: lamp -> ON } precondition { p: resource=(lamp == OFF) success bad } result { D } }"
    resource = f"resource lamp {{ {states} initial OFF  extern OFF -> ON  extern ON -> OFF }}"
    assert codes(f"{resource} {skill}") == ["SW040"]
    misspelt = resource.replace("initial OFF", "initial OF")
    assert codes(f"{misspelt} {skill}") == ["SW011" if states else "SW031", "SW040"]


@pytest.mark.parametrize(
    "resource",
    [
        "initial OF  OFF -> ON  extern OFF -> ON  extern ON -> OFF",
        "initial OFF  OFF -> ONN  extern ONN -> OFF  extern DIM -> ON",
        "initial READY  extern OFF -> ON  extern ON -> OFF",
    ],
    ids=["open to skills", "another state is misspelt", "no state is resembled"],
)
def test_an_effect_that_may_be_right_after_a_correction_is_no_error(resource: str) -> None:
    skill = "skill k { effect { on: lamp -> ON } precondition { success on } result { DONE } }"
    found = codes(f"resource lamp {{ {resource} }} {skill}")
    assert found and set(found) == {"SW031"}


@pytest.mark.parametrize("transitions", ["IDLE -> BUZY  BUSY -> IDLE", "IDLE -> BUSY  BUZY -> IDLE"])
def test_a_misspelt_state_of_a_transition_is_one_error(transitions: str) -> None:
    skill = """skill k {
        effect { take: arm -> BUSY  drop: arm -> IDLE }
        precondition { free: resource=(arm == IDLE) success take }
        invariant { busy: resource=(arm == BUSY) violation=drop }
        result { DONE: apply=drop }
    }"""
    assert codes(f"resource arm {{ initial IDLE  {transitions} }} {skill}") == ["SW031"]


@pytest.mark.parametrize("field", ["float64 in 5.0..1.0 = 2.0", "uint8 in 9..0 = 3", "string in 0..1 = 0.5"])
def test_a_wrong_range_is_one_error(field: str) -> None:
    guard = "data=(v > 1)" if "string" not in field else "data=(true)"
    skill = f"skill k {{ input {{ v: {field} }} precondition {{ p: {guard} }} result {{ DONE }} }}"
    assert codes(skill) == ["SW022"]


def test_a_range_is_judged_as_it_is_meant() -> None:
    skill = "skill k { input { v: float64 in 5.0..1.0 = 9.0 } precondition { p: data=(v > 7) } result { DONE } }"
    assert codes(skill) == ["SW022", "SW023", "SW050"]


@pytest.mark.parametrize("path", SHORT_FILES, ids=lambda path: path.stem)
def test_an_unexpected_end_of_a_file_is_one_error(path: Path) -> None:
    """Ends follow each word of a short file, and every second word of a longer one."""
    text = path.read_text(encoding="utf-8")
    words = [word for word in lex(text, path.name) if word.kind != "COMMENT"]
    skillset = next(at for at, word in enumerate(words) if word.kind == "SKILLSET")
    unclosed, some = 0, max(1, len(words) // MOST_ENDS)
    for number, word in enumerate(words[skillset:-1]):
        unclosed += {"OPEN": 1, "CLOSE": -1}.get(word.kind, 0)
        if number % some:
            continue
        if word.kind == "CLOSE" and unclosed == 1:
            continue  # Only the last bracket is missing: names are judged as in the whole file.
        found = [item for item in check(text[: word.end], path.name).diagnostics if item.severity == "error"]
        assert len(found) == 1, (text[: word.end][-40:], found)


def test_what_stands_before_an_unexpected_end_is_judged() -> None:
    text = f"skillset s {{ {ARM} skill k {{ precondition {{ p: resource=(arm == IDEL)  q: resource=(arm"
    found = [(item.code, item.help) for item in check(text, "f.skillset").diagnostics if item.severity == "error"]
    assert [code for code, _ in found] == ["SW011", "SW001"]
    assert found[0][1] == "Did you mean `IDLE`?"


def test_a_comment_without_an_end_is_one_error() -> None:
    skill = "skill k { precondition { p: resource=(armm == IDLE) /* why } result { DONE } }"
    assert [item.code for item in check(f"skillset s {{ {ARM} {skill} }}", "f.skillset").diagnostics] == ["SW004"]
