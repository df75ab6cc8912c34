"""Parts of growing files: every accepted block is there once, whole, whatever the disk does."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.services.history.files import JsonLines, iterate, last_time, read_records, repair
from skillwing.services.history.parts import PartWriter, next_part, part_paths
from skillwing.services.protocol import Record, RecordKind

HEAD = b"[head]"
REAL_WRITE = os.write


class Disk:
    """A disk that takes `room` more bytes; None for any number."""

    def __init__(self) -> None:
        self.room: int | None = None

    def write(self, file: int, data: bytes) -> int:
        if self.room is None:
            return REAL_WRITE(file, data)
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = REAL_WRITE(file, data[: self.room])
        self.room -= taken
        return taken


BLOCKS = st.binary(min_size=1, max_size=12).map(lambda data: b"<" + data.hex().encode() + b">")
DISK = st.one_of(st.none(), st.integers(0, 40))


@given(st.lists(st.one_of(BLOCKS, st.tuples(DISK)), max_size=40), st.integers(20, 80))
@settings(max_examples=150)
def test_accepted_blocks_are_there_in_order_and_others_leave_no_trace(
    events: list[bytes | tuple[int | None]], part_bytes: int
) -> None:
    disk, accepted = Disk(), []
    with TemporaryDirectory() as folder, patch("skillwing.services.history.parts.os.write", disk.write):
        writer = PartWriter(Path(folder), "x.bin", part_bytes=part_bytes, head=lambda: HEAD)
        lost = 0
        for event in events:
            if isinstance(event, tuple):
                disk.room = event[0]
                writer.retry()
            elif writer.write(event):
                accepted.append(event)
            else:
                lost += 1
        assert writer.take_lost() == lost
        assert writer.take_lost() == 0
        writer.close()
        parts = [path.read_bytes() for path in part_paths(Path(folder), "x.bin")]
    assert all(part.startswith(HEAD) for part in parts)
    assert b"".join(part.removeprefix(HEAD) for part in parts) == b"".join(accepted)
    assert all(len(part) <= part_bytes + len(HEAD) or part.count(b"<") == 1 for part in parts)


def test_a_failure_has_its_reason_until_writing_works_again(tmp_path: Path) -> None:
    disk = Disk()
    with patch("skillwing.services.history.parts.os.write", disk.write):
        writer = PartWriter(tmp_path, "x.bin", head=lambda: HEAD)
        assert writer.write(b"one")
        disk.room = 0
        assert not writer.write(b"two")
        assert writer.failure == "No space left on device"
        writer.retry()
        assert writer.failure, "the disk is still full"
        disk.room = None
        writer.retry()
        assert not writer.failure
        assert writer.take_lost() == 1, "attempts without a block lose none"
    assert [path.name for path in part_paths(tmp_path, "x.bin")] == ["x.bin", "x-2.bin"]
    writer.close()


def test_parts_are_counted_on_when_the_first_ones_are_deleted(tmp_path: Path) -> None:
    for name in ("x.jsonl", "x-2.jsonl", "x-10.jsonl", "x-0.jsonl", "x-two.jsonl", "xy.jsonl"):
        (tmp_path / name).touch()
    assert [path.name for path in part_paths(tmp_path, "x.jsonl")] == ["x.jsonl", "x-2.jsonl", "x-10.jsonl"]
    (tmp_path / "x.jsonl").unlink()
    assert next_part(tmp_path, "x.jsonl").name == "x-11.jsonl"


def record(number: int, t: float) -> Record:
    return Record(id=f"r{number}", t=t, source="x", kind=RecordKind.GOAL, subject="x", before=None, after="y")


def test_parts_are_read_as_one_file_without_their_heads(tmp_path: Path) -> None:
    records = [record(number, float(number)) for number in range(100)]
    written: list[Record] = []
    with JsonLines[Record](tmp_path / "timeline.jsonl", part_bytes=2000, head=lambda: written[-3:]) as file:
        for each in records:
            file.write(each)
            written.append(each)
    assert len(part_paths(tmp_path, "timeline.jsonl")) > 5
    assert sorted(read_records(tmp_path), key=lambda each: each.t) == records


@pytest.mark.parametrize(("begin", "end"), [(0.0, 30.0), (45.0, 55.0), (90.0, 99.0), (-5.0, -1.0), (200.0, 300.0)])
def test_parts_of_other_times_are_not_read(tmp_path: Path, begin: float, end: float) -> None:
    with JsonLines[Record](tmp_path / "timeline.jsonl", part_bytes=1000) as file:
        for number in range(100):
            file.write(record(number, float(number)))
    read = list(iterate(tmp_path, "timeline.jsonl", Record, begin, end))
    within = {number for number in range(100) if begin <= number <= end}
    assert within <= {int(each.t) for each in read}
    assert len(read) <= len(within) + 50


def test_a_line_that_was_cut_off_is_removed_before_another_writer_continues(tmp_path: Path) -> None:
    path = tmp_path / "timeline.jsonl"
    with JsonLines[Record](path) as file:
        file.write(record(1, 1.0))
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"v":2,"id":"r')
    assert last_time(path) == 1.0
    repair(path)
    assert path.read_bytes() == whole
