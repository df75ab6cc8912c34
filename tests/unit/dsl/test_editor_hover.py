"""Descriptions of the name or word under the pointer, which each text marks with `|`."""

from __future__ import annotations

from pathlib import Path

import pytest
from editor_files import FILES, RL_FILES, document, marked

from skillwing.dsl.editor.description import hover

BOAT = """\
skillset boat {
    // Where the boat is,
    // in the harbour's frame.
    type Position { x: float64 [m]  y: float64 [m] }

    enum Mode { SLOW FAST }
    data {
        position: Position          period=0.1
        wind:     float64  [m/s]    // at the mast
    }
    /* Raised by the winch. */
    resource sail { initial DOWN  DOWN -> UP  UP -> DOWN  extern * -> TORN }
    skill tack {
        owner_lost=continue
        input { angle: float64 [rad] in -1.0..1.0 = 0.5 }
        output { position: Position }
        effect { hoist: sail -> UP   strike   { sail -> DOWN } }
        precondition { calm: data=(wind < 10.0)  success hoist }
        result { success DONE: apply=strike   failure STUCK: apply=strike }
    }
}
"""


def said(word: str, text: str = BOAT) -> str:
    """The hover at the first occurrence of a word."""
    at = text.index(word)
    found, offset = marked(f"{text[:at]}|{text[at:]}")
    shown = hover(found, offset)
    assert shown is not None
    return shown.markdown.replace("```skillset", "```")


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("boat", "```\nskillset boat\n```\n\n2 types, 2 data, 1 resource, 1 skill."),
        (
            "Position {",
            "```\ntype Position { x: float64 [m]  y: float64 [m] }\n```\n\nWhere the boat is,\nin the harbour's frame.",
        ),
        ("SLOW", "```\nSLOW\n```\n\nValue of `Mode`."),
        (
            "position:",
            "```\nposition: Position period=0.1\n```\n\n"
            "Datum of the functional layer, published every 0.1 s, stale after 0.3 s.",
        ),
        (
            "wind:",
            "```\nwind: float64 [m/s]\n```\n\nat the mast\n\n"
            "Datum of the functional layer. No period is promised, so it never counts as stale.",
        ),
        (
            "sail {",
            "```\nresource sail { initial DOWN  DOWN -> UP  UP -> DOWN  extern * -> TORN }\n```\n\n"
            "Raised by the winch.",
        ),
        (
            "UP",
            "```\nUP\n```\n\nState of the resource `sail`.\n\nEntered from `DOWN`.\n\n"
            "Left for `DOWN`, `TORN` (extern).",
        ),
        (
            "TORN",
            "```\nTORN\n```\n\nState of the resource `sail`.\n\nEntered from any other (extern).",
        ),
        (
            "tack",
            "```\nskill tack(angle: float64 [rad] in -1.0..1.0 = 0.5) -> (position: Position)\n```\n\n"
            "Needs `calm`.\n\nEnds `DONE` (success), `STUCK` (failure).",
        ),
        ("angle", "```\nangle: float64 [rad] in -1.0..1.0 = 0.5\n```\n\nInput of `tack`."),
        ("hoist }", "```\nhoist: sail -> UP\n```\n\nEffect of `tack`."),
        ("strike   f", "```\nstrike { sail -> DOWN }\n```\n\nEffect of `tack`."),
        ("calm", "```\ncalm: data=(wind < 10.0)\n```\n\nPrecondition of `tack`."),
        ("STUCK", "```\nSTUCK: apply=strike\n```\n\nResult of `tack`."),
        ("float64", "A number in double precision; NaN and infinity are refused."),
        ("apply", "The effect that is applied."),
        ("continue", "The goal goes on."),
    ],
)
def test_what_a_name_is(word: str, expected: str) -> None:
    assert said(word) == expected


def test_nothing_is_said_of_signs_numbers_and_unknown_names() -> None:
    for text in ("skillset s |{ }", "skillset s { data { d: float64 period=|0.1 } }", "skillset s { data { d: |T } }"):
        assert hover(*marked(text)) is None


def test_a_long_declaration_is_cut() -> None:
    values = "\n".join(f"    V{n}" for n in range(40))
    assert said("Many", f"skillset s {{ enum Many {{\n{values}\n}} }}").endswith("V22\n...\n```")


@pytest.mark.parametrize("path", [*FILES, *RL_FILES], ids=lambda path: path.name)
def test_something_is_said_of_every_word_of_a_file(path: Path) -> None:
    found = document(path)
    for word in found.words:
        if word.text.isidentifier():
            shown = hover(found, word.start)
            # The types of `.rl` files are known to the middleware only.
            assert shown is not None or path.suffix == ".rl", word
