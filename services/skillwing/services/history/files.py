"""Files of a run's history: JSON lines, one message each, handed to the operating system at once.

`timeline.jsonl` holds every timeline record, `goals.jsonl` every change of a goal, and `missions.jsonl` the phases of
missions. They are readable up to the last line after every kind of crash, so pictures and reports are made from them.
The first two have numbered parts. The head of a part repeats older messages; a history does not count them twice.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Generic, Self, TypeVar

import msgspec

from skillwing.services.errors import BadRecordingError
from skillwing.services.history.parts import PART_BYTES, PartWriter, part_paths
from skillwing.services.protocol import PROTOCOL_VERSION, GoalStatus, Message, Record

TIMELINE_FILE = "timeline.jsonl"
GOALS_FILE = "goals.jsonl"
MISSIONS_FILE = "missions.jsonl"
UNBOUNDED = sys.maxsize
"""Size of the parts of a file that stays small."""
DISORDER = 10.0
"""Seconds by which messages in neighbouring parts may be out of order."""
_LAST_LINES = 1 << 20
"""Bytes at the end of a file within which its last line begins."""

M = TypeVar("M", bound=Message)


class Timed(msgspec.Struct):
    """The time of a line."""

    t: float


class Versioned(msgspec.Struct):
    """The protocol version of a line."""

    v: int


def _nothing() -> Iterable[Message]:
    return ()


class JsonLines(Generic[M]):
    """A file of messages in numbered parts, one JSON object a line, written when `write` returns.

    path: of the first part. An existing last part is continued, without an incomplete last line. part_bytes: size at
    which a part is full. head: messages that a new part begins with. A full disk costs messages and raises nothing
    (`PartWriter`).
    """

    def __init__(
        self, path: Path, *, part_bytes: int = PART_BYTES, head: Callable[[], Iterable[Message]] = _nothing
    ) -> None:
        for part in part_paths(path.parent, path.name)[-1:]:
            repair(part)
        self.parts = PartWriter(
            path.parent, path.name, part_bytes=part_bytes, head=lambda: b"".join(map(_line, head()))
        )

    def write(self, message: M) -> bool:
        """Append a message. Returns False if it is lost."""
        return self.parts.write(_line(message))

    def close(self) -> None:
        self.parts.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        self.close()


def _line(message: Message) -> bytes:
    return msgspec.json.encode(message) + b"\n"


def repair(path: Path) -> None:
    """Remove an incomplete last line, so that another writer can continue."""
    last = _end_of(path)
    if last and not last.endswith(b"\n"):
        with suppress(OSError):
            os.truncate(path, path.stat().st_size - len(last) + last.rfind(b"\n") + 1)


def read_records(run_dir: Path) -> list[Record]:
    """The timeline records of a run in order of their arrival; empty without a recording."""
    return list({record.id: record for record in iterate(run_dir, TIMELINE_FILE, Record)}.values())


def read_goals(run_dir: Path) -> list[GoalStatus]:
    """The goal changes of a run in order of their arrival; empty without a recording."""
    found: dict[tuple[object, ...], GoalStatus] = {}
    for status in iterate(run_dir, GOALS_FILE, GoalStatus):
        found.setdefault((status.goal_id, status.t, status.label, status.revision, status.record), status)
    return list(found.values())


def iterate(run_dir: Path, name: str, kind: type[M], begin: float = -math.inf, end: float = math.inf) -> Iterator[M]:
    """The messages of a file of a run, read line by line. Messages of heads come more than once.

    begin, end: robot times. Parts that hold nothing of that interval are left out; others are read whole. Raises
    BadRecordingError for a damaged line, and for messages of another protocol version.
    """
    parts = part_paths(run_dir, name)
    bounded = begin > -math.inf or end < math.inf
    ends = [last_time(path) if bounded else None for path in parts]
    for number, path in enumerate(parts):
        before, last = ends[number - 1] if number else None, ends[number]
        if last is not None and last < begin - DISORDER and number < len(parts) - 1:
            continue
        if before is not None and before > end + DISORDER:
            return
        yield from iterate_lines(path, kind)


def last_parts(run_dir: Path, name: str, kind: type[M], parts: int = 2) -> list[M]:
    """The messages of the last parts of a file. The head of a part holds what is still true of the parts before."""
    return [message for path in part_paths(run_dir, name)[-parts:] for message in iterate_lines(path, kind)]


def read_lines(path: Path, kind: type[M]) -> list[M]:
    """All messages of the file at that path, and of its further parts, without incomplete lines.

    Raises BadRecordingError for a damaged line, and for messages of another protocol version.
    """
    return list(iterate(path.parent, path.name, kind))


def iterate_lines(path: Path, kind: type[M]) -> Iterator[M]:
    """The messages of one file, without an incomplete last line. A file that was deleted meanwhile has none.

    Raises BadRecordingError for a damaged line, and for messages of another protocol version.
    """
    decoder = msgspec.json.Decoder(kind)
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return
    with file:
        for number, line in enumerate(file, 1):
            try:
                message = decoder.decode(line)
            except msgspec.DecodeError as error:
                if not line.endswith(b"\n"):
                    return
                _check_version(path, _version_of(line))
                text = f"Line {number} of {path} is damaged: {str(error).rstrip('.')}."
                raise BadRecordingError(
                    f"{text} Remove that line from a copy of the run, and read the copy."
                ) from error
            _check_version(path, message.v)
            yield message


def _check_version(path: Path, version: int) -> None:
    if version != PROTOCOL_VERSION:
        text = f"{path} was recorded with protocol {version}, and this Skillwing reads protocol {PROTOCOL_VERSION}."
        raise BadRecordingError(f"{text} Read it with the version that recorded it.")


def _version_of(line: bytes) -> int:
    """Version of a line that cannot be decoded; the present one if it has none."""
    with suppress(msgspec.DecodeError):
        return msgspec.json.decode(line, type=Versioned).v
    return PROTOCOL_VERSION


def last_time(path: Path) -> float | None:
    """Robot time of the last whole line of a file; None if it has none."""
    lines = _end_of(path).split(b"\n")
    for line in reversed(lines[:-1]):
        with suppress(msgspec.DecodeError, msgspec.ValidationError):
            return msgspec.json.decode(line, type=Timed).t
    return None


def _end_of(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - _LAST_LINES))
            return file.read()
    except OSError:
        return b""
