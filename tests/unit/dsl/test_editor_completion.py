"""Completions at the cursor, which each text marks with `|`."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from editor_files import FILES, RL_FILES, document, marked

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.editor.completion import completions
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.glossary import glossary_of
from skillwing.dsl.model import OwnerPolicy
from skillwing.dsl.reading.dialect import dialect_of

ARM = """\
skillset arm {
    enum Grip { SOFT FIRM }
    type Pose { x: float64  grip: Grip }
    data { pose: Pose  armed: bool }
    resource hand { initial OPEN  OPEN -> HOLDING  HOLDING -> OPEN }
    resource power { initial OFF  extern OFF -> ON  extern ON -> OFF }
    skill grasp {
        input { force: float64  grip: Grip }
        effect { take: hand -> HOLDING  drop: hand -> OPEN }
        %s
    }
}
"""


def offered(body: str) -> list[str]:
    return texts(*marked(ARM % body))


def texts(found: Document, offset: int) -> list[str]:
    return [completion.text for completion in completions(found, offset)]


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("result { DONE: apply=| }", ["take", "drop"]),
        ("result { DONE: apply=dr| }", ["take", "drop"]),
        ("result { DONE: apply=|", ["take", "drop"]),
        ("precondition { success | }", ["take", "drop"]),
        ("invariant { i: resource=(hand == OPEN) violation=| }", ["take", "drop"]),
        ("interrupt { apply=| timeout=2.0 }", ["take", "drop"]),
        ("precondition { p: resource=(hand == |) }", ["OPEN", "HOLDING", "false", "true"]),
        ("precondition { p: resource=(hand != |", ["OPEN", "HOLDING", "false", "true"]),
        ("precondition { p: resource=(|) }", ["hand", "power", "false", "not", "true"]),
        ("precondition { p: resource=(hand == OPEN and |) }", ["hand", "power", "false", "not", "true"]),
        ("precondition { p: resource=(hand == OPEN |) }", ["and", "or"]),
        ("precondition { p: data=(|) }", ["force", "grip", "pose", "armed", "false", "not", "true"]),
        ("precondition { p: data=(pose.|) }", ["x", "grip"]),
        ("precondition { p: data=(pose.x > |) }", ["force", "grip", "pose", "armed", "false", "true"]),
        (
            "precondition { p: data=(grip == |) }",
            ["force", "grip", "pose", "armed", "SOFT", "FIRM", "false", "true"],
        ),
        ("output { grip: Grip = | }", ["SOFT", "FIRM", "false", "true"]),
        ("precondition { | }", ["failure", "success"]),
        ("interrupt { | }", ["apply", "timeout"]),
        ("owner_lost=|", ["interrupt", "continue"]),
        ("// a comment |", []),
        ("/* a comment | */", []),
        ("/* a comment |", []),
        ('output { s: string = "|" }', []),
    ],
)
def test_what_fits_is_offered(body: str, expected: list[str]) -> None:
    assert offered(body) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("|", ["skillset"]),
        ("skillset s { | }", ["data", "enum", "event", "resource", "skill", "type"]),
        ("skillset s { resource r { | } }", ["extern", "initial", "state"]),
        ("skillset s { resource r { initial A  A -> | B -> A } }", ["A", "B"]),
        ("skillset s { resource r { initial A  A -> B } skill k { effect { e: | } } }", ["r"]),
        ("skillset s { resource r { initial A  A -> B } skill k { effect { e { r -> A | } } } }", ["r"]),
        ("skillset s { resource r { initial A  A -> B } skill k { effect { e: r -> |", ["A", "B"]),
        ("skillset s { resource r { initial A  A -> B } event e { effect { r -> | } } }", ["A", "B"]),
        ("skillset s { type | }", []),
        ("skillset s { resource r { state { A | } } }", []),
    ],
)
def test_what_fits_is_offered_anywhere_in_a_file(text: str, expected: list[str]) -> None:
    assert texts(*marked(text)) == expected


@pytest.mark.parametrize("mistake", ["skill k { ( }", "skill k { effect { e: } }", "resource r { A -> -> }", "; !"])
def test_a_mistake_does_not_hide_what_the_grammar_allows_behind_it(mistake: str) -> None:
    found = completions(*marked(f"skillset s {{ {mistake} data {{ d: float64 | }} }}"))
    assert [completion.text for completion in found if completion.kind == "keyword"] == ["in", "period"]


def test_types_are_declared_ones_and_built_in_ones() -> None:
    found = texts(*marked("skillset s { type Point { x: float64 } enum Mode { A } data { d: | } }"))
    assert found == ["Point", "Mode", *glossary_of("s.skillset").types]


def test_the_sections_of_a_skill_are_offered() -> None:
    found = offered("|")
    assert {"input", "output", "effect", "precondition", "invariant", "result", "interrupt", "lost"} <= set(found)
    assert "resource" not in found


def test_the_word_at_the_cursor_is_replaced() -> None:
    found, offset = marked(ARM % "result { DONE: apply=dr|op }")
    replaced = {found.text[completion.start : completion.end] for completion in completions(found, offset)}
    assert replaced == {"drop"}


def test_rl_files_have_their_own_words() -> None:
    text = "skillset s { resource r { state { A B } initial A transition all } skill k { start r -> | } }"
    assert texts(*marked(text, "s.rl")) == ["A", "B"]
    assert texts(*marked("skillset s { resource r { | } }", "s.rl")) == ["initial", "state", "transition"]


@pytest.mark.parametrize("file", ["s.skillset", "s.rl"])
def test_every_word_of_the_language_is_explained(file: str) -> None:
    dialect = dialect_of(file)
    kinds = {kind for row in dialect.tables.actions for kind in row if kind.isupper()}
    words = {kind.lower() for kind in kinds if dialect.vocabulary.is_word(kind)}
    assert glossary_of(file).keywords.keys() == words


def test_every_built_in_type_is_explained() -> None:
    assert glossary_of("s.skillset").types.keys() == SCALARS.keys()


def test_every_choice_is_explained() -> None:
    assert [*glossary_of("s.skillset").choices["owner_lost"]] == [*get_args(OwnerPolicy)]


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_every_name_in_use_is_offered_where_it_stands(path: Path) -> None:
    """Put the cursor on names of valid files: what is written there is among what is offered."""
    found = document(path)
    used = [place for place in found.names.occurrences if not place.declares]
    for place in used[:: max(1, len(used) // 12)]:
        assert place.name in texts(found, place.end), found.text[place.start - 30 : place.end]
