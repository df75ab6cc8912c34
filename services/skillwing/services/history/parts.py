"""Numbered parts of a growing file: `timeline.jsonl`, `timeline-2.jsonl`, `timeline-3.jsonl`, ...

A part that is full is never written again, so that old parts can be deleted. Each part begins with a head, so that it
can be read without the parts before it.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

PART_BYTES = 16_000_000
"""Size in bytes at which a part is full."""


def part_paths(folder: Path, name: str) -> tuple[Path, ...]:
    """The existing parts of a file, oldest first. name: of the first one, such as `timeline.jsonl`."""
    first = Path(name)
    numbered = {
        number: path
        for path in folder.glob(f"{first.stem}*{first.suffix}")
        if (number := _number(path.stem, first.stem)) is not None
    }
    return tuple(numbered[number] for number in sorted(numbered))


def next_part(folder: Path, name: str) -> Path:
    """Path of a new part. Numbers of deleted parts are not used again, as long as one part is left."""
    there = part_paths(folder, name)
    if not there:
        return folder / name
    first = Path(name)
    number = _number(there[-1].stem, first.stem) or 1
    return folder / f"{first.stem}-{number + 1}{first.suffix}"


def _number(stem: str, first: str) -> int | None:
    if stem == first:
        return 1
    rest = stem.removeprefix(f"{first}-")
    return int(rest) if rest != stem and rest.isdecimal() and int(rest) > 1 else None


def _no_head() -> bytes:
    return b""


class PartWriter:
    """Appends blocks to the parts of a file. A block is written whole, or not at all.

    A full disk costs the blocks of its time. `retry` allows another attempt, which begins a new part: its head holds
    what is needed from the time without writing.

    folder, name: of the first part. part_bytes: size at which a part is full, without its head. head: first bytes of a
    new part. resume: continue the last part that exists; otherwise begin a new one.
    """

    def __init__(
        self,
        folder: Path,
        name: str,
        *,
        part_bytes: int = PART_BYTES,
        head: Callable[[], bytes] = _no_head,
        resume: bool = True,
    ) -> None:
        self.name = name
        self.part_bytes = part_bytes
        self.head = head
        self.failure = ""
        """Reason of the operating system for the latest failure; empty while writing works."""
        self.lost = 0
        """Number of blocks that were lost since the last `take_lost`."""
        self._folder = folder
        self._file: int | None = None
        self._size = self._head_size = 0
        self._waits = False
        there = part_paths(folder, name)
        if resume and there:
            self._open(there[-1], os.O_APPEND)

    @property
    def path(self) -> Path | None:
        """The part that is being written; None before the first block and after a failure."""
        return None if self._file is None else self._path

    def write(self, block: bytes) -> bool:
        """Append a block. Returns False if it is lost."""
        if self._waits:
            self.lost += 1
            return False
        own = self._size - self._head_size
        if self._file is not None and own and own + len(block) > self.part_bytes:
            self.close()
        try:
            if self._file is None:
                self._begin_part()
            self._append(block)
        except OSError as error:
            self.failure = error.strerror or str(error)
            self._waits = True
            self.lost += 1
            self.close()
            return False
        self.failure = ""
        return True

    def retry(self) -> None:
        """Begin a new part after a failure. A quiet robot must not seem to have a full disk, so no block is needed."""
        self._waits = False
        if self.failure:
            self.write(b"")
            self.lost -= bool(self.failure)

    def take_lost(self) -> int:
        """The number of lost blocks, which is set back."""
        lost, self.lost = self.lost, 0
        return lost

    def close(self) -> None:
        """Close the present part. Idempotent; another block begins a new part."""
        if self._file is not None:
            with suppress(OSError):
                os.close(self._file)
            self._file = None
        self._size = self._head_size = 0

    def _begin_part(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        self._open(next_part(self._folder, self.name), os.O_CREAT | os.O_EXCL)
        try:
            self._append(self.head())
            self._head_size = self._size
        except OSError:
            self._path.unlink(missing_ok=True)
            raise

    def _open(self, path: Path, flags: int) -> None:
        self._path = path
        with suppress(OSError):
            self._size = path.stat().st_size
        self._file = os.open(path, os.O_WRONLY | os.O_CLOEXEC | os.O_APPEND | flags, 0o666)

    def _append(self, block: bytes) -> None:
        assert self._file is not None
        if block and os.write(self._file, block) < len(block):
            self._cut()
            raise OSError(28, "No space left on device", str(self._path))
        self._size += len(block)

    def _cut(self) -> None:
        """Remove a block that was written in part."""
        assert self._file is not None
        with suppress(OSError):
            os.ftruncate(self._file, self._size)
