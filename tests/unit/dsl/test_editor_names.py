"""The index of names: what declares them and where they are used."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from editor_files import FILES, RL_FILES, document

from skillwing.dsl.checking.types import SCALARS
from skillwing.dsl.editor.document import Document
from skillwing.dsl.editor.names import NameScope, Symbol
from skillwing.dsl.model import OwnerPolicy

ROVER = """\
skillset rover {
    enum Gait { WALK RUN }
    type Point { x: float64 [m]  gait: Gait = RUN }
    data { position: Point period=0.1  gait: Gait }
    resource wheels { initial FREE  FREE -> BUSY  BUSY -> FREE }
    event bump { guard resource=(wheels == BUSY) effect { wheels -> FREE } }
    skill drive {
        input { to: Point  gait: Gait = WALK }
        effect { take: wheels -> BUSY  leave: wheels -> FREE }
        precondition {
            free: resource=(FREE == wheels)
            near: data=(position.x < to.x and position.gait == WALK and gait != RUN)
            success take
        }
        invariant { ours: resource=(wheels != FREE) violation=leave }
        result { success THERE: apply=leave post resource=(wheels == FREE) }
        interrupt { apply=leave }
    }
}
"""


def uses(text: str, symbol: Symbol) -> list[int]:
    """The lines in which a symbol occurs, declarations negative."""
    found = Document(text, "rover.skillset")
    places = found.names.of(symbol)
    return [found.lines.line(place.start) * (-1 if place.declares else 1) for place in places]


@pytest.mark.parametrize(
    ("symbol", "lines"),
    [
        (Symbol(NameScope("skillset"), "rover"), [-1]),
        (Symbol(NameScope("type"), "Gait"), [-2, 3, 4, 8]),
        (Symbol(NameScope("value", "Gait"), "WALK"), [-2, 8, 12]),
        (Symbol(NameScope("value", "Gait"), "RUN"), [-2, 3, 12]),
        (Symbol(NameScope("field", "Point"), "x"), [-3, 12, 12]),
        (Symbol(NameScope("field", "Point"), "gait"), [-3, 12]),
        (Symbol(NameScope("datum"), "position"), [-4, 12, 12]),
        (Symbol(NameScope("datum"), "gait"), [-4]),
        (Symbol(NameScope("input", "drive"), "gait"), [-8, 12]),
        (Symbol(NameScope("resource"), "wheels"), [-5, 6, 6, 9, 9, 11, 15, 16]),
        (Symbol(NameScope("state", "wheels"), "FREE"), [-5, 5, 5, 6, 9, 11, 15, 16]),
        (Symbol(NameScope("effect", "drive"), "leave"), [-9, 15, 16, 17]),
        (Symbol(NameScope("result", "drive"), "THERE"), [-16]),
    ],
    ids=lambda value: value.title if isinstance(value, Symbol) else "",
)
def test_a_symbol_is_found_wherever_it_stands(symbol: Symbol, lines: list[int]) -> None:
    assert uses(ROVER, symbol) == lines


def test_states_of_a_list_are_declared_by_it() -> None:
    text = "skillset s { resource r { initial A  A -> B\nstate { A B } } }"
    assert uses(text, Symbol(NameScope("state", "r"), "A")) == [1, 1, -2]


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_every_use_has_one_declaration(path: Path) -> None:
    names = document(path).names
    for occurrence in names.occurrences:
        assert occurrence.symbol is not None, occurrence
        declared = names.declarations[occurrence.symbol].place
        assert declared is not None
        assert declared.symbol == occurrence.symbol
        assert [place for place in names.of(occurrence.symbol) if place.declares] == [declared]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_name_of_a_file_is_in_the_index(path: Path) -> None:
    found = document(path)
    known = {occurrence.start for occurrence in found.names.occurrences}
    unknown = {word.text for word in found.words if word.kind == "NAME" and word.start not in known}
    assert unknown <= {*SCALARS, *get_args(OwnerPolicy)}


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_an_occurrence_is_found_at_its_first_character_and_behind_its_last(path: Path) -> None:
    found = document(path)
    for occurrence in found.names.occurrences:
        assert found.text[occurrence.start : occurrence.end] == occurrence.name
        assert found.names.at(occurrence.start) == occurrence
        assert found.names.at(occurrence.end) == occurrence


def test_an_unknown_name_is_an_occurrence_without_symbol() -> None:
    text = "skillset s { resource r { initial A  A -> B } skill k { effect { e: r -> C } } }"
    place = Document(text, "s.skillset").names.at(text.index("C }"))
    assert place is not None
    assert (place.symbol, place.scopes) == (None, (NameScope("state", "r"),))


def test_names_in_an_element_with_a_syntax_error_are_known_by_the_sign_between_them() -> None:
    text = "skillset s { resource r { initial A  A -> B } skill k { ! r -> B } }"
    assert [place.start for place in Document(text, "s.skillset").names.of(Symbol(NameScope("resource"), "r"))] == [
        text.index("r {"),
        text.index("r -> B }"),
    ]


def test_a_name_that_was_made_up_for_an_inline_effect_stands_nowhere() -> None:
    text = "skillset s { resource r { state { A B } initial A transition all } skill k { start r -> B  success d {} } }"
    names = Document(text, "s.rl").names
    (effect,) = names.names(NameScope("effect", "k"))
    assert names.declarations[effect].place is None
    assert names.of(effect) == ()


@pytest.mark.parametrize(
    "text", ["", "}", "skillset", "skill k {", "/*", '"', "\ufeff", "skillset s { skill k { effect {"]
)
def test_any_text_has_an_index(text: str) -> None:
    assert Document(text, "s.skillset").names.at(len(text)) is None
