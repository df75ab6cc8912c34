"""Files of steps that end anywhere, are damaged, too many, of another version, or cannot be written."""

from __future__ import annotations

import errno
import logging
from pathlib import Path
from typing import Any

import msgspec
import pytest
from recorded_crane import CRANE, HEAD, RecordedLife

from skillwing.services.core.events import TimePassed
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT
from skillwing.services.errors import BadRecordingError
from skillwing.services.protocol import DataSample
from skillwing.services.replay.files import StepWriter, read_steps, step_files
from skillwing.services.replay.replaying import replay_folder
from skillwing.services.replay.steps import FORMAT, Head, Made

MADE = Made(0.0, None, EMPTY_SNAPSHOT, same_data=False)


def write(folder: Path, head: Head = HEAD) -> Path:
    """A file with a core and three steps."""
    writer = StepWriter(folder, head)
    writer.write(lambda: MADE)
    writer.close()
    life = RecordedLife(folder)
    life.take([(TimePassed(), 1.0), (DataSample(name="wind", value=3.0, t=2.0), 1.0), (TimePassed(), 1.0)])
    life.writer.close()
    return step_files(folder)[-1]


def test_what_could_not_be_finished_is_left_out_wherever_it_ends(tmp_path: Path) -> None:
    path = write(tmp_path)
    whole, content = read_steps(path), path.read_bytes()
    assert whole is not None
    assert whole.finished
    ends: set[int] = set()
    head = int.from_bytes(content[:4], "big") + 4
    for size in range(len(content)):
        path.write_bytes(content[:size])
        file = read_steps(path)
        if file is None:
            assert size < head
            continue
        assert file.lines == whole.lines[: len(file.lines)]
        if file.finished:
            ends.add(len(file.lines))
    assert ends == set(range(len(whole.lines)))


def test_an_unfinished_file_is_replayed_and_named(tmp_path: Path) -> None:
    path = write(tmp_path)
    path.write_bytes(path.read_bytes()[:-3])
    replayed = replay_folder(tmp_path)
    assert replayed.divergence is None
    assert replayed.unfinished == (path,)
    assert replayed.steps == 2


@pytest.mark.parametrize("content", [b"\x00\x00\x00\x03abc", b"\x00\x00\x00\x01\x05" * 3, b"\x00\x00\x00\x00rest"])
def test_what_is_no_such_file_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "1.msgpack").write_bytes(content)
    with pytest.raises(BadRecordingError, match=r"1\.msgpack does not hold .* Name the directory of a run\."):
        replay_folder(tmp_path)


def test_where_nothing_was_written_there_is_nothing_to_replay(tmp_path: Path) -> None:
    (tmp_path / "1.msgpack").write_bytes(b"\x00\x00")
    with pytest.raises(BadRecordingError, match=r"There are no steps .* Name the directory of a run"):
        replay_folder(tmp_path)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"format": FORMAT + 1}, f"its format is {FORMAT + 1}, this one reads {FORMAT}"),
        ({"schema": "0123456789abcdef"}, "written with version 0123456789abcdef of the skillset `crane`"),
        ({"text": HEAD.text.replace("OFF", "ON")}, "has errors today"),
    ],
)
def test_another_version_is_refused(tmp_path: Path, changes: dict[str, Any], sentence: str) -> None:
    writer = StepWriter(tmp_path, msgspec.structs.replace(HEAD, **changes))
    writer.write(lambda: MADE)
    with pytest.raises(BadRecordingError, match=f"{sentence}.*Replay it with the version that recorded it"):
        replay_folder(tmp_path)


def test_the_oldest_files_go(tmp_path: Path) -> None:
    writer = StepWriter(tmp_path, HEAD, files_kept=3)
    for _ in range(5):
        writer.begin_file(MADE)
    assert [path.stem for path in step_files(tmp_path)] == ["3", "4", "5"]


def test_two_processes_never_share_a_file(tmp_path: Path) -> None:
    writers = [StepWriter(tmp_path, HEAD) for _ in range(3)]
    for _ in range(2):
        for writer in writers:
            writer.write(lambda: MADE)
    files = [read_steps(path) for path in step_files(tmp_path)]
    assert [len(file.lines) for file in files if file is not None] == [2, 2, 2]


def test_a_full_disk_costs_the_steps_of_its_time(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    life = RecordedLife(tmp_path)
    life.take([(TimePassed(), 1.0)])

    class FullDisk:
        def write(self, _payload: bytes) -> int:
            raise OSError(errno.ENOSPC, "No space left on device")

        def close(self) -> None:
            pass

    room = [False]
    monkeypatch.setattr(life.writer, "_file", FullDisk())
    monkeypatch.setattr("skillwing.services.replay.files.has_room", lambda folder: room[0])
    with caplog.at_level(logging.WARNING):
        life.take([(TimePassed(), 1.0), (TimePassed(), 1.0)])
        assert replay_folder(tmp_path).steps == 1
        room[0] = True
        life.take([(TimePassed(), 1.0), (TimePassed(), 1.0), (TimePassed(), 1.0)])
    assert [record.message for record in caplog.records] == [
        "steps cannot be recorded now: [Errno 28] No space left on device",
        "steps are recorded again",
    ]
    replayed = replay_folder(tmp_path)
    assert (replayed.files, replayed.steps, replayed.divergence) == (2, 4, None)


def test_a_disk_with_room_for_half_a_line_gets_none_of_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = StepWriter(tmp_path, HEAD)
    writer.write(lambda: MADE)
    (path,) = step_files(tmp_path)
    whole = path.read_bytes()

    with path.open("r+b", buffering=0) as file:

        class NearlyFullDisk:
            def write(self, payload: bytes) -> int:
                file.seek(0, 2)
                return file.write(payload[: len(payload) // 2])

            def truncate(self, size: int) -> int:
                return file.truncate(size)

            def close(self) -> None:
                pass

        monkeypatch.setattr(writer, "_file", NearlyFullDisk())
        with caplog.at_level(logging.WARNING):
            writer.write(lambda: MADE)
    assert "no room for a whole line" in caplog.text
    assert path.read_bytes() == whole


def test_the_skillset_of_then_is_in_the_file(tmp_path: Path) -> None:
    file = read_steps(write(tmp_path))
    assert file is not None
    assert file.head.schema == CRANE.schema_hash
    assert file.head.text == HEAD.text
