"""Files of a run's history: JSON lines, one message each, flushed at once.

`timeline.jsonl` holds every timeline record and `goals.jsonl` every change of a goal. They are readable up to the last
line after every kind of crash, so pictures and reports are made from them.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Generic, Self, TypeVar

import msgspec

from skillwing.services.errors import BadRecordingError, PassingError
from skillwing.services.protocol import PROTOCOL_VERSION, GoalStatus, Message, Record

TIMELINE_FILE = "timeline.jsonl"
GOALS_FILE = "goals.jsonl"

M = TypeVar("M", bound=Message)


class JsonLines(Generic[M]):
    """An append-only file of messages, one JSON object a line, written when `write` returns.

    `write` raises PassingError if it fails, as on a full disk.
    """

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab", buffering=0)

    def write(self, message: M) -> None:
        try:
            self._file.write(msgspec.json.encode(message) + b"\n")
        except OSError as error:
            raise PassingError(f"{self._file.name} cannot be written: {error.strerror}.") from error

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None):
        self.close()


def repair(path: Path) -> None:
    """Remove an incomplete last line, so that another writer can continue."""
    if path.exists() and not (content := path.read_bytes()).endswith(b"\n"):
        with path.open("r+b") as file:
            file.truncate(content.rfind(b"\n") + 1)


def read_records(run_dir: Path) -> list[Record]:
    """The timeline records of a run in order of their arrival; empty without a recording."""
    return read_lines(run_dir / TIMELINE_FILE, Record)


def read_goals(run_dir: Path) -> list[GoalStatus]:
    """The goal changes of a run in order of their arrival; empty without a recording."""
    return read_lines(run_dir / GOALS_FILE, GoalStatus)


def read_lines(path: Path, kind: type[M]) -> list[M]:
    """All messages of the file, without an incomplete last line.

    Raises BadRecordingError for messages of another protocol version.
    """
    if not path.exists():
        return []
    *lines, unfinished = path.read_bytes().split(b"\n")
    messages = [msgspec.json.decode(line, type=kind) for line in lines]
    if unfinished:
        with suppress(msgspec.DecodeError):
            messages.append(msgspec.json.decode(unfinished, type=kind))
    other = next((message.v for message in messages if message.v != PROTOCOL_VERSION), None)
    if other is not None:
        text = f"{path} was recorded with protocol {other}, and this Skillwing reads protocol {PROTOCOL_VERSION}."
        raise BadRecordingError(f"{text} Read it with the version that recorded it.")
    return messages
