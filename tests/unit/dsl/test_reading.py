"""Lexemes cover any text, and the most common mistakes have messages of their own."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.dsl.checking.checker import check
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.lexemes import COMMENT
from skillwing.dsl.reading.parser import parse_file
from skillwing.dsl.reading.recovery.layout import unclosed_by_layout

GRIPPER = """skillset gripper {
    data { battery: float64 [%] period=1.0  mode: string }
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }

    skill grasp {
        effect { take: arm -> BUSY  drop: arm -> IDLE }
        precondition {
            idle:    resource=(arm == IDLE)
            charged: data=(battery > 10.0)
            success take
        }
        invariant { charged: data=(battery > 5.0) violation=drop }
        interrupt { apply=drop timeout=2.0 }
        result { HELD: apply=drop }
    }
}
"""

PIECES = st.lists(
    st.sampled_from(
        [*"{}()[]:=.,;*/\\\"<>!&|#'-+\n\r\t \0\ufeff", "->", "==", "//", "/*", "*/", "skill", "name", "1.5"]
    )
    | st.characters(),
    max_size=60,
).map("".join)


# --- lexemes


@pytest.mark.parametrize("file", ["a.skillset", "a.rl"])
@settings(deadline=None)
@given(text=PIECES)
def test_every_character_is_in_a_lexeme_or_is_white_space(file: str, text: str) -> None:
    at = 1 if text.startswith("\ufeff") else 0
    for lexeme in lex(text, file):
        assert not text[at : lexeme.start].strip()
        assert lexeme.text == text[lexeme.start : lexeme.end] != ""
        assert lexeme.kind
        at = lexeme.end
    assert not text[at:].strip()


@settings(deadline=None)
@given(text=PIECES)
def test_the_span_of_a_lexeme_encloses_it(text: str) -> None:
    lines = text.split("\n")
    for lexeme in lex(text, "a.skillset"):
        span = lexeme.span
        ends = "\n".join(lines[span.line - 1 : span.end_line])
        behind = len(lines[span.end_line - 1]) - (span.end_column - 1)
        assert ends[span.column - 1 : len(ends) - behind] == lexeme.text


def test_comments_are_lexemes() -> None:
    found = lex("a // to the end\r\nb /* over\nlines */ c", "a.skillset")
    assert [lexeme.text for lexeme in found if lexeme.kind == COMMENT] == ["// to the end", "/* over\nlines */"]


# --- differences without a meaning


@pytest.mark.parametrize(
    "text",
    [GRIPPER.replace("\n", "\r\n"), "\ufeff" + GRIPPER, GRIPPER.replace("    ", "\t"), GRIPPER.replace("\n", " ")],
    ids=["Windows line ends", "byte order mark", "tabs", "one line"],
)
def test_layout_and_line_ends_mean_nothing(text: str) -> None:
    checked = check(text, "f.skillset")
    assert checked.diagnostics == check(GRIPPER, "f.skillset").diagnostics == ()
    assert checked.skillset == check(GRIPPER, "f.skillset").skillset is not None


# --- slips


def test_a_name_in_other_letters_is_one_mistake_each_time_it_is_written() -> None:
    text = "skillset s { resource r { initial Ж  Ж -> Ф  Ф -> Ж } skill 飞 { effect { go: r -> Ф } } }"
    problems = check(text, "letters.skillset").diagnostics
    written = [problem for problem in problems if problem.code == "SW004"]
    assert len(written) == 7
    assert written[0].message == "A name cannot hold the character `Ж`."
    assert written[0].help == "Write it of letters from a to z, digits and `_`."
    assert not [problem for problem in problems if problem.code != "SW004" and problem.severity == "error"]


@pytest.mark.parametrize("behind", ["", "    skill c {\n        result { DONE }\n    }\n"])
def test_a_section_that_stands_too_far_left_still_belongs_to_the_skill_left_open(behind: str) -> None:
    text = f"skillset s {{\n    skill b {{\n        result {{ success A }}\n    interrupt {{}}\n{behind}}}\n"
    (problem,) = parse_file(text, "left.skillset").diagnostics
    assert problem.message == "Missing `}` of skill `b`, opened at line 2."
    assert (problem.span.line, problem.span.column) == (4, 17)


@pytest.mark.parametrize("file", ["a.skillset", "a.rl"])
@pytest.mark.parametrize(
    ("number", "is_number"),
    [
        ("-1e300", True),
        ("1.7976931348623157e308", True),
        ("1e-999", True),
        ("100000000000000000000000", True),
        ("0" * 5000 + "7", True),
        ("1.8e308", False),
        ("-1e+309", False),
        ("9" * 400, False),
    ],
)
def test_a_number_is_too_large_only_if_no_float_holds_it(file: str, number: str, is_number: bool) -> None:
    (lexeme,) = lex(number, file)
    assert lexeme.kind == ("NUMBER" if is_number else "OVERSIZED_NUMBER")


def test_bounds_are_read_as_large_as_they_are_written() -> None:
    bounds = f"-1e300..{'0' * 5000}100000000000000000000000"
    outcome = check(f"skillset s {{ skill k {{ input {{ x: float64 in {bounds} }} }} }}", "bounds.skillset")
    assert outcome.skillset is not None
    field = outcome.skillset.skill("k").inputs[0]
    assert (field.low, field.high) == (-1e300, 1e23)


@pytest.mark.parametrize(
    "element",
    [
        "resource r { state { initial B } initial B }",
        "resource r { state { A extern state } initial state  extern initial -> state  A -> lost  lost -> A }",
        "enum e { skill resource data }",
        "resource r { initial A  A -> data  data -> A } skill k { effect { go: r -> data  back: r -> A } }",
        "resource r { initial A  A -> post } skill k { result { success success: apply=post post resource=(r == A) } }",
        "skill skill { effect { effect: state -> initial  go { state -> initial  r -> X } } }",
    ],
)
def test_a_word_of_the_language_is_a_name_where_it_cannot_stand_itself(element: str) -> None:
    outcome = parse_file(f"skillset s {{ {element} }}", "words.skillset")
    assert outcome.root is not None
    assert outcome.diagnostics == ()


@pytest.mark.parametrize(
    "element", ["resource r { initial A  initial -> A }", "skill k { precondition { success: resource=(r == A) } }"]
)
def test_a_word_of_the_language_is_no_name_where_it_can_stand_itself(element: str) -> None:
    assert parse_file(f"skillset s {{ {element} }}", "words.skillset").diagnostics


def test_a_state_list_left_open_still_ends_before_the_initial_state() -> None:
    text = "skillset s {\n resource r {\n state { A B\n initial A  A -> B }\n skill k {} }"
    (problem,) = parse_file(text, "open.skillset").diagnostics
    assert problem.message == "Missing `}` of `state`, opened at line 3."


@pytest.mark.parametrize(
    ("written", "instead", "message", "advice"),
    [
        ("(arm == IDLE)", "(arm == IDLE && true)", "The language does not write `&&`.", "Write `and`."),
        ("(arm == IDLE)", "(arm == IDLE || false)", "The language does not write `||`.", "Write `or`."),
        ("(arm == IDLE)", "(!(arm == BUSY))", "The language does not write `!`.", "Write `not`."),
        ("(arm == IDLE)", "(arm = IDLE)", "`=` stands where `==` belongs.", "Write `==`."),
        ("(arm == IDLE)", "(arm := IDLE)", "The language does not write `:=`.", "Write `==`."),
        ("timeout=2.0", "timeout := 2.0", "The language does not write `:=`.", "Write `=`."),
        ("battery > 10.0", "mode == 'it''s'", "The language does not write `'it'`.", 'Write `"it"`.'),
        ("success take", "success take  # now", "Comments do not begin with `#`.", "Write `//`."),
        ("IDLE -> BUSY ", "IDLE -> BUSY;", "The language has no character `;`.", "Elements need no separator between"),
        ("skill grasp", "skill gr\0asp", "A name cannot hold the character `U+0000`.", "like `gr_asp`."),
        ("skill grasp", "skill pick-up", "A name cannot hold the character `-`.", "like `pick_up`."),
        ("skill grasp", "skill grâce", "A name cannot hold the character `â`.", "like `grace`."),
        ("timeout=2.0", "timeout=2.", "A number has digits on both sides of its point.", "Write `2.0`."),
        ("timeout=2.0", "timeout=-.5", "A number has digits on both sides of its point.", "Write `-0.5`."),
        ("violation=", "voilation=", "`voilation` is no word of the language.", "Did you mean `violation`?"),
        ("HELD: apply", "HELD: aply", "`aply` is no word of the language.", "Did you mean `apply`?"),
        ("timeout=", "tmeout=", "`tmeout` is no word of the language.", "Did you mean `timeout`?"),
        ("skill grasp", "skill", "This skill has no name.", "Write `skill NAME { ... }`."),
        ("take: arm", "arm", "A name is missing before `arm`.", "Write `NAME: arm ...`."),
        ("take: arm -> BUSY", "{ arm -> BUSY }", "A name is missing before `{`.", "Write `NAME { ... }`."),
        ("idle:    resource", "resource", "A name is missing before `resource`.", "Write `NAME: resource ...`."),
        ("arm -> IDLE }", "arm -> IDLE  lost { } }", "`lost` does not belong into `effect`.", "that closes `effect`."),
        (
            "    skill grasp",
            "    result { A }\n    skill grasp",
            "`result` has no place here in skillset `gripper`.",
            "skill",
        ),
        ("    }\n}\n", "}\n", "Missing `}` of skill `grasp`, opened at line 5.", "Add `}` here, before `}`."),
        ("violation=drop }", "violation=drop", "Missing `}` of `invariant`, opened at line 12.", "before `interrupt`."),
        ("IDLE)", "IDLE", "Missing `)` of `resource=(`, opened at line 8.", "Add `)` here, before `charged`."),
        (
            "}\n}\n",
            "}\n}\nskill s { result { A } }",
            "`skill` stands behind the end of the skillset.",
            "at line 16 ends",
        ),
    ],
)
def test_a_typing_error_is_named_with_a_remedy(written: str, instead: str, message: str, advice: str) -> None:
    assert written in GRIPPER
    found = check(GRIPPER.replace(written, instead, 1), "f.skillset").diagnostics
    assert message in [item.message for item in found]
    assert any(advice in (item.help or "") for item in found if item.message == message)


@pytest.mark.parametrize("text", ["", "   \n", "// nothing but a comment\n", "\ufeff"])
def test_a_file_without_a_word_is_empty(text: str) -> None:
    assert [item.message for item in check(text, "f.skillset").diagnostics] == ["The file is empty."]


@pytest.mark.parametrize(
    "text",
    [
        "{" * 100_000,
        "skillset s {" + "{" * 100_000,
        "skillset s { skill k { precondition { p: data=(" + "(" * 50_000,
        "skillset s { skill k {" * 10_000,
        '"' * 100_001,
        "/*" * 50_000,
        "a b " * 50_000,
        "&" * 50_000,
        "\n" * 100_000,
        "\0" * 50_000,
    ],
    ids=lambda text: f"{text[:12]!r}...",
)
def test_absurd_files_get_few_diagnostics(text: str) -> None:
    checked = check(text, "f.skillset")
    assert checked.skillset is None
    assert 1 <= len(checked.diagnostics) <= 120


# --- layout


@settings(deadline=None)
@given(st.data())
def test_the_layout_tells_which_of_the_brackets_is_missing(data: st.DataObject) -> None:
    """Indentation of blocks shows which block has lost its closing bracket."""
    lines = [
        line.replace(" }", "\n        }") if line.startswith("        ") and line.endswith(" }") else line
        for line in GRIPPER.split("\n")
    ]
    lexemes = lex("\n".join(lines), "f.skillset")
    closing = [
        index
        for index, lexeme in enumerate(lexemes)
        if lexeme.kind == "CLOSE" and lexeme.span.line != lexemes[index - 1].span.line
    ]
    missing = data.draw(st.sampled_from(closing))
    opened: list[int] = []
    for index, lexeme in enumerate(lexemes[:missing]):
        if lexeme.kind == "OPEN":
            opened.append(index)
        elif lexeme.kind == "CLOSE":
            opened.pop()
    left = [lexeme for index, lexeme in enumerate(lexemes) if index != missing]
    found = unclosed_by_layout(left)
    if missing == len(lexemes) - 1:
        assert [item.opening for item in found] == [opened[-1]]
    else:
        assert [(item.opening, item.closing) for item in found] == [(opened[-1], missing)]
