"""Renaming keeps the meaning of a file, or is refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from editor_files import FILES, RL_FILES, document
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.rename import Edit, RenameRefusedError, applied, rename

DOCUMENTS = [document(path) for path in (*FILES, *RL_FILES)]
SOME = 4
"""Approximate number of names that are changed in a file: each needs a check of the whole file."""
NAMES = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,6}", fullmatch=True)

BOAT = """\
skillset boat {
    enum Mode { SLOW FAST }
    data { wind: float64  mode: Mode }
    resource sail { initial DOWN  DOWN -> UP  UP -> DOWN }
    skill tack {
        input { angle: float64 }
        effect { hoist: sail -> UP  strike: sail -> DOWN }
        precondition { calm: data=(wind < angle and mode == SLOW)  success hoist }
        result { DONE: apply=strike }
    }
}
"""


@settings(max_examples=15, deadline=None)
@given(data=st.data())
def test_renaming_back_gives_the_same_text_and_the_same_model(data: st.DataObject) -> None:
    before = data.draw(st.sampled_from(DOCUMENTS))
    place = data.draw(st.sampled_from(before.names.occurrences))
    other = data.draw(NAMES)
    assert place.symbol is not None
    try:
        edits = rename(before, place.start, other)
    except RenameRefusedError:
        return
    after = Document(applied(before.text, edits), before.file)
    moved = place.start + sum(len(edit.text) - (edit.end - edit.start) for edit in edits if edit.end <= place.start)
    back = Document(applied(after.text, rename(after, moved, place.name)), before.file)
    assert back.text == before.text
    assert (after.checked.skillset is None) == (before.checked.skillset is None)
    if before.checked.skillset is not None and back.checked.skillset is not None:
        assert back.checked.skillset == before.checked.skillset
        assert back.checked.skillset.schema_hash == before.checked.skillset.schema_hash


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_names_all_over_a_file_can_be_changed(path: Path) -> None:
    before = document(path)
    symbols = list(before.names.declarations)
    for symbol in symbols[:: max(7, len(symbols) // SOME)]:
        declared = before.names.declarations[symbol].place
        assert declared is not None
        edits = rename(before, declared.start, "Quite_another")
        assert [(edit.start, edit.end) for edit in edits] == [
            (place.start, place.end) for place in before.names.of(symbol)
        ]


def test_all_occurrences_change() -> None:
    text = applied(BOAT, rename(Document(BOAT, "boat.skillset"), BOAT.index("sail {"), "jib"))
    assert text == BOAT.replace("sail", "jib")


def test_the_same_name_changes_nothing() -> None:
    assert rename(Document(BOAT, "boat.skillset"), BOAT.index("sail {"), "sail") == ()


@pytest.mark.parametrize(
    ("where", "name", "reason"),
    [
        ("sail {", "2nd", "`2nd` is not a name. Use letters, digits and underscores, and do not start with a digit."),
        ("sail {", "", "`` is not a name. Use letters, digits and underscores, and do not start with a digit."),
        ("hoist:", "class", "No effect can be called `class`. Choose another name."),
        ("hoist:", "strike", "The effect `strike` of `tack` exists already. Choose another name."),
        ("UP  UP", "DOWN", "The state `DOWN` of `sail` exists already. Choose another name."),
        ("Mode {", "float64", "`float64` is a built-in type. Choose another name."),
        # An input hides a datum of the same name, and a datum hides a value of an enum.
        ("angle:", "wind", "`wind` would be read as something else in line 8. Choose another name."),
        ("wind:", "angle", "`angle` would be read as something else in line 8. Choose another name."),
        ("SLOW FAST", "wind", "`wind` would be read as something else in line 8. Choose another name."),
        ("mode:", "period", "`period` would be read as something else in line 4. Choose another name."),
        ("resource", "x", "There is no name here that can be changed."),
    ],
)
def test_a_name_that_does_not_fit_is_refused(where: str, name: str, reason: str) -> None:
    with pytest.raises(RenameRefusedError) as refusal:
        rename(Document(BOAT, "boat.skillset"), BOAT.index(where), name)
    assert str(refusal.value) == reason


def test_names_that_collide_in_generated_code_are_refused() -> None:
    text = BOAT.replace("skill tack", "skill gybe { result { DONE } }\n    skill tack")
    with pytest.raises(RenameRefusedError, match="would both become the class"):
        rename(Document(text, "boat.skillset"), text.index("gybe"), "Tack")


def test_an_undeclared_name_is_not_renamed() -> None:
    text = BOAT.replace("sail -> UP", "mast -> UP")
    with pytest.raises(RenameRefusedError, match="`mast` is not declared"):
        rename(Document(text, "boat.skillset"), text.index("mast"), "jib")


def test_a_name_in_words_that_cannot_be_read_is_not_left_behind() -> None:
    text = BOAT.replace("    skill tack", "    skill broken { ; precondition hoist sail }\n    skill tack")
    with pytest.raises(RenameRefusedError, match="`sail` also stands in line 5, which cannot be read"):
        rename(Document(text, "boat.skillset"), text.index("sail {"), "jib")


def test_an_error_elsewhere_does_not_forbid_renaming() -> None:
    text = BOAT.replace("apply=strike", "apply=striek")
    assert Edit(text.index("wind:"), text.index("wind:") + 4, "gust") in rename(
        Document(text, "boat.skillset"), text.index("wind:"), "gust"
    )
