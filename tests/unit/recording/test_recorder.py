"""A recorder on the in-process bus: what it writes can be read back, by people's tools and by ours."""

from __future__ import annotations

import errno
import os
import shutil
import struct
import subprocess
import sys
from itertools import count
from pathlib import Path
from unittest.mock import patch

import msgspec
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st
from rerun.chunk import RrdReader
from synthetic_mission import MISSION, SKILLSET, Story, Teller, tell

from held_objects import items_held
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.errors import BadRecordingError
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, JsonLines, read_goals, read_records
from skillwing.services.history.history import PHASES, History
from skillwing.services.history.mission_intervals import mission_intervals, read_phases
from skillwing.services.history.parts import part_paths
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.recording_state import read_state
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import (
    PROTOCOL_VERSION,
    Ending,
    GoalStatus,
    Keys,
    MissionPhase,
    MissionStatus,
    NodeStatus,
    Record,
    RecordKind,
    State,
    Terminal,
    TreeNode,
    TreeSnapshot,
    encode,
)
from skillwing.services.recording.mission_view import MissionView, causes_in_words, in_lines
from skillwing.services.recording.options import RecorderOptions
from skillwing.services.recording.recorder import RECORDING_FILE, Recorder
from skillwing.services.recording.retention import KEEP
from skillwing.services.recording.rrd_messages import RrdMessages


def record(story: Story, run_dir: Path, *, extra: bytes | None = None) -> Recorder:
    network = InProcessNetwork()
    recorder = Recorder(RecorderOptions(run_dir=str(run_dir), skillset="m600.skillset"), SKILLSET)
    network.attach(recorder)
    network.attach(Teller(story))
    if extra is not None:
        network.bus("stranger").advertise(Keys(SKILLSET.name).timeline).put(extra)
    network.run_for(40.0)
    recorder.detach()
    return recorder


def states_of(run_dir: Path, lane: str, file: str = RECORDING_FILE) -> dict[float, str]:
    """State of a lane from each time on; of several rows at one time the latest counts."""
    chunks = RrdReader(str(run_dir / file)).stream().filter(content=lane).to_chunks()
    rows: list[tuple[float, bytes, str]] = []
    for chunk in chunks:
        batch = chunk.to_record_batch()
        columns = {name: batch.column(name) for name in batch.schema.names}
        state = next((name for name in columns if name.endswith("StateChange:state")), None)
        if state is None:
            continue
        for row in range(batch.num_rows):
            t = columns["mission_time"][row].value / 1e9
            rows.append((t, columns["rerun.controls.RowId"][row].as_py(), columns[state][row].as_py()[0]))
    return {t: state for t, _, state in sorted(rows)}


def logged(run_dir: Path, content: str) -> list[str]:
    """Lines of the recording's log."""
    chunks = RrdReader(str(run_dir / RECORDING_FILE)).stream().filter(content=content).to_chunks()
    return [
        text
        for batch in (chunk.to_record_batch() for chunk in chunks)
        for name in batch.schema.names
        if name.endswith("TextLog:text")
        for row in batch.column(name).to_pylist()
        for text in row
    ]


def test_the_journal_tells_the_whole_story(tmp_path: Path) -> None:
    story = tell()
    recorder = record(story, tmp_path)
    assert sorted(r.id for r in read_records(tmp_path)) == sorted(r.id for r in story.records)
    read = History.of(read_records(tmp_path), read_goals(tmp_path), SKILLSET)
    assert read.bars == recorder.history.bars == History.of(story.records, story.statuses).bars


def test_bars_of_the_recording_take_the_colour_of_their_ending(tmp_path: Path) -> None:
    record(tell(), tmp_path)
    assert states_of(tmp_path, "/skills/03_goto_straight") == {
        6.4: "S_BLOCKED",
        12.0: "",
        12.2: "IT",
        21.5: "",
    }
    assert states_of(tmp_path, "/skills/02_zed_depthmap") == {6.2: "RI", 20.53: ""}


def test_a_refused_goal_has_no_bar(tmp_path: Path) -> None:
    record(tell(), tmp_path)
    assert states_of(tmp_path, "/skills/05_goto") == {21.6: "S_ARRIVED", 29.8: ""}


def test_resources_begin_in_their_initial_state(tmp_path: Path) -> None:
    record(tell(), tmp_path)
    assert states_of(tmp_path, "/resources/01_zed_status") == {0.0: "UNKNOWN", 0.5: "OK", 20.51: "FAILED"}
    assert states_of(tmp_path, "/resources/02_depthmap_source") == {0.0: "NONE", 6.2: "ZED", 20.52: "NONE"}


def test_tree_and_causes_are_in_the_recording(tmp_path: Path) -> None:
    record(tell(), tmp_path)
    assert RrdReader(str(tmp_path / RECORDING_FILE)).stream().filter(content="/tree/**").to_chunks()
    texts = logged(tmp_path, "/log/mission")
    switch = next(row for row, text in enumerate(texts) if text.startswith("SWITCH"))
    assert texts[switch : switch + 3] == [
        "SWITCH ZED branch -> LiDAR branch",
        "    <- zed_depthmap RI <- zed_status FAILED",
        "    <- zed FAILED <- zed blackout ON",
    ]
    ended = logged(tmp_path, "/log/goal")
    assert ended[ended.index("zed_depthmap RI") + 1] == "    <- zed_status FAILED <- zed FAILED", "not its own steps"


def test_each_phase_of_a_mission_is_logged_once_and_before_it_begins_what_it_waits_for(tmp_path: Path) -> None:
    story = tell()
    for t, lacking in ((0.1, "home"), (0.2, "home"), (0.3, "GNSS")):
        status = MissionStatus(
            mission=MISSION, phase=MissionPhase.IDLE, t=t, text=f"waiting: {lacking}", waypoint=0, waypoints=0
        )
        story.messages.append((t, status))
    record(story, tmp_path)
    texts = logged(tmp_path, "/log/**")
    for phase in ("RUNNING", "SUCCEEDED"):
        assert sum(text.startswith(f"{MISSION} {phase}") for text in texts) == 1
    assert sorted(text for text in texts if "waiting" in text) == [f"{MISSION} waiting: {x}" for x in ("GNSS", "home")]


def test_the_tree_of_a_second_mission_begins_without_the_visits_of_the_first() -> None:
    view, rows = MissionView(rr.RecordingStream("a-test"), SKILLSET), list[int]()

    def show(status: NodeStatus) -> None:
        nodes = (
            TreeNode(index=0, parent=None, name="root", kind="Selector", status=NodeStatus.RUNNING),
            TreeNode(index=1, parent=0, name="branch", kind="Sequence", status=status),
            TreeNode(index=2, parent=1, name="leaf", kind="Skill", status=status),
        )
        view.show_tree(TreeSnapshot(mission="m", t=1.0, nodes=nodes))
        rows.append(len(view._layout.boxes))

    begin = Record(id="m#1", t=0.0, source="m", kind=RecordKind.MISSION, subject="m", before="IDLE", after="RUNNING")
    for status in (NodeStatus.FAILURE, NodeStatus.INVALID):
        show(status)
    view.show_record(msgspec.structs.replace(begin, id="m#2"), History(SKILLSET))
    show(NodeStatus.INVALID)
    assert rows == [3, 3, 2]


def test_of_a_long_chain_the_nearest_causes_and_the_root_are_shown() -> None:
    def told(length: int) -> list[str]:
        words = causes_in_words([f"cause {number}" for number in range(length)])
        return [line.strip() for line in in_lines(words, 12)]

    assert told(7) == [f"<- cause {number}" for number in (6, 5, 4, 3, 2, 1, 0)]
    assert told(9) == [
        "<- cause 8",
        "<- cause 7",
        "<- cause 6",
        "<- cause 5",
        "<- cause 4",
        "<- ... 3 more",
        "<- cause 0",
    ]


@given(st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), min_size=1, max_size=300))
def test_a_line_of_the_log_that_does_not_fit_goes_on_below(text: str) -> None:
    lines = in_lines(text, 40)
    assert " ".join(lines).split() == text.split()
    assert all(len(line) <= 40 or " " not in line.strip() for line in lines)
    assert all(line.startswith("    ") for line in lines[1:])


def test_a_message_that_is_none_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    story = tell()
    record(story, tmp_path, extra=b"\xc1 not a record")
    assert len(read_records(tmp_path)) == len(story.records)
    assert "Left out a message" in caplog.text


def test_a_viewer_that_is_gone_at_the_end_is_no_failure(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flush(stream: rr.RecordingStream, *, timeout_sec: float) -> None:
        raise RuntimeError("gRPC has been unable to connect")

    monkeypatch.setattr(rr.RecordingStream, "flush", flush)
    record(tell(), tmp_path)
    assert "did not receive the end" in caplog.text
    assert states_of(tmp_path, "/skills/02_zed_depthmap") == {6.2: "RI", 20.53: ""}


def test_without_rerun_the_timeline_is_still_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    for module in ("rerun_stream", "mission_view"):
        monkeypatch.delitem(sys.modules, f"skillwing.services.recording.{module}", raising=False)
    story = tell()
    record(story, tmp_path)
    assert len(read_records(tmp_path)) == len(story.records)
    assert not (tmp_path / RECORDING_FILE).exists()
    assert "skillwing[viewer]" in caplog.text


def test_a_journal_that_was_cut_off_is_read_up_to_the_cut(tmp_path: Path) -> None:
    story = tell()
    record(story, tmp_path)
    file = tmp_path / TIMELINE_FILE
    file.write_bytes(file.read_bytes()[:-20])
    assert len(read_records(tmp_path)) == len(story.records) - 1


def test_a_recording_of_another_protocol_is_refused_with_what_to_do(tmp_path: Path) -> None:
    with JsonLines[Record](tmp_path / TIMELINE_FILE) as lines:
        for version in (PROTOCOL_VERSION, 1):
            lines.write(
                Record(v=version, id="a", t=0.0, source="x", kind=RecordKind.GOAL, subject="x", before=None, after="y")
            )
    sentence = rf"was recorded with protocol 1, .* reads protocol {PROTOCOL_VERSION}\. Read it with the version that"
    with pytest.raises(BadRecordingError, match=sentence):
        read_records(tmp_path)


def test_a_recorder_that_is_started_again_goes_on_where_the_first_one_died(tmp_path: Path) -> None:
    story = tell()
    record(story, tmp_path / "whole")
    shutil.copytree(tmp_path / "whole", tmp_path / "run")
    file = tmp_path / "run" / TIMELINE_FILE
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    again = record(story, tmp_path / "run")
    written = read_records(tmp_path / "run")
    assert sorted(each.id for each in written) == sorted(each.id for each in story.records)
    assert read_goals(tmp_path / "run") == read_goals(tmp_path / "whole")
    assert again.history.bars == History.of(story.records, story.statuses).bars
    assert (tmp_path / "run" / RECORDING_FILE).read_bytes() == (tmp_path / "whole" / RECORDING_FILE).read_bytes()
    shown = states_of(tmp_path / "run", "/skills/02_zed_depthmap", file="recording-2.rrd")
    assert shown == {6.2: "RI", 20.53: ""}


def goal(state: State, t: float, terminal: Terminal | None = None, *, source: str = "skill/goto") -> GoalStatus:
    return GoalStatus(
        goal_id="g", skill="goto", state=state, t=t, terminal=terminal, record=f"{source}#{t}", source=source
    )


def lost(goal_id: str, t: float) -> Record:
    return Record(
        id=f"{RESOURCE_MANAGER}#{t}",
        t=t,
        source=RESOURCE_MANAGER,
        kind=RecordKind.GOAL,
        subject="goto",
        before=None,
        after="LOST",
        text="The manager `skill/goto` was lost: silent for 2.0 s.",
        goal_id=goal_id,
    )


DONE = Terminal(ending=Ending.SUCCEEDED, reason="arrived", result="ARRIVED", success=True)


def test_a_lost_goal_has_its_end_in_the_recording_and_no_later_one(tmp_path: Path) -> None:
    """The manager exited before it could publish one. A manager that hung publishes another one when it goes on."""
    story = Story()
    story.messages = [
        (1.0, goal(State.RUNNING, 1.0)),
        (3.0, lost("g", 3.0)),
        (9.0, goal(State.TERMINATED, 9.0, DONE)),
    ]
    record(story, tmp_path)
    (end,) = [each for each in read_goals(tmp_path) if each.terminal is not None]
    assert (end.goal_id, end.label, end.t, end.source) == ("g", "LOST", 3.0, RESOURCE_MANAGER)
    assert end.terminal is not None
    assert end.terminal.detected_by == RESOURCE_MANAGER
    (bar,) = History.of(read_records(tmp_path), read_goals(tmp_path)).bars
    assert (bar.terminal, bar.t_start, bar.t_end) == ("LOST", 1.0, 3.0)
    record(story, tmp_path)
    assert [each.label for each in read_goals(tmp_path)] == ["RUNNING", "LOST"], "another recorder adds nothing"


def test_a_lost_goal_of_which_nothing_else_was_recorded_is_no_refused_one(tmp_path: Path) -> None:
    story = Story()
    story.messages = [(3.0, lost("g", 3.0))]
    record(story, tmp_path)
    (bar,) = History.of(read_records(tmp_path), read_goals(tmp_path)).bars
    assert (bar.terminal, bar.refused) == ("LOST", False)


@pytest.mark.parametrize("keep", [KEEP, 0])
def test_parts_tell_the_same_story_as_one_file(tmp_path: Path, keep: int, monkeypatch: pytest.MonkeyPatch) -> None:
    story = tell()
    if not keep:
        monkeypatch.setattr("skillwing.services.recording.recorder.part_bytes", lambda keep: 1500)
    record(story, tmp_path)
    parts = part_paths(tmp_path, TIMELINE_FILE)
    assert (len(parts) > 3) == (keep == 0)
    read = History.of(read_records(tmp_path), read_goals(tmp_path), SKILLSET)
    whole = History.of(story.records, story.statuses, SKILLSET)
    assert (read.bars, read.lanes, read.switches) == (whole.bars, whole.lanes, whole.switches)
    phases = [each for each in story.records if each.kind is RecordKind.MISSION and each.after in PHASES]
    assert list(read_phases(tmp_path).records) == phases


def test_the_last_part_alone_has_the_present_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("skillwing.services.recording.recorder.part_bytes", lambda keep: 1500)
    story = tell()
    record(story, tmp_path)
    for path in (*part_paths(tmp_path, TIMELINE_FILE)[:-1], *part_paths(tmp_path, GOALS_FILE)[:-1]):
        path.unlink()
    left = History.of(read_records(tmp_path), read_goals(tmp_path), SKILLSET)
    whole = History.of(story.records, story.statuses, SKILLSET)
    assert {name: spans[-1].state for name, spans in left.lanes.items()} == {
        name: spans[-1].state for name, spans in whole.lanes.items()
    }
    latest = {bar.skill: bar for bar in whole.bars}
    assert latest.items() <= {bar.skill: bar for bar in left.bars}.items()


def test_parts_of_a_recording_are_one_recording_and_can_be_opened_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("skillwing.services.recording.recorder.part_bytes", lambda keep: 1)
    record(tell(), tmp_path)
    parts = part_paths(tmp_path, RECORDING_FILE)
    assert len(parts) > 2
    bars: dict[float, str] = {}
    names: set[str] = set()
    for path in parts:
        reader = RrdReader(str(path))
        names |= {store.recording_id for store in reader.recordings()}
        lanes = {chunk.entity_path for chunk in reader.stream().filter(content="/skills/**").to_chunks()}
        if "/skills/02_zed_depthmap" in lanes:
            bars |= states_of(tmp_path, "/skills/02_zed_depthmap", file=path.name)
    assert bars == {6.2: "RI", 20.53: ""}
    assert names == {tmp_path.name}


def test_a_recording_has_no_index_that_would_grow_in_memory(tmp_path: Path) -> None:
    record(tell(), tmp_path)
    messages = RrdMessages().feed((tmp_path / RECORDING_FILE).read_bytes())[1:]
    kinds = [struct.unpack_from("<Q", message)[0] for message in messages]
    assert len(kinds) > 20
    assert 0 not in kinds, "Rerun ends a file that has an index with a message of this kind"


SETTINGS = """
import os, sys
from pathlib import Path
from skillwing.m600.robot import ROBOT
from skillwing.services.recording.recorder import make_recorder
(spec,) = ROBOT.observers({"run_dir": sys.argv[1]})
assert "rerun" not in sys.modules, "Rerun reads its settings when it is imported"
make_recorder(spec.resolved().options)
print(os.environ["MIMALLOC_PURGE_DELAY"], os.environ["RUST_LOG"])
"""


def test_rerun_gets_its_settings_before_it_is_imported_and_keeps_those_of_the_user(tmp_path: Path) -> None:
    said = subprocess.run(
        [sys.executable, "-c", SETTINGS, str(tmp_path)],
        env={**os.environ, "RUST_LOG": "error"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert said.stdout.split() == ["0", "error"]


@given(st.binary(max_size=200), st.lists(st.integers(1, 60)))
def test_a_recording_is_split_at_the_same_places_however_it_comes(tail: bytes, sizes: list[int]) -> None:
    messages = [b"H" * 12, *(struct.pack("<QQ", kind, 5 * kind) + b"x" * 5 * kind for kind in (1, 3, 2))]
    end = struct.pack("<QQ", 0, 3) + b"end"
    stream = b"".join([*messages, end, tail])
    splitter, got, begin = RrdMessages(), list[bytes](), 0
    for size in [*sizes, len(stream)]:
        got += splitter.feed(stream[begin : begin + size])
        begin += size
    assert got[:5] == [*messages, end]
    assert b"".join(got) == stream


def record_on_a_full_disk(story: Story, run_dir: Path, *parts: tuple[float, bool]) -> None:
    """Record a story in parts, each with its seconds, and True for a disk that has room meanwhile."""
    room = [parts[0][1]]
    write = os.write

    def full_at_times(file: int, data: bytes) -> int:
        if not room[0] and data:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data)

    network = InProcessNetwork()
    recorder = Recorder(RecorderOptions(run_dir=str(run_dir), skillset="m600.skillset"), SKILLSET)
    with (
        patch("skillwing.services.history.parts.os.write", full_at_times),
        patch("skillwing.services.recording.recorder.has_room", lambda folder: room[0]),
    ):
        network.attach(recorder)
        network.attach(Teller(story))
        for seconds, has_room in parts:
            room[0] = has_room
            network.run_for(seconds)
        recorder.detach()


def test_a_full_disk_is_in_the_timeline_and_costs_what_came_meanwhile(tmp_path: Path) -> None:
    story = tell()
    record_on_a_full_disk(story, tmp_path, (10.0, True), (10.0, False), (20.0, True))
    kept = read_records(tmp_path)
    own = [each for each in kept if each.subject == "recorder"]
    assert [(each.before, each.after) for each in own][-1] == ("FAILED", "RECORDING")
    assert "No space left on device. Missing:" in own[-1].text
    missing = [each for each in story.records if each not in kept]
    assert missing
    assert all(9.0 <= each.t <= 22.0 for each in missing)
    (gap,) = read_state(tmp_path).gaps
    assert gap.end is not None
    assert gap.lost[TIMELINE_FILE] >= len(missing)
    lanes = History.of(kept, read_goals(tmp_path), SKILLSET).lanes
    whole = History.of(story.records, story.statuses, SKILLSET).lanes
    assert {name: spans[-1].state for name, spans in lanes.items()} == {
        name: spans[-1].state for name, spans in whole.items()
    }, "states that changed meanwhile are known again"


def test_a_mission_that_begins_on_a_full_disk_is_known_afterwards(tmp_path: Path) -> None:
    record_on_a_full_disk(tell(), tmp_path, (10.0, False), (5.0, True), (5.0, False), (20.0, True))
    (mission,) = mission_intervals(read_phases(tmp_path).records)
    assert (mission.begin, mission.end, mission.phase) == (1.0, 36.1, MissionPhase.SUCCEEDED)


def test_a_recorder_begins_beside_a_damaged_timeline(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    record(tell(), tmp_path / "run")
    file = tmp_path / "run" / TIMELINE_FILE
    file.write_bytes(b"".join(b"\0\n" if n == 2 else line for n, line in enumerate(file.open("rb"))))
    with pytest.raises(BadRecordingError, match=rf"Line 3 of {file} is damaged: .*\. Remove that line from a copy"):
        read_records(tmp_path / "run")
    record(tell(), tmp_path / "run")
    assert "What was recorded before is not shown. Line 3 of" in caplog.text


def test_the_memory_of_a_recorder_does_not_grow_with_the_run(tmp_path: Path) -> None:
    network = InProcessNetwork()
    recorder = Recorder(RecorderOptions(run_dir=str(tmp_path), skillset="m600.skillset"), SKILLSET)
    recorder.history = RecentHistory(SKILLSET, records=500, goals=100)
    network.attach(recorder)
    bus, keys, number = network.bus("skill/goto"), Keys(SKILLSET.name), count()
    publisher = bus.advertise(keys.status("goto"), events=True)

    def run(goals: int) -> int:
        for goal_id in (f"g{next(number)}" for _ in range(goals)):
            for state, end in ((State.RUNNING, None), (State.TERMINATED, DONE)):
                status = msgspec.structs.replace(
                    goal(state, bus.now(), end), goal_id=goal_id, record=f"x#{goal_id}{state}"
                )
                publisher.put(encode(status))
            network.run_for(0.01)
        return items_held([recorder.history, recorder._records, recorder._goals, recorder._upkeep, recorder._recording])

    run(2500)
    held = run(500)
    assert run(1000) <= held + 200
    recorder.detach()
