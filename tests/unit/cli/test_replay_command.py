"""`skillwing replay`: what it says of a run whose answers are the same, of one whose are not, and of bad runs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from skillwing.dsl import parse
from skillwing.services.commands.replay import replay
from skillwing.services.core.events import TimePassed
from skillwing.services.core.ledger import Ledger
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT
from skillwing.services.errors import BadRecordingError, InvalidOptionError
from skillwing.services.ids import RecordIds
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import BeginGoal
from skillwing.services.replay.files import StepWriter
from skillwing.services.replay.recorded_core import RecordedCore
from skillwing.services.replay.steps import FORMAT, Head, Made
from skillwing.services.terminal.exit_codes import FAILED, OK, USAGE, exit_code_of

SOURCE = """
skillset crane {
    resource hook { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    skill lift {
        effect { take: hook -> TAKEN  free: hook -> FREE }
        precondition { free: resource=(hook == FREE)  success take }
        interrupt { apply=free }
        result { DONE: apply=free }
    }
}
"""
CRANE = parse(SOURCE)


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """A run in which time passed and a lift began."""
    head = Head(FORMAT, "r1", "crane", CRANE.schema_hash, "crane.skillset", SOURCE)
    writer = StepWriter(tmp_path / "steps", head)
    made = Made(0.0, None, EMPTY_SNAPSHOT, same_data=False)
    plain = ResourceCore(CRANE, source=RESOURCE_MANAGER, new_record_id=RecordIds(RESOURCE_MANAGER))
    core = RecordedCore(plain, made, writer, lambda: None)
    core.step(TimePassed(), 1.0)
    schema = CRANE.schema_hash
    core.step(BeginGoal(goal_id="g1", skill="lift", inputs={}, manager="skill/lift", owner="t", schema=schema), 12.5)
    writer.close()
    return tmp_path


def run(*words: str) -> Result:
    app = typer.Typer()
    app.command()(replay)
    return CliRunner().invoke(app, list(words), catch_exceptions=False)


def test_the_same_answers_are_one_line(run_dir: Path) -> None:
    result = run(str(run_dir))
    assert result.exit_code == OK
    assert result.stdout == "same   2 steps of r1, from 0.00 s to 12.50 s: every answer is as it was.\n"


def test_another_answer_is_described_in_words(run_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Ledger, "next_token", lambda *_: 7)
    result = run(str(run_dir))
    assert result.exit_code == FAILED
    assert "at 12.50 s: the last of 2 steps of r1 that were taken again, step 2 of" in result.stdout
    assert "event  begin: goal_id g1, skill lift, manager skill/lift, owner t\n" in result.stdout
    assert "then   granted: goal_id g1, token 12500, step 1; `hook` FREE -> TAKEN\n" in result.stdout
    assert "now    granted: goal_id g1, token 7, step 1; `hook` FREE -> TAKEN\n" in result.stdout
    assert "reply.token: 12500 then, 7 now\n" in result.stdout


def test_json_has_both_answers(run_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    same = json.loads(run(str(run_dir), "--json").stdout)
    assert same == {**same, "same": True, "steps": 2, "divergence": None, "skillset": "crane", "unfinished": []}
    monkeypatch.setattr(Ledger, "next_token", lambda *_: 7)
    found = json.loads(run(str(run_dir), "--json").stdout)["divergence"]
    assert found["event"]["goal_id"] == "g1"
    assert found["then"]["reply"]["token"] == 12500
    assert found["now"]["reply"]["token"] == 7
    assert {"path": "reply.token", "then": 12500, "now": 7} in found["differences"]


def test_an_unfinished_step_is_said(run_dir: Path) -> None:
    file = run_dir / "steps" / "1.msgpack"
    file.write_bytes(file.read_bytes()[:-1])
    result = run(str(run_dir))
    assert result.exit_code == OK
    assert "1.msgpack was not written to its end, and is left out.\nsame   1 step of r1" in result.stdout


def test_no_steps_are_a_sentence_and_an_exit_code(tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError, match=r"holds no `steps`\. Name the directory of a run") as error:
        run(str(tmp_path))
    assert exit_code_of(error.value) == USAGE
    with pytest.raises(InvalidOptionError, match=r"There is no folder `.*nope`\. Name the directory of a run"):
        run(str(tmp_path / "nope"))
    (tmp_path / "steps").mkdir()
    with pytest.raises(BadRecordingError, match=r"There are no steps .* Name the directory of a run") as empty:
        run(str(tmp_path))
    assert exit_code_of(empty.value) == USAGE
