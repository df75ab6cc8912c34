"""Files of recorded steps: `steps/1.msgpack`, `2.msgpack`, ... in the directory of a run.

Each process begins a file of its own, and another one when that is full; the oldest files are deleted. So no other
process continues a file: an unfinished line is its end. Each line is a message in MessagePack, after its length in four
bytes. The first one is a `Head`, the second a `Made`.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import msgspec

from skillwing.services.disk import has_room
from skillwing.services.errors import BadRecordingError
from skillwing.services.replay.steps import FORMAT, Head, Line, Made, decoded_head, decoded_line, encoded

ENDING = ".msgpack"
FILE_BYTES = 8 << 20
"""Size in bytes from which a file is full."""
FILES_KEPT = 16
_LENGTH = struct.Struct(">I")

log = logging.getLogger(__name__)


class StepWriter:
    """Writes the steps of one process. It must never stop the process.

    On a full disk steps are lost, and the log has a line. Another file begins when the disk has room again, with the
    state of that time. folder: of the files; it is not created before the first line.
    """

    def __init__(self, folder: Path, head: Head, *, file_bytes: int = FILE_BYTES, files_kept: int = FILES_KEPT) -> None:
        self._folder = folder
        self._head = head
        self._file_bytes = file_bytes
        self._files_kept = files_kept
        self._file: BinaryIO | None = None
        self._size = 0
        self._ended = False
        self._failing = False

    @property
    def full(self) -> bool:
        """True when another file is due, which `begin_file` begins."""
        return self._size >= self._file_bytes or (self._failing and has_room(self._folder))

    def begin_file(self, made: Made) -> None:
        """Continue in another file. made: arguments for a core that equals the present one."""
        self.close()
        failed, self._failing = self._failing, False
        self.write(lambda: made)
        if failed and not self._failing:
            log.warning("steps are recorded again")

    def write(self, make_line: Callable[[], Line]) -> None:
        """Write a line. The operating system has it when this returns, so that a killed process loses nothing.

        make_line: may raise for values without a form in MessagePack.
        """
        if self._ended or self._failing:
            return
        try:
            if self._file is None:
                self._file = self._next_file()
                self._put(self._file, self._head)
            self._put(self._file, make_line())
        except OSError as error:
            log.warning("steps cannot be recorded now: %s", error)
            self.close()
            self._failing = True
        except (TypeError, ValueError, OverflowError) as error:
            log.warning("steps cannot be recorded any more, and end here: %s", error)
            self.close()
            self._ended = True

    def close(self) -> None:
        """Idempotent."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._size = 0

    def _put(self, file: BinaryIO, line: Head | Line) -> None:
        payload = encoded(line)
        # One call, so that a process that dies leaves whole lines.
        whole = _LENGTH.pack(len(payload)) + payload
        if file.write(whole) < len(whole):
            file.truncate(self._size)
            raise OSError("the disk has no room for a whole line")
        self._size += len(whole)

    def _next_file(self) -> BinaryIO:
        self._folder.mkdir(parents=True, exist_ok=True)
        there = step_files(self._folder)
        for old in there[: max(0, len(there) + 1 - self._files_kept)]:
            old.unlink(missing_ok=True)
        number = int(there[-1].stem) + 1 if there else 1
        while True:
            try:
                return (self._folder / f"{number}{ENDING}").open("xb", buffering=0)
            except FileExistsError:
                number += 1


@dataclass(frozen=True, slots=True)
class StepFile:
    """Content of a file. finished: its last line is whole."""

    path: Path
    head: Head
    lines: tuple[Line, ...]
    finished: bool


def step_files(folder: Path) -> list[Path]:
    """Files of steps in a directory, in the order of their begin; none if the directory does not exist."""
    return sorted(
        (path for path in folder.glob(f"*{ENDING}") if path.stem.isdecimal()), key=lambda path: int(path.stem)
    )


def read_steps(path: Path) -> StepFile | None:
    """Read a file, also while it is written to; None for one that ends within its head.

    Raises BadRecordingError for another kind of file, or one of another version of Skillwing.
    """
    content = path.read_bytes()
    payloads = list(_payloads(content))
    if not payloads:
        return None
    used = sum(_LENGTH.size + len(payload) for payload in payloads)
    try:
        form = msgspec.msgpack.decode(payloads[0])
        written = form.get("format") if isinstance(form, dict) else None
        if isinstance(written, int) and written != FORMAT:
            text = f"{path} was written by another Skillwing: its format is {written}, this one reads {FORMAT}."
            raise BadRecordingError(f"{text} Replay it with the version that recorded it.")
        head = decoded_head(payloads[0])
        lines = tuple(decoded_line(payload) for payload in payloads[1:])
    except (msgspec.MsgspecError, ValueError) as error:
        text = f"{path} does not hold a resource manager's steps, or is damaged: {error}."
        raise BadRecordingError(f"{text} Name the directory of a run.") from error
    if lines and not isinstance(lines[0], Made):
        raise BadRecordingError(f"{path} is damaged: its first step has no core to take it. Name another run.")
    return StepFile(path, head, lines, finished=used == len(content))


def _payloads(content: bytes) -> Iterator[bytes]:
    """Payloads of the whole lines."""
    start = 0
    while start + _LENGTH.size <= len(content):
        (length,) = _LENGTH.unpack_from(content, start)
        start += _LENGTH.size
        if start + length > len(content):
            return
        yield content[start : start + length]
        start += length
