"""Skillset facts of a run, for readers that have another version."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.history.files import TIMELINE_FILE, JsonLines
from skillwing.services.protocol import Record, RecordKind
from skillwing.services.recording.run_facts import RUN_FILE, RunFacts, read_facts, version_note, write_facts
from skillwing.services.report.run_reports import write_reports

FACTS = RunFacts(robot=ROBOT.name, skillset=str(ROBOT.skillset))
OLD = "0123456789abcdef"


def flown_elsewhere(run: Path, schema: str | None) -> RunFacts:
    """Facts of a run in a container whose skillset had this version, read outside of the container."""
    run.mkdir(exist_ok=True)
    facts = msgspec.structs.replace(FACTS, skillset="/in/a/container/m600.skillset", schema=schema)
    (run / RUN_FILE).write_bytes(msgspec.json.encode(facts))
    return read_facts(run)


def test_a_run_tells_which_version_of_its_skillset_was_run(tmp_path: Path) -> None:
    write_facts(tmp_path, FACTS)
    assert read_facts(tmp_path).schema == ROBOT.load_skillset().schema_hash
    write_facts(tmp_path, RunFacts(robot="unheard-of", skillset="/nowhere/at/all.skillset"))
    assert read_facts(tmp_path).schema is None


def test_it_is_said_where_the_skillset_that_is_here_is_another_one(tmp_path: Path) -> None:
    skillset = ROBOT.load_skillset()
    for schema in (None, skillset.schema_hash):
        assert version_note(flown_elsewhere(tmp_path, schema), skillset) is None
    said = version_note(flown_elsewhere(tmp_path, OLD), skillset)
    assert said is not None and all(word in said for word in (OLD, skillset.schema_hash, str(ROBOT.skillset)))


@pytest.mark.parametrize("mission", [None, "patrol"])
def test_a_report_says_by_which_skillset_it_was_made(tmp_path: Path, mission: str | None) -> None:
    pytest.importorskip("matplotlib")
    facts = msgspec.structs.replace(flown_elsewhere(tmp_path, OLD), mission=mission)
    with JsonLines[Record](tmp_path / TIMELINE_FILE) as lines:
        for number, (before, after) in enumerate([("IDLE", "RUNNING"), ("RUNNING", "SUCCEEDED")]):
            record = Record(
                id=f"mission#{number}",
                t=float(number),
                source="mission",
                kind=RecordKind.MISSION,
                subject="patrol",
                before=before,
                after=after,
            )
            lines.write(record)
    ((folder, _),) = write_reports(tmp_path, facts, None)
    assert f"Version {OLD} of `m600` was run" in (folder / "report.md").read_text()


@pytest.mark.parametrize("damaged", [False, True])
def test_a_run_that_goes_on_keeps_its_begin(tmp_path: Path, damaged: bool) -> None:
    write_facts(tmp_path, FACTS)
    begun = read_facts(tmp_path).begun
    assert begun is not None
    if damaged:
        (tmp_path / RUN_FILE).write_bytes(b"{")
    write_facts(tmp_path, FACTS, goes_on=True)
    again = read_facts(tmp_path).begun
    assert again is not None
    assert (again > begun) if damaged else (again == begun)
    write_facts(tmp_path, FACTS)
    latest = read_facts(tmp_path).begun
    assert latest is not None
    assert latest > again
