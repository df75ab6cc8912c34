"""The files in which steps are written down: `steps/1.msgpack`, `2.msgpack`, ... in the directory of a run.

Each process begins a file of its own, and another one when that is full; the oldest ones go. So a file is never
continued by somebody else: what a killed process could not finish is its end, and nothing comes after it. Each line is
a message in MessagePack, after its length in four bytes. The first one is a `Head`, the second a `Made`.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import msgspec

from skillwing.services.replay.errors import BadStepsError
from skillwing.services.replay.steps import FORMAT, Head, Line, Made, decoded_head, decoded_line, encoded

ENDING = ".msgpack"
FILE_BYTES = 8 << 20
"""Bytes from which on a file is full."""
FILES_KEPT = 16
_LENGTH = struct.Struct(">I")

log = logging.getLogger(__name__)


class StepWriter:
    """Writes the steps of one process. It must never be in the way of what it writes down: where it cannot write, the
    log says so once, and it ends.

    folder: of the files; nothing is made before the first line.
    """

    def __init__(self, folder: Path, head: Head, *, file_bytes: int = FILE_BYTES, files_kept: int = FILES_KEPT) -> None:
        self._folder = folder
        self._head = head
        self._file_bytes = file_bytes
        self._files_kept = files_kept
        self._file: BinaryIO | None = None
        self._size = 0
        self._ended = False

    @property
    def full(self) -> bool:
        """Another file is due, which begins with `begin_file`."""
        return self._size >= self._file_bytes

    def begin_file(self, made: Made) -> None:
        """Go on in another file, with a core that knows all that the present one does."""
        self.close()
        self.write(lambda: made)

    def write(self, make_line: Callable[[], Line]) -> None:
        """Write a line; the system has it when this returns, so that the death of the process does not matter.

        make_line: makes it, which may fail for what has no form in MessagePack.
        """
        if self._ended:
            return
        try:
            if self._file is None:
                self._file = self._next_file()
                self._put(self._file, self._head)
            self._put(self._file, make_line())
        except (OSError, TypeError, ValueError, OverflowError) as error:
            log.warning("the steps cannot be written down any more, and end here: %s", error)
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
            except FileExistsError:  # another process was faster
                number += 1


@dataclass(frozen=True, slots=True)
class StepFile:
    """What a file holds. finished: its last line is whole."""

    path: Path
    head: Head
    lines: tuple[Line, ...]
    finished: bool


def step_files(folder: Path) -> list[Path]:
    """The files of steps in a directory, in the order in which they were begun; none where there is no directory."""
    return sorted(
        (path for path in folder.glob(f"*{ENDING}") if path.stem.isdecimal()), key=lambda path: int(path.stem)
    )


def read_steps(path: Path) -> StepFile | None:
    """Read a file, also while it is written to; None for one that ends within its head.

    Raises BadStepsError for what no such file holds, or another version of Skillwing has written.
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
            raise BadStepsError(f"{text} Replay it with the version that flew.")
        head = decoded_head(payloads[0])
        lines = tuple(decoded_line(payload) for payload in payloads[1:])
    except (msgspec.MsgspecError, ValueError) as error:
        text = f"{path} does not hold a resource manager's steps, or is damaged: {error}."
        raise BadStepsError(f"{text} Name the directory of a run.") from error
    if lines and not isinstance(lines[0], Made):
        raise BadStepsError(f"{path} is damaged: its first step has no core to take it. Name another run.")
    return StepFile(path, head, lines, finished=used == len(content))


def _payloads(content: bytes) -> Iterator[bytes]:
    """The whole ones."""
    start = 0
    while start + _LENGTH.size <= len(content):
        (length,) = _LENGTH.unpack_from(content, start)
        start += _LENGTH.size
        if start + length > len(content):
            return
        yield content[start : start + length]
        start += length
