"""A small disk in memory that can be filled to its last byte, for tests of full disks. Only root can mount it."""

from __future__ import annotations

import os
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

FILLER = "filler"
"""Name of the file that takes the room."""
_AGAIN = 0.02
"""Wall seconds between two looks for room that somebody has made."""


def obstacle() -> str | None:
    """Reason why this process cannot mount a disk; None if it may try."""
    return None if os.geteuid() == 0 else "only root can mount a small disk"


@contextmanager
def mounted(place: Path, size: int) -> Iterator[Path]:
    """A disk of that many bytes at a new folder. Raises OSError."""
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise OSError(f"no disk can be mounted at {place}: {done.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)


def fill(disk: Path, leave: int = 0) -> None:
    """Fill a disk to its last byte, or but for some bytes."""
    content = memoryview(bytes(1 << 16))
    with (disk / FILLER).open("ab", buffering=0) as file:
        for size in (1 << 16, 1 << 12, 1):
            try:
                while (free := os.statvfs(disk).f_bavail * 4096) > leave:
                    if not file.write(content[: min(size, free - leave)]):
                        break
            except OSError:
                continue


def free(disk: Path) -> None:
    """Give the room back."""
    (disk / FILLER).unlink()


@contextmanager
def full(disk: Path) -> Iterator[None]:
    """Keep a disk full, also if somebody deletes files on it meanwhile."""
    over = threading.Event()

    def keep_full() -> None:
        while not over.wait(_AGAIN):
            with suppress(OSError):
                if os.statvfs(disk).f_bavail:
                    fill(disk)

    fill(disk)
    thread = threading.Thread(target=keep_full, name="filler")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        free(disk)
