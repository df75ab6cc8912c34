"""`skillwing timeline` on the files of a run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from skillwing.dsl import UnknownNameError, parse
from skillwing.services.commands.timeline import timeline
from skillwing.services.errors import InvalidOptionError
from skillwing.services.history.files import TIMELINE_FILE, JsonLines
from skillwing.services.protocol import Record, RecordKind
from skillwing.services.recording.run_facts import RunFacts, write_facts

app = typer.Typer()
app.command()(timeline)


def record(number: int, kind: RecordKind, subject: str, after: str, cause: int | None = None) -> Record:
    return Record(
        id=f"r{number}",
        t=float(number),
        source="test",
        kind=kind,
        subject=subject,
        before=None,
        after=after,
        text="",
        cause=None if cause is None else f"r{cause}",
    )


@pytest.fixture
def run(tmp_path: Path) -> Path:
    with JsonLines[Record](tmp_path / TIMELINE_FILE) as lines:
        # The order in the file is not that of the events.
        lines.write(record(3, RecordKind.GOAL, "look", "RI", cause=2))
        lines.write(record(0, RecordKind.DATA, "position", "FRESH"))
        lines.write(record(1, RecordKind.HEALTH, "eye", "FAILED"))
        lines.write(record(2, RecordKind.RESOURCE, "eye_status", "FAILED", cause=1))
    return tmp_path


def shown(*words: str) -> list[str]:
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0
    return [line.split()[2] for line in result.output.splitlines()[1:]]


def test_records_are_shown_in_the_order_in_which_they_happened(run: Path) -> None:
    assert shown(str(run)) == ["eye", "eye_status", "look"]


def test_records_may_be_chosen_by_subject_and_kind_with_their_causes(run: Path) -> None:
    assert shown(str(run), "--kind", "data") == ["position"]
    assert shown(str(run), "--about", "look") == ["look"]
    assert shown(str(run), "--about", "look", "--causes") == ["eye", "eye_status", "look"]


def test_json_holds_the_records(run: Path) -> None:
    result = CliRunner().invoke(app, [str(run), "--json", "--kind", "goal"])
    assert [each["after"] for each in json.loads(result.output)] == ["RI"]


SKILLSET = """
skillset watch {
    resource eye_status { initial OK  extern OK -> FAILED  extern FAILED -> OK }
    skill look { precondition { sees: resource=(eye_status == OK) }  result { success SEEN } }
}
"""


def test_a_picture_with_another_version_of_the_skillset_than_was_run_says_so(run: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path, picture = tmp_path / "watch.skillset", ["--png", str(tmp_path / "run.png")]
    path.write_text(SKILLSET)
    write_facts(run, RunFacts(robot="watch", skillset=str(path)))
    assert CliRunner().invoke(app, [str(run), *picture]).stderr == ""
    path.write_text(SKILLSET.replace("eye_status == OK", "eye_status == FAILED"))
    assert CliRunner().invoke(app, [str(run)]).stderr == "", "the records need no skillset"
    result = CliRunner().invoke(app, [str(run), *picture])
    assert result.exit_code == 0
    assert re.search(rf"Version {parse(SKILLSET).schema_hash} of `watch` was run; .* is version", result.stderr)


def test_it_can_be_drawn(run: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    said = CliRunner().invoke(app, [str(run), "--png", str(tmp_path / "run.png")], catch_exceptions=False).output
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    assert said == f"The timeline is drawn: {tmp_path / 'run.png'}\n"


def test_no_folder_is_made_for_a_picture(run: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    with pytest.raises(FileNotFoundError):
        CliRunner().invoke(app, [str(run), "--png", str(tmp_path / "nope" / "run.png")], catch_exceptions=False)
    assert not (tmp_path / "nope").exists()


@pytest.mark.parametrize("name", ["run.gif", "run"])
def test_a_picture_of_another_format_is_refused(run: Path, tmp_path: Path, name: str) -> None:
    result = CliRunner().invoke(app, [str(run), "--png", str(tmp_path / name)], env={"COLUMNS": "300"})
    assert result.exit_code == 2
    assert f"`{tmp_path / name}` is no picture that can be drawn. End it with .png." in result.output
    assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--about", "lok"], "There is no subject `lok`; did you mean `look`?"),
        (["--kind", "gaol"], "There is no kind `gaol`; did you mean `goal`?"),
    ],
)
def test_unknown_names_are_refused(run: Path, words: list[str], sentence: str) -> None:
    with pytest.raises(UnknownNameError, match=re.escape(sentence)):
        CliRunner().invoke(app, [str(run), *words], catch_exceptions=False)


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError, match="holds no"):
        CliRunner().invoke(app, [str(tmp_path)], catch_exceptions=False)


def test_a_folder_that_does_not_exist_is_not_said_to_lack_a_file(tmp_path: Path) -> None:
    with pytest.raises(InvalidOptionError, match=r"There is no folder .*nope`. Name the directory"):
        CliRunner().invoke(app, [str(tmp_path / "nope")], catch_exceptions=False)
