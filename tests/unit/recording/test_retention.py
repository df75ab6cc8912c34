"""Deleted parts: the oldest, so many as are needed, and none of a mission that runs."""

from __future__ import annotations

import os
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE
from skillwing.services.history.recording_state import RecordingState
from skillwing.services.names import STEPS_FOLDER
from skillwing.services.recording.retention import KEEP, Part, Retention, deletable, part_bytes
from skillwing.services.recording.upkeep import AFTER_MISSION, Upkeep

PARTS = st.lists(
    st.builds(
        Part,
        path=st.integers(0, 1000).map(lambda number: Path(f"x-{number}.jsonl")),
        name=st.just("x.jsonl"),
        size=st.integers(0, 100),
        written=st.integers(0, 50).map(float),
        present=st.booleans(),
    ),
    unique_by=lambda part: part.path,
)


@given(PARTS, st.integers(0, 1000), st.one_of(st.none(), st.integers(0, 50).map(float)))
def test_the_oldest_go_until_the_rest_fits(parts: list[Part], keep: int, since: float | None) -> None:
    gone = deletable(parts, keep, since)
    stay = [part for part in parts if part not in gone]
    free = [part for part in stay if not part.present and (since is None or part.written < since)]
    assert sum(part.size for part in stay) <= keep or not free
    assert not any(part.present or (since is not None and part.written >= since) for part in gone)
    assert all(part.written <= other.written for part in gone for other in free)
    assert not gone or sum(part.size for part in stay) + gone[-1].size > keep, "none too many"


def write(path: Path, size: int, written: float, t: float = 0.0) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    line = f'{{"t":{t}}}\n'.encode()
    path.write_bytes(b" " * (size - len(line)) + line)
    os.utime(path, (written, written))


def test_parts_of_all_files_are_one_pool_and_what_went_is_noted(tmp_path: Path) -> None:
    write(tmp_path / TIMELINE_FILE, 100, 1.0, 11.0)
    write(tmp_path / GOALS_FILE, 100, 2.0, 12.0)
    write(tmp_path / STEPS_FOLDER / "1.msgpack", 100, 3.0)
    write(tmp_path / "timeline-2.jsonl", 100, 4.0, 14.0)
    write(tmp_path / "goals-2.jsonl", 100, 5.0)
    write(tmp_path / STEPS_FOLDER / "2.msgpack", 100, 6.0)
    write(tmp_path / "timeline-3.jsonl", 100, 7.0)
    write(tmp_path / "report.md", 1000, 0.0)
    state = Retention(tmp_path, 400).apply(RecordingState())
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"timeline-2.jsonl", "goals-2.jsonl", "steps/2.msgpack", "timeline-3.jsonl", "report.md"}
    assert {name: (each.parts, each.until) for name, each in state.deleted.items()} == {
        TIMELINE_FILE: (1, 11.0),
        GOALS_FILE: (1, 12.0),
        STEPS_FOLDER: (1, None),
    }


def test_parts_give_way_to_the_folders_of_missions_which_stay(tmp_path: Path) -> None:
    for number in range(1, 6):
        write(tmp_path / (TIMELINE_FILE if number == 1 else f"timeline-{number}.jsonl"), 100, float(number))
    write(tmp_path / "1-rounds" / "report.json", 150, 2.0)
    write(tmp_path / "12-rounds" / "map.npz", 50, 3.0)
    Retention(tmp_path, 400).apply(RecordingState())
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {"timeline-4.jsonl", "timeline-5.jsonl", "1-rounds/report.json", "12-rounds/map.npz"}


def test_nothing_of_a_mission_that_runs_is_deleted_and_all_of_it_may_be_later(tmp_path: Path) -> None:
    for number, written in enumerate((10.0, 30.0, 50.0), 2):
        write(tmp_path / f"timeline-{number}.jsonl", 100, written)
    upkeep = Upkeep(tmp_path, (), Retention(tmp_path, 100), lambda: True)
    upkeep.mission_runs(20.0)
    upkeep.delete_old_parts(60.0)
    assert [path.name for path in sorted(tmp_path.glob("timeline*"))] == ["timeline-3.jsonl", "timeline-4.jsonl"]
    upkeep.mission_is_over(60.0)
    upkeep.delete_old_parts(61.0)
    assert len(list(tmp_path.glob("timeline*"))) == 2, "its report is made from them"
    upkeep.delete_old_parts(60.0 + AFTER_MISSION)
    assert [path.name for path in tmp_path.glob("timeline*")] == ["timeline-4.jsonl"]


def test_missions_that_follow_one_another_keep_only_their_own_files(tmp_path: Path) -> None:
    upkeep = Upkeep(tmp_path, (), Retention(tmp_path, 0), lambda: True)
    for number in range(100):
        begin = 100.0 * number
        write(tmp_path / f"timeline-{number + 2}.jsonl", 100, begin)
        upkeep.mission_runs(begin)
        upkeep.mission_runs(begin + 1.0)
        upkeep.mission_is_over(begin + 95.0)
        upkeep.delete_old_parts(begin + 99.0)
        since = upkeep.state.mission_since
        assert since is not None
        assert begin - 100.0 <= since <= begin
    assert len(list(tmp_path.glob("timeline*"))) <= 3


def test_the_end_of_one_mission_keeps_the_files_of_another_at_a_shared_robot(tmp_path: Path) -> None:
    upkeep = Upkeep(tmp_path, (), Retention(tmp_path, 0), lambda: True)
    upkeep.mission_runs(10.0, "left")
    upkeep.mission_runs(20.0, "right")
    upkeep.mission_is_over(30.0, "left")
    upkeep.delete_old_parts(31.0 + AFTER_MISSION)
    assert upkeep.state.mission_since == 20.0
    upkeep.mission_is_over(200.0)
    upkeep.delete_old_parts(201.0 + AFTER_MISSION)
    assert upkeep.state.mission_since is None


def test_another_recorder_keeps_the_files_of_the_mission_that_the_first_one_saw_begin(tmp_path: Path) -> None:
    first = Upkeep(tmp_path, (), Retention(tmp_path, 100), lambda: True)
    first.mission_runs(20.0)
    first.check(0.0)
    again = Upkeep(tmp_path, (), Retention(tmp_path, 100), lambda: True)
    assert again.state == replace_keep(first.state)
    again.mission_runs(90.0)
    assert again.state.mission_since == 20.0


def replace_keep(state: RecordingState) -> RecordingState:
    return RecordingState(keep=100, mission_since=state.mission_since, deleted=state.deleted, gaps=state.gaps)


def test_a_small_run_has_small_parts() -> None:
    assert part_bytes(KEEP) == 16_000_000
    assert part_bytes(100_000_000) == 1_000_000
