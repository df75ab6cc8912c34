"""Reports of missions in long runs: they read the parts of their mission, and say what is missing."""

from __future__ import annotations

from pathlib import Path

import pytest
from synthetic_mission import MISSION, SKILLSET

from skillwing.services.history.files import GOALS_FILE, MISSIONS_FILE, TIMELINE_FILE, JsonLines
from skillwing.services.history.mission_intervals import mission_intervals, read_phases
from skillwing.services.history.parts import part_paths
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.recording_state import Gap, RecordingState, StateFile
from skillwing.services.history.report import MissionReport
from skillwing.services.protocol import Ending, GoalStatus, Message, Record, RecordKind, State, Terminal
from skillwing.services.report.mission_report import ReportedMission, read_history, report_mission

DONE = Terminal(ending=Ending.SUCCEEDED, reason="arrived", result="ARRIVED", success=True)
LENGTH = 1000.0
"""Seconds of each mission."""
MISSIONS = 5


def messages() -> list[Message]:
    """Missions that follow one another, with a goal each ten seconds, and a change long before them."""
    told: list[Message] = [record(1, 0.5, RecordKind.RESOURCE, "zed_status", "OK")]
    number = 1
    for mission in range(MISSIONS):
        begin = mission * LENGTH + 1.0
        told.append(record(number := number + 1, begin, RecordKind.MISSION, MISSION, "RUNNING", "IDLE"))
        for step in range(99):
            t = begin + 10.0 * step
            told.append(record(number := number + 1, t, RecordKind.RESOURCE, "axes_authority", "USED"))
            for state, terminal in ((State.RUNNING, None), (State.TERMINATED, DONE)):
                goal_id = f"g{mission}-{step}"
                told.append(GoalStatus(goal_id=goal_id, skill="goto", state=state, t=t + 1.0, terminal=terminal))
        told.append(record(number := number + 1, begin + 995.0, RecordKind.MISSION, MISSION, "SUCCEEDED", "RUNNING"))
    return told


def record(number: int, t: float, kind: RecordKind, subject: str, after: str, before: str | None = None) -> Record:
    return Record(id=f"x#{number}", t=t, source="x", kind=kind, subject=subject, before=before, after=after)


def write(run_dir: Path, part_bytes: int) -> None:
    """Write them as a recorder does."""
    history = RecentHistory(SKILLSET, records=100, goals=20)
    with (
        JsonLines[Record](
            run_dir / TIMELINE_FILE, part_bytes=part_bytes, head=lambda: history.lasting_records
        ) as records,
        JsonLines[GoalStatus](
            run_dir / GOALS_FILE, part_bytes=part_bytes, head=lambda: history.lasting_statuses
        ) as goals,
        JsonLines[Record](run_dir / MISSIONS_FILE) as missions,
    ):
        for message in messages():
            if isinstance(message, Record):
                history.add_record(message)
                records.write(message)
                if message.kind is RecordKind.MISSION:
                    missions.write(message)
            elif isinstance(message, GoalStatus):
                history.add_status(message)
                goals.write(message)


def report(run_dir: Path, number: int) -> MissionReport:
    each = mission_intervals(read_phases(run_dir).records)[number]
    assert each.end is not None
    mission = ReportedMission(
        mission=MISSION, run_dir=run_dir, folder=run_dir / str(number), begin=each.begin, end=each.end
    )
    return report_mission(mission, SKILLSET)


def test_a_report_from_parts_is_that_from_one_file(tmp_path: Path) -> None:
    write(tmp_path / "one", 1 << 30)
    write(tmp_path / "parts", 10_000)
    assert len(part_paths(tmp_path / "parts", TIMELINE_FILE)) > 5
    for number in (0, 2, MISSIONS - 1):
        whole = report(tmp_path / "one", number)
        assert report(tmp_path / "parts", number) == whole
        assert len(whole.skills) == 99
        assert (whole.result, whole.missing) == ("success", ())


def test_a_mission_whose_parts_were_deleted_says_so_and_others_do_not(tmp_path: Path) -> None:
    write(tmp_path, 10_000)
    state = RecordingState(keep=100)
    for name in (TIMELINE_FILE, GOALS_FILE):
        for path in part_paths(tmp_path, name)[:-2]:
            state = state.with_deleted(name, path.stat().st_size, (MISSIONS - 2) * LENGTH)
            path.unlink()
    state = state.with_gap(Gap(begin=4300.0, end=4310.0, why="No space left on device", lost={GOALS_FILE: 3}))
    StateFile(tmp_path).write(state)
    early, late = report(tmp_path, 1), report(tmp_path, MISSIONS - 1)
    assert early.skills == ()
    assert "was deleted to keep the run below 100 B" in early.missing[0]
    assert early.missing[0] in (tmp_path / "1" / "report.md").read_text(encoding="utf-8")
    assert late.missing == (
        "Nothing could be written from 4300.00 s to 4310.00 s: No space left on device. Missing: 3 in goals.jsonl.",
    )
    lanes = report_lanes(tmp_path)
    assert lanes["zed_status"] == "OK", "the head of a part has states of long ago"


def report_lanes(run_dir: Path) -> dict[str, str]:
    lanes = read_history(run_dir, SKILLSET, (MISSIONS - 1) * LENGTH, MISSIONS * LENGTH).lanes
    return {name: spans[-1].state for name, spans in lanes.items()}


def test_a_mission_with_too_many_goals_is_reported_with_its_last_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("skillwing.services.report.mission_report.MOST_GOALS", 20)
    write(tmp_path, 10_000)
    found = report(tmp_path, 3)
    assert [skill.goal_id for skill in found.skills] == [f"g3-{step}" for step in range(79, 99)]
    assert "the last 20 goals" in found.missing[0]
    assert report(tmp_path, 3).result == "success"
