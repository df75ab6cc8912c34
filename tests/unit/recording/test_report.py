"""The report has the keys that were promised, says what happened, and never invents a figure."""

from __future__ import annotations

import io
import json
from pathlib import Path

import msgspec
import pytest
from rich.console import Console
from synthetic_mission import MISSION, SKILLSET, tell

from skillwing.services.history.history import History
from skillwing.services.history.report import (
    REPORT_FILE,
    JudgedFigure,
    MissionReport,
    ProcessEntry,
    make_report,
    read_report,
)
from skillwing.services.protocol import Record, RecordKind
from skillwing.services.report.rendering import REPORT_TEXT_FILE, figures, summary_table, write_report

KEYS = {
    "mission",
    "result",
    "seed",
    "sim_time_s",
    "wall_time_s",
    "real_time_factor",
    "judged",
    "switches",
    "skills",
    "processes",
    "missing",
}


def history() -> History:
    story = tell()
    return History.of(story.records, story.statuses, SKILLSET)


def full_report() -> MissionReport:
    return make_report(
        history(),
        mission=MISSION,
        seed=7,
        wall_time_s=20.0,
        judged=[
            JudgedFigure(key="pallets", name="pallets", value=3, text="3 of 4", is_problem=True),
            JudgedFigure(key="min_distance_m", name="least distance", value=2.35, text="2.35 m"),
        ],
        processes=[ProcessEntry(name="sim", state="stopped"), ProcessEntry(name="guidance", state="died", detail="-9")],
    )


def on_terminal(report: MissionReport) -> str:
    console = Console(file=io.StringIO(), width=100)
    console.print(summary_table(report))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_the_file_has_exactly_the_promised_keys(tmp_path: Path) -> None:
    write_report(full_report(), history(), tmp_path)
    content = json.loads((tmp_path / REPORT_FILE).read_text())
    assert set(content) == KEYS
    assert [set(figure) for figure in content["judged"]] == [{"key", "name", "value", "text", "is_problem"}] * 2
    assert all(
        set(skill) == {"skill", "goal_id", "t_start", "t_end", "terminal", "reason"} for skill in content["skills"]
    )
    assert [set(switch) for switch in content["switches"]] == [{"t", "cause"}]
    assert [link["subject"] for link in content["switches"][0]["cause"]] == [
        "zed blackout",
        "zed",
        "zed_status",
        "zed_depthmap",
        "branch",
    ]


def test_it_reads_back_as_it_was(tmp_path: Path) -> None:
    report = full_report()
    write_report(report, history(), tmp_path)
    assert read_report(tmp_path) == report


def test_figures_come_from_the_history() -> None:
    report = full_report()
    assert (report.result, report.sim_time_s, report.real_time_factor) == ("success", 36.1, 1.805)
    assert (report.judged_value("min_distance_m"), report.judged_value("unknown")) == (2.35, None)
    assert dict(figures(report))["robot time"] == "36.1 s", "it is not the time in the air"
    assert len(report.skills) == len(history().bars)


@pytest.mark.parametrize(
    ("phase", "result"),
    [("SUCCEEDED", "success"), ("FAILED", "failure"), ("ABORTED", "aborted"), ("RUNNING", "unfinished")],
)
def test_the_last_phase_is_the_result(phase: str, result: str) -> None:
    def record(number: int, before: str, after: str) -> Record:
        return Record(
            id=f"m#{number}",
            t=float(number),
            source="m",
            kind=RecordKind.MISSION,
            subject=MISSION,
            before=before,
            after=after,
        )

    records = [record(1, "IDLE", "RUNNING"), record(2, "RUNNING", phase)]
    assert make_report(History.of(records), mission=MISSION).result == result


def test_a_run_that_left_nothing_is_unfinished_and_claims_no_figures() -> None:
    report = make_report(History(), mission=MISSION)
    assert report.result == "unfinished"
    assert (report.judged, report.real_time_factor) == ((), None)
    assert on_terminal(report).count("not known") == 2


def test_the_table_tells_result_switch_and_deaths() -> None:
    text = on_terminal(full_report())
    for part in ("success", "3 of 4", "2.35 m", "switch at 20.5 s", "zed_depthmap RI", "guidance died", "seed 7"):
        assert part in text


def test_the_readable_report_tells_the_chain_link_by_link(tmp_path: Path) -> None:
    write_report(full_report(), history(), tmp_path, notes=["Poses are simulated."])
    text = (tmp_path / REPORT_TEXT_FILE).read_text()
    assert "# Mission `mapping`: success" in text
    assert "Poses are simulated." in text
    assert "1. 20.000 s  zed blackout ON" in text
    assert "| 6.4 | 12.0 | goto_straight | S_BLOCKED | an obstacle is 2.9 m ahead |  |" in text
    assert "| zed_ok: zed_status is FAILED | zed_status FAILED <- zed FAILED <- zed blackout ON |" in text
    assert text.endswith("| guidance | died | -9 |\n\nNothing happened to `sim`.\n")


def test_a_flight_is_as_long_as_its_mission(tmp_path: Path) -> None:
    """Later records are no part of it, nor of the wall time."""
    story = tell()
    story.resource(40.0, "battery_status", "LOW")
    after = History.of(story.records, story.statuses, SKILLSET)
    assert after.end == 40.0
    assert make_report(after, mission=MISSION).sim_time_s == 36.1
    unfinished = after.part(0.0, 36.0)
    assert make_report(unfinished, mission=MISSION).sim_time_s == 36.0


@pytest.mark.parametrize("text", ["the link is lost", "the link is lost."])
def test_why_a_mission_failed_stands_first_as_a_sentence(tmp_path: Path, text: str) -> None:
    end = Record(
        id="m#1",
        t=1.0,
        source="m",
        kind=RecordKind.MISSION,
        subject=MISSION,
        before="RUNNING",
        after="FAILED",
        text=text,
    )
    told = History.of([end])
    write_report(make_report(told, mission=MISSION), told, tmp_path)
    assert (tmp_path / REPORT_TEXT_FILE).read_text().splitlines()[2] == "the link is lost."


def test_the_schema_knows_no_more_than_the_file() -> None:
    assert {field.encode_name for field in msgspec.structs.fields(MissionReport)} == KEYS
