"""`skillwing journal` on a file: what it shows, as columns and as JSON, and what it says where there is none."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from skillwing.dsl import parse
from skillwing.services.commands.journal import journal
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.ids import RecordIds
from skillwing.services.journal.errors import NoJournalError
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import BeginGoal, FireExtern, Record
from skillwing.services.terminal.exit_codes import USAGE, exit_code_of

CRANE = parse(
    """
    skillset crane {
        resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
        resource hook { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
        resource lamp { initial DARK  DARK -> LIT  LIT -> DARK }
        skill lift {
            input { load: float64 [kg] }
            effect { take: hook -> TAKEN  free: hook -> FREE }
            precondition { free: resource=(hook == FREE)  success take }
            invariant { power: resource=(power == ON) violation=free }
            interrupt { apply=free }
            result { DONE: apply=free }
        }
        skill shine {
            effect { light: lamp -> LIT  dark: lamp -> DARK }
            precondition { dark: resource=(lamp == DARK)  success light }
            interrupt { apply=dark }
            result { END: apply=dark }
        }
    }
    """,
    "crane.skillset",
)


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """A run in which a lift lost its power, and a lamp is lit."""
    file = Journal(tmp_path / "journal.sqlite", Identity("r1", CRANE.name, CRANE.schema_hash))
    core = ResourceCore(CRANE, source="rm", new_record_id=RecordIds("rm"))
    file.write(core.initial_entries(), (), 0.0, 0)

    def keep(step: Step[Any], now: float) -> None:
        file.write(step.entries, [each for each in step.publications if isinstance(each, Record)], now, step.number)

    def begin(skill: str, **inputs: Any) -> BeginGoal:
        manager, schema = f"skill/{skill}", CRANE.schema_hash
        return BeginGoal(goal_id=f"g-{skill}", skill=skill, inputs=inputs, manager=manager, owner="t", schema=schema)

    keep(core.step(begin("lift", load=2.5), 1.0), 1.0)
    keep(core.step(begin("shine"), 2.0), 2.0)
    keep(core.step(FireExtern(resource="power", target="OFF", source="the grid"), 3.0), 3.0)
    file.close()
    return tmp_path


def shown(*words: str) -> str:
    app = typer.Typer()
    app.command()(journal)
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_columns_say_what_holds_and_how_it_came_to_be(run_dir: Path) -> None:
    text = " ".join(shown(str(run_dir)).split())
    assert "r1 at 3.00 s, after step 3" in text
    assert "power OFF 3.00 s reported by the grid" in text
    assert "shine g-shine" in text
    assert "lift g-lift power violated: `power == ON` does not hold: power is OFF." in text
    assert "hook FREE effect free of lift lift.power VIOLATED" in text


def test_json_has_all_of_it_but_only_the_changes_asked_for(run_dir: Path) -> None:
    facts = json.loads(shown(str(run_dir / "journal.sqlite"), "--json", "--last", "2"))
    assert facts["step"] == 3
    assert facts["resources"]["lamp"]["state"] == "LIT"
    assert [(each["skill"], each["token"]) for each in facts["grants"]] == [("shine", facts["last_token"])]
    assert [each["verdict"]["type"] for each in facts["goals"]] == ["violated"]
    assert [each["after"] for each in facts["history"]] == ["VIOLATED", "FREE"]


def test_no_journal_is_a_sentence_and_an_exit_code(tmp_path: Path) -> None:
    with pytest.raises(NoJournalError, match=r"There is no journal at .* Name a run's directory") as error:
        shown(str(tmp_path))
    assert exit_code_of(error.value) == USAGE


def test_a_file_of_another_kind_is_not_called_damaged(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("Nothing but notes are in here.")
    with pytest.raises(NoJournalError, match=r"notes.txt is no journal. Name a run's directory"):
        shown(str(tmp_path / "notes.txt"))
