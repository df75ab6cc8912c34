"""The reference page says what the model and its comments say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer
from command_runner import CommandRunner

from skillwing import m600
from skillwing.dsl import load, parse
from skillwing.dsl.commands.docs import docs
from skillwing.dsl.printing.reference.descriptions import Descriptions
from skillwing.dsl.printing.reference.page import reference_page
from skillwing.dsl.printing.reference.words import in_words, units_of

ROOT = Path(__file__).parents[3]
M600 = Path(m600.__path__[0]) / "m600.skillset"
EXAMPLES = sorted((ROOT / "examples").glob("*/*.skillset"))
EVERYTHING = Path(__file__).parent / "cases" / "valid" / "everything.skillset"


def page(path: Path) -> str:
    return reference_page(load(path), path.read_text(), path.name)


def test_the_page_of_the_m600_is_up_to_date() -> None:
    assert (ROOT / "docs" / "m600.md").read_text() == page(M600), "run `make generate`"


@pytest.mark.parametrize("path", [M600, *EXAMPLES, EVERYTHING], ids=lambda path: path.stem)
def test_everything_declared_is_on_the_page(path: Path) -> None:
    skillset, text = load(path), page(path)
    headings = set(re.findall(r"^### (.*)$", text, re.MULTILINE))
    assert headings == {
        *(f"type {declared.name}" for declared in skillset.types),
        *(f"resource {resource.name}" for resource in skillset.resources),
        *(f"skill {skill.name}" for skill in skillset.skills),
    }
    first_cells = re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)
    for skill in skillset.skills:
        groups = (skill.inputs, skill.outputs, skill.feedback, skill.results, skill.invariants)
        for element in (*skill.preconditions.checks, *(element for group in groups for element in group)):
            assert element.name in first_cells
    assert {item.name for item in skillset.data} <= set(first_cells)
    assert text.count("```mermaid") == len(skillset.resources)


@pytest.mark.parametrize("path", [M600, *EXAMPLES, EVERYTHING], ids=lambda path: path.stem)
def test_links_lead_to_headings_and_tables_are_even(path: Path) -> None:
    text = page(path)
    anchors = {heading.lower().replace(" ", "-") for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}
    assert set(re.findall(r"\]\(#(.*?)\)", text)) <= anchors
    for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table.strip().split("\n")}) == 1


SOURCE = """
// What the file
// is about.

/* A second paragraph. */
skillset s {
    // --- A heading, not a description. ---

    // The wheels
    // of a | <cart>.
    resource wheels { initial FREE  FREE -> BUSY  BUSY -> FREE }   // all four

    data {
        speed: float64 [m/s]   // over ground
        // behind the seat
        heat: float64
    }

    /* Goes on
     * and on.
     */
    skill drive {   // if it can
        effect { take: wheels -> BUSY  back: wheels -> FREE }
        precondition {
            slow: data=(speed < 0.5 and not (heat > 3 or speed == 0))   // nearly still
            success take
        }
        result { success DONE: apply=back post resource=(wheels == FREE => wheels != BUSY) }
    }
}
"""


def test_comments_above_and_behind_describe() -> None:
    skillset, described = parse(SOURCE), Descriptions(SOURCE, "s.skillset")
    assert described.of_file == "What the file\nis about.\n\nA second paragraph."
    assert described.of(skillset.resource("wheels").span) == "The wheels\nof a | <cart>.\nall four"
    assert described.of(skillset.datum("speed").span) == "over ground"
    assert described.of(skillset.datum("heat").span) == "behind the seat"
    assert described.of(skillset.skill("drive").span) == "Goes on\nand on.\nif it can"
    assert described.of(skillset.skill("drive").preconditions.checks[0].span) == "nearly still"
    assert described.of(skillset.skill("drive").results[0].span) == ""


def test_predicates_read_as_sentences() -> None:
    skillset = parse(SOURCE)
    units, skill = units_of(skillset.data), skillset.skill("drive")
    assert in_words(skill.preconditions.checks[0].expression, units) == (
        "`speed` is less than 0.5 m/s and not (`heat` is greater than 3 or `speed` is 0 m/s)"
    )
    post = skill.results[0].post
    assert post is not None
    assert in_words(post, units) == "if `wheels` is `FREE`, then `wheels` is not `BUSY`"


def test_text_cannot_break_the_page() -> None:
    text = reference_page(parse(SOURCE), SOURCE, "s.skillset")
    assert "of a | &lt;cart>." in text
    assert "| `slow` | `speed` is less than 0.5 m/s and not" in text
    summary = SOURCE.replace("Goes on\n     * and on.", "One | two. Three.")
    assert "| [`drive`](#skill-drive) | One \\| two. | `DONE` |" in reference_page(
        parse(summary), summary, "s.skillset"
    )


def test_the_command_writes_and_compares(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command("docs")(docs)
    target = tmp_path / "page.md"
    assert CommandRunner().invoke(app, [str(EVERYTHING)]).stdout == page(EVERYTHING)
    assert CommandRunner().invoke(app, [str(EVERYTHING), "--check"]).exit_code == 2
    assert CommandRunner().invoke(app, [str(EVERYTHING), "--check", "-o", str(target)]).exit_code == 1
    assert CommandRunner().invoke(app, [str(EVERYTHING), "-o", str(target)]).exit_code == 0
    assert target.read_text() == page(EVERYTHING)
    assert CommandRunner().invoke(app, [str(EVERYTHING), "--check", "-o", str(target)]).exit_code == 0
    assert CommandRunner().invoke(app, [str(EVERYTHING), "-o", str(tmp_path)]).exit_code == 2


def test_ranges_of_data_are_shown_if_there_are_any() -> None:
    text = "skillset s {{ data {{ level: float64 [%]{} period=1.0 }} }}"
    plain, ranged = (reference_page(parse(text.format(each)), text, "s.skillset") for each in ("", " in 0.0..100.0"))
    assert "Range" not in plain
    assert "| `level` | `float64` | % | 0.0 to 100.0 | 1 s | 3 s |" in ranged
