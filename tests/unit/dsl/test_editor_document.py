"""Positions in three ways of counting, outline, folds, colours and fixes."""

from __future__ import annotations

from pathlib import Path

import pytest
from editor_files import FILES, RL_FILES, document
from hypothesis import given
from hypothesis import strategies as st

from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.fixes import fixes
from skillwing.dsl.editor.outline import OutlineEntry, folds, outline
from skillwing.dsl.editor.positions import Encoding, Lines
from skillwing.dsl.editor.rename import applied
from skillwing.dsl.editor.tokens import tokens
from skillwing.dsl.reading.lexemes import Source

TEXTS = st.text(alphabet=st.sampled_from("aé𝄞\n\r\u2028\t "), max_size=30)

# --- positions


@given(text=TEXTS, encoding=st.sampled_from(["utf-8", "utf-16", "utf-32"]), data=st.data())
def test_an_offset_survives_the_way_to_the_protocol_and_back(
    text: str, encoding: Encoding, data: st.DataObject
) -> None:
    offset = data.draw(st.integers(0, len(text)))
    lines = Lines(text)
    line, character = lines.to_protocol(offset, encoding)
    inside_line_end = text[max(0, offset - 1) : offset + 1] == "\r\n"
    assert lines.from_protocol(line, character, encoding) == offset - inside_line_end


@given(text=TEXTS, data=st.data())
def test_an_offset_survives_the_way_to_the_language_and_back(text: str, data: st.DataObject) -> None:
    offset = data.draw(st.integers(0, len(text)))
    line, column = Source(text, "s.skillset").position(offset)
    assert Lines(text).offset(line, column) == offset
    assert Lines(text).line(offset) == line


@pytest.mark.parametrize(("encoding", "character"), [("utf-8", 4), ("utf-16", 2), ("utf-32", 1)])
def test_a_character_outside_the_basic_plane_counts_as_its_encoding_says(encoding: Encoding, character: int) -> None:
    lines = Lines("𝄞x\r\ny")
    assert lines.to_protocol(1, encoding) == (0, character)
    assert lines.from_protocol(0, character, encoding) == 1
    assert lines.to_protocol(4, encoding) == (1, 0)


def test_places_outside_the_text_are_moved_into_it() -> None:
    lines = Lines("ab\nc")
    assert lines.from_protocol(0, 99) == 2
    assert lines.from_protocol(99, 0) == 4
    assert lines.offset(99, 99) == 4
    assert lines.offset(0, 0) == 0


# --- outline and folds

ROVER = """\
skillset rover {
    // The wheels
    // of the rover.
    resource wheels {
        initial FREE
        FREE -> BUSY
    }
    data { speed: float64 }
    skill drive {
        input { far: float64 }
        effect { take: wheels -> BUSY }
        result { DONE }
    }
}
"""


def listed(entries: tuple[OutlineEntry, ...]) -> list[object]:
    return [
        [f"{entry.kind} {entry.name}", *listed(entry.children)] if entry.children else f"{entry.kind} {entry.name}"
        for entry in entries
    ]


def test_the_outline_has_the_elements_with_what_belongs_to_them() -> None:
    assert listed(outline(Document(ROVER, "rover.skillset"))) == [
        [
            "skillset rover",
            ["resource wheels", "state FREE", "state BUSY"],
            "datum speed",
            ["skill drive", "input far", "effect take", "result DONE"],
        ]
    ]


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_each_entry_holds_its_name_and_its_children(path: Path) -> None:
    found = document(path)

    def holds(entry: OutlineEntry) -> None:
        assert entry.start <= entry.name_start < entry.name_end <= entry.end
        assert found.text[entry.name_start : entry.name_end] == entry.name
        for child in entry.children:
            assert entry.start <= child.start and child.end <= entry.end, (entry.name, child.name)
            holds(child)

    entries = outline(found)
    assert "skillset" in [entry.kind for entry in entries]
    for entry in entries:
        holds(entry)


def test_an_unclosed_skillset_still_has_an_outline() -> None:
    text = ROVER.rstrip().removesuffix("}")
    assert listed(outline(Document(text, "rover.skillset"))) == listed(outline(Document(ROVER, "rover.skillset")))


def test_blocks_and_comments_of_several_lines_fold() -> None:
    found = [(fold.first_line, fold.last_line, fold.kind) for fold in folds(Document(ROVER, "rover.skillset"))]
    assert found == [(0, 12, "block"), (1, 2, "comment"), (3, 5, "block"), (8, 11, "block")]


# --- colours


def test_each_name_has_the_colour_of_its_kind() -> None:
    found = Document(ROVER, "rover.skillset")
    line = ROVER.index("effect { take")
    coloured = [
        (found.text[token.start : token.end], token.kind, token.declares)
        for token in tokens(found)
        if line <= token.start < ROVER.index("\n", line)
    ]
    assert coloured == [("take", "effect", True), ("wheels", "resource", False), ("BUSY", "state", False)]


# --- fixes

MISSPELT = """\
skillset s {
    enum Mode { SLOW FAST }
    type Point { x: float64  mode: Mode = %(value)s }
    data { at: %(type)s }
    resource arm { initial IDLE  IDLE -> BUSY  BUSY -> IDLE }
    skill k {
        effect { take: %(resource)s -> %(state)s  drop: arm -> IDLE }
        %(keyword)s { near: data=(at.%(field)s > 1.0)  success take }
        result { %(mark)s DONE: apply=%(effect)s }
    }
}
"""
RIGHT = {
    "value": "SLOW",
    "type": "Point",
    "resource": "arm",
    "state": "BUSY",
    "keyword": "precondition",
    "field": "x",
    "mark": "success",
    "effect": "drop",
}


@pytest.mark.parametrize(
    ("what", "wrong"),
    [
        ("value", "SLO"),
        ("type", "Pont"),
        ("resource", "arms"),
        ("state", "busy"),
        ("keyword", "precondtion"),
        ("field", "xx"),
        ("mark", "sucess"),
        ("effect", "dropp"),
    ],
)
def test_a_misspelt_word_is_corrected(what: str, wrong: str) -> None:
    right = MISSPELT % RIGHT
    assert Document(right, "s.skillset").checked.skillset is not None
    text = MISSPELT % {**RIGHT, what: wrong}
    (fix,) = fixes(Document(text, "s.skillset"), 0, len(text))
    assert fix.title == f"Change to `{RIGHT[what]}`"
    assert applied(text, (fix.edit,)) == right


def test_only_problems_at_the_place_get_a_fix() -> None:
    text = MISSPELT % {**RIGHT, "type": "Pont", "effect": "dropp"}
    at = text.index("dropp")
    assert [fix.edit.text for fix in fixes(Document(text, "s.skillset"), at, at)] == ["drop"]


def test_only_typing_errors_have_a_fix() -> None:
    for text in ("skillset s { skill k { result { DONE: apply=quite_different } } }", "skillset s { ; }", ""):
        assert fixes(Document(text, "s.skillset"), 0, len(text)) == ()
