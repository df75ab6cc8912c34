"""The formatter loses nothing, says the same twice, and a model printed as source is that model."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
import typer
from command_runner import CommandRunner
from hypothesis import HealthCheck, given, settings
from skillset_strategies import skillsets

from law_settings import examples
from skillwing import m600
from skillwing.dsl.checking.resolver import resolve
from skillwing.dsl.commands.fmt import fmt
from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.model import Skillset
from skillwing.dsl.printing.formatting import UnformattableError, format_source
from skillwing.dsl.printing.source import to_source
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.parser import parse_file

ROOT = Path(__file__).parents[3]
M600 = Path(m600.__path__[0]) / "m600.skillset"
EXAMPLES = sorted((ROOT / "examples").glob("*/*.skillset"))
CASES = [path for path in sorted((Path(__file__).parent / "cases").rglob("*")) if path.suffix in {".skillset", ".rl"}]
FILES = [M600, *EXAMPLES, *sorted((ROOT / "examples").glob("*/*.rl")), *CASES]
READABLE = [path for path in FILES if not parse_file(path.read_text(), path.name).diagnostics]
DAMAGED = [path for path in FILES if path not in READABLE]


def contents(text: str, file: str = "contents.skillset") -> tuple[list[tuple[str, str]], list[list[str]]]:
    """The words of a text, and the lines of its comments without the space around them."""
    lexemes = lex(text, file)
    words = [(lexeme.kind, lexeme.text) for lexeme in lexemes if lexeme.kind != "COMMENT"]
    comments = [lexeme.text for lexeme in lexemes if lexeme.kind == "COMMENT"]
    return words, [[line.strip() for line in comment.split("\n")] for comment in comments]


def model(text: str, file: str = "model.skillset") -> tuple[Skillset, list[str]]:
    """The meaning of a readable text, with the reader's diagnostics."""
    parsed = parse_file(text, file)
    assert parsed.root is not None
    report = DiagnosticReport()
    return resolve(parsed.root, report), sorted(item.message for item in report.diagnostics)


def reshuffled(text: str, chance: random.Random) -> str:
    """The same words with other white space: spaces and line breaks added, doubled and, where possible, taken away."""
    pieces: list[str] = []
    end = 0
    for lexeme in lex(text, "reshuffled.skillset"):
        gap = text[end : lexeme.start]
        breaks = "\n" in gap and bool(pieces) and pieces[-1].startswith("//")
        glued = not gap or (pieces and not (pieces[-1][-1].isalnum() and lexeme.text[0].isalnum()))
        choices = ["\n", "\n\n\n   ", "\t\n"] if breaks else [" ", "  \t ", "\n", "\n  \n\n", gap or " "]
        joins = glued and not breaks and lexeme.kind not in {"NUMBER", "ARRAY", "UNIT"} and pieces[-1:] != ["/"]
        pieces += [chance.choice([*choices, ""] if joins and is_safe(pieces, lexeme.text) else choices), lexeme.text]
        end = lexeme.end
    return "".join(pieces)


def is_safe(pieces: list[str], following: str) -> bool:
    """True if two words may touch without becoming one."""
    signs = "-=<>!+./*_"
    return bool(pieces) and pieces[-1][-1:] not in signs and following[0] not in signs


@pytest.mark.parametrize("path", READABLE, ids=lambda path: path.name)
def test_formatting_keeps_every_word_and_comment_and_is_idempotent(path: Path) -> None:
    text = path.read_text()
    once = format_source(text, path.name)
    assert contents(once, path.name) == contents(text, path.name)
    assert format_source(once, path.name) == once
    assert model(once, path.name) == model(text, path.name)


@pytest.mark.parametrize("path", [M600, *EXAMPLES, *(READABLE[-3:])], ids=lambda path: path.name)
def test_any_white_space_comes_to_an_idempotent_form(path: Path) -> None:
    text = path.read_text()
    for seed in range(8):
        mutant = reshuffled(text, random.Random(seed))
        assert contents(mutant) == contents(text)
        once = format_source(mutant)
        assert contents(once) == contents(text)
        assert format_source(once) == once


EVERY_SHAPE = """\
skillset s {
    data { a: float64 [m] period=0.1 }
    resource r {
        initial A
        extern A -> B
    }
    skill k {
        input { x: float64 in 0..1 = 0.5 }
        effect { go: r -> B  none {} }
        precondition { free: resource=(r == A and not r == B) }
        result { failure LATE: apply=go }
    }
}
"""
EDGES = [0, *(lexeme.end for lexeme in lex(EVERY_SHAPE, "edges.skillset"))]
COMMENTS = [
    "/* why */",
    " // why  \n",
    "\n\n// why\n",
    "/* why\n so */",
    "\n  /* why  \r\n\n so */ ",
    "/* a */ /* b */ // c\n",
]


@pytest.mark.parametrize("comment", COMMENTS, ids=repr)
def test_a_comment_anywhere_is_kept_and_formatted_once_for_all(comment: str) -> None:
    for edge in EDGES:
        text = EVERY_SHAPE[:edge] + comment + EVERY_SHAPE[edge:]
        once = format_source(text)
        assert contents(once) == contents(text)
        assert format_source(once) == once


def test_comments_everywhere_at_once_are_formatted_once_for_all() -> None:
    for seed in range(40):
        chance = random.Random(seed)
        text = EVERY_SHAPE
        for edge in sorted(chance.sample(EDGES, 8), reverse=True):
            text = text[:edge] + chance.choice([*COMMENTS, "\r\n", "\n\n\n", "\t"]) + text[edge:]
        once = format_source(text)
        assert contents(once) == contents(text)
        assert format_source(once) == once


def test_a_statement_behind_a_comment_of_several_lines_stands_on_a_line_of_its_own() -> None:
    source = "skillset s {\n  /* why\n     so */ skill k {\n  // which?\n  }\n}\n"
    assert (
        format_source(source)
        == """\
skillset s {
    /* why
       so */
    skill k {
        // which?
    }
}
"""
    )


def test_line_ends_of_other_systems_become_one_kind() -> None:
    assert format_source("skillset s { // a\r skill k {}\r\n\r\n // b  \r\n }") == (
        "skillset s {   // a\n    skill k {}\n\n    // b\n}\n"
    )


@pytest.mark.parametrize("path", DAMAGED, ids=lambda path: path.name)
def test_a_text_with_syntax_errors_is_refused(path: Path) -> None:
    with pytest.raises(UnformattableError) as caught:
        format_source(path.read_text(), path.name)
    assert caught.value.diagnostics == parse_file(path.read_text(), path.name).diagnostics
    assert f"`{path.name}` has syntax errors" in str(caught.value)


@pytest.mark.parametrize("path", [M600, *EXAMPLES], ids=lambda path: path.name)
def test_the_files_of_the_project_are_formatted(path: Path) -> None:
    assert path.read_text() == format_source(path.read_text(), path.name)


def test_the_style() -> None:
    source = """
/* lead */ skillset style
{
  enum Mode{FAST
  SLOW}
  data { position :Point period = 0.1 battery:float64[%]period=1.0 } // both
  resource axes { initial FREE  FREE->USED
     USED->FREE } type Point { x:float64 [m] y:float64 [m] }


  skill goto { // moves
    input { target: Point speed: float64 [m/s] in 0.1 .. 5.0=2.0 mode: Mode=FAST }
    effect { take {axes->USED} release: axes -> FREE nothing{} }
       /* Checked
          at the start. */
    precondition { free:
        resource = ( axes==FREE ) success take
    }
    result { success ARRIVED:apply=release // there
             failure LATE: apply=release post resource=(axes==FREE) } interrupt {apply=release timeout=2.0}
  }
}
"""
    assert (
        format_source(source)
        == """\
/* lead */ skillset style {
    enum Mode {
        FAST
        SLOW
    }
    data { position: Point period=0.1  battery: float64 [%] period=1.0 }   // both
    resource axes {
        initial FREE
        FREE -> USED
        USED -> FREE
    }
    type Point { x: float64 [m]  y: float64 [m] }

    skill goto {   // moves
        input { target: Point  speed: float64 [m/s] in 0.1..5.0 = 2.0  mode: Mode = FAST }
        effect { take { axes -> USED }  release: axes -> FREE  nothing {} }
        /* Checked
           at the start. */
        precondition {
            free: resource=(axes == FREE)
            success take
        }
        result {
            success ARRIVED: apply=release   // there
            failure LATE:    apply=release post resource=(axes == FREE)
        }
        interrupt { apply=release timeout=2.0 }
    }
}
"""
    )


def test_a_block_that_does_not_fit_is_opened_and_a_long_predicate_keeps_its_lines() -> None:
    states = " or ".join(["r == A"] * 7)
    source = f"""skillset s {{
    resource r {{ initial A {"  ".join(f"S{n} -> S{n + 1}" for n in range(12))} }}
    skill k {{
        precondition {{
            p: resource=({states} or
              r == B)
        }}
    }}
}}
"""
    formatted = format_source(source)
    assert "    resource r {\n        initial A\n        S0 -> S1\n" in formatted
    assert f"            p: resource=({states} or\n                r == B)\n" in formatted
    assert max(map(len, formatted.split("\n"))) <= 100


def test_comments_keep_their_places_within_a_statement() -> None:
    source = """skillset s { // a
      data { // b
 x: float64 // c
 period=0.1 /* d */ /* e */ // f
 } // g
 // h
 }
// i"""
    assert (
        format_source(source)
        == """\
skillset s {   // a
    data {   // b
        x: float64 // c
            period=0.1   /* d */ /* e */ // f
    }   // g
    // h
}
// i
"""
    )


@settings(examples(20), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(skillsets())
def test_a_model_printed_as_source_is_that_model(skillset: Skillset) -> None:
    source = to_source(skillset)
    again, problems = model(source)
    assert again == skillset
    assert again.schema_hash == skillset.schema_hash
    assert not [problem for problem in problems if not re.match("Nothing ", problem)]  # unused elements are no problem
    assert format_source(source) == source


def test_an_event_guarded_by_data_is_printed_as_such() -> None:
    source = """\
skillset s {
    data { battery: float64 }
    resource r {
        initial A
        extern A -> B
    }
    event low {
        guard data=(battery < 10.0)
        effect { r -> B }
    }
}
"""
    again, _ = model(source)
    printed = to_source(again)
    assert "guard data=(battery < 10.0)" in printed
    assert model(printed)[0] == again


# --- the command

RAW = "skillset s { data { a:float64 } } // end\n"
NEAT = "skillset s {\n    data { a: float64 }\n}   // end\n"


def run(*arguments: str | Path, given: str | bytes | None = None) -> tuple[int, str, str]:
    app = typer.Typer()
    app.command("fmt")(fmt)
    result = CommandRunner().invoke(app, [str(argument) for argument in arguments], input=given)
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def raw(tmp_path: Path) -> Path:
    (tmp_path / "raw.skillset").write_text(RAW)
    return tmp_path / "raw.skillset"


def test_files_are_formatted_in_place(raw: Path) -> None:
    assert run(raw) == (0, f"{raw}: formatted.\n", "")
    assert raw.read_text() == NEAT
    assert run(raw) == (0, "", "")
    assert run("--check", raw) == (0, "", "")


def test_check_and_diff_write_nothing(raw: Path) -> None:
    assert run("--check", raw) == (1, f"{raw} is not in the style; run `skillwing fmt {raw}`.\n", "")
    code, output, _ = run("--diff", raw)
    assert code == 1
    assert "\n-skillset s { data { a:float64 } } // end\n+skillset s {\n" in output
    assert raw.read_text() == RAW


def test_standard_input_goes_to_standard_output() -> None:
    assert run("-", given=RAW) == (0, NEAT, "")
    refusal = "`-` cannot be read: it is not text in UTF-8, from byte 1 of line 1 on. Save it as UTF-8.\n"
    assert run("-", given=b"\xff\xfe") == (2, "", refusal)


def test_a_damaged_file_stays_as_it_is_and_the_others_are_formatted(raw: Path, tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.skillset"
    damaged.write_text("skillset s { skill k {")
    code, output, error = run(damaged, raw)
    assert (code, output) == (1, f"{raw}: formatted.\n")
    assert error.startswith(f"`{damaged}` has syntax errors. Fix what `skillwing check {damaged}` shows")
    assert damaged.read_text() == "skillset s { skill k {"


def test_nothing_is_written_if_a_file_is_missing(raw: Path) -> None:
    assert run(raw, "nowhere.skillset")[::2] == (
        2,
        "`nowhere.skillset` cannot be read: No such file or directory. Name one that can.\n",
    )
    assert raw.read_text() == RAW
