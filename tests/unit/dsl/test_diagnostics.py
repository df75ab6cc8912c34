from __future__ import annotations

import re

import pytest

from skillwing.dsl import SkillsetError, parse
from skillwing.dsl.checking.checker import check
from skillwing.dsl.diagnostics.diagnostic import render

SOURCE = """\
skillset s {
    resource axes { initial FREE  FREE -> USED  USED -> FREE }
    skill k {
        effect { take: axis -> USED }
        precondition { success take }
        result { DONE: apply=take }
    }
}
"""


def test_a_diagnostic_shows_place_excerpt_and_help() -> None:
    (diagnostic,) = check(SOURCE, "robot.skillset").diagnostics
    assert render(diagnostic, SOURCE) == (
        "error[SW010]: There is no resource `axis`.\n"
        "  --> robot.skillset:4:24\n"
        "   |\n"
        " 4 |         effect { take: axis -> USED }\n"
        "   |                        ^^^^\n"
        "help: Did you mean `axes`?"
    )


def test_tabs_do_not_shift_the_caret() -> None:
    source = SOURCE.replace("        effect", "\t\teffect")
    (diagnostic,) = check(source, "f").diagnostics
    *_, line, marks, _ = render(diagnostic, source).split("\n")
    assert line.index("axis") == marks.index("^")


def test_a_duplicate_shows_the_first_one() -> None:
    source = "skillset s {\n  skill k { result { DONE } }\n  skill k { result { DONE } }\n}\n"
    (diagnostic,) = check(source, "f").diagnostics
    assert "note: first declared here (f:2:9)" in render(diagnostic, source)


def test_the_error_lists_everything_and_counts() -> None:
    source = SOURCE.replace("apply=take", "apply=tak")
    with pytest.raises(SkillsetError) as caught:
        parse(source, "f")
    assert [diagnostic.code for diagnostic in caught.value.diagnostics] == ["SW010", "SW012"]
    assert re.findall(r"^error\[(\w+)\]", str(caught.value), re.MULTILINE) == ["SW010", "SW012"]
    assert str(caught.value).endswith("2 errors")


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        (
            "skillset s {\n  skill k {\n    result { DONE }\n",
            "Missing `} }` of skill `k`, opened at line 2, and of skillset `s`, opened at line 1.",
        ),
        ("skillset s { skill k { input { x: bool }  result { DONE }", "Missing `} }` of skill `k`, opened at line 1"),
        ("skillset s { skill k { reslut { DONE } } }", "`reslut` is no word of the language."),
        ("skillset s { resource r { initial A  exten A -> B } }", "`exten` is no word of the language."),
        ("skillset s { resource r { initial A  A => B } }", "`=>` stands where `->` belongs."),
        ("skillset s { resource { initial A } }", "This resource has no name."),
        ("skillset s { skill k { deadline 3 } }", "Missing `=` before `3`."),
        ('skillset s { type T { a: string = "x } }', "This string is never closed."),
        ("skillset s { skill k { 17 } }", "`17` has no place here in skill `k`."),
        ("resource r { initial A }", "`resource` stands outside a skillset."),
    ],
)
def test_syntax_errors_are_named_in_words(source: str, sentence: str) -> None:
    messages = [diagnostic.message for diagnostic in check(source, "f").diagnostics]
    assert any(sentence in message for message in messages), messages


def test_an_error_in_one_skill_leaves_the_next_to_be_checked() -> None:
    source = """\
    skillset s {
        skill a { result { ?? = ) } }
        skill b { deadline=0  result { DONE } }
        skill c { input { x: flaot64 }  result { DONE } }
    }"""
    codes = [diagnostic.code for diagnostic in check(source, "f").diagnostics]
    assert codes[-2:] == ["SW025", "SW013"]


def test_a_name_is_not_called_unknown_when_its_declaration_was_unreadable() -> None:
    source = """\
    skillset s {
        resource ??? r = { initial A  A -> B }
        skill a { precondition { p: resource=(r == A) }  result { DONE } }
    }"""
    codes = {diagnostic.code for diagnostic in check(source, "f").diagnostics}
    assert "SW010" not in codes
    assert codes & {"SW002", "SW004", "SW005"}


def test_the_help_shows_how_to_declare_what_there_is_none_of() -> None:
    source = """\
    skillset s {
        skill k {
            precondition { a: resource=(wheels == PARKED)  b: data=(tilt > 1) }
            result { DONE: apply=release }
        }
    }"""
    assert [diagnostic.help for diagnostic in check(source, "f").diagnostics] == [
        "Declare it: `resource wheels { initial A  A -> B  B -> A }`.",
        "Declare it: `data { tilt: float64 period=1.0 }` in the skillset, or `input { tilt: float64 }` in the skill.",
        "Declare it: `effect { release: RESOURCE -> STATE }` in this skill.",
    ]


def test_what_belongs_to_something_is_missed_there() -> None:
    source = "skillset s { resource r { initial A  extern A -> B } skill k { precondition { p: resource=(r == C) } } }"
    assert check(source, "f").diagnostics[0].message == "`r` has no state `C`."
