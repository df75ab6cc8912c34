"""Room on the disk of a run, and sentences for a disk that takes nothing."""

from __future__ import annotations

import errno
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path

from skillwing.services.errors import SkillwingError
from skillwing.services.sizes import size_text

ROOM_TO_BEGIN = 32_000_000
"""Free bytes that a run needs at its begin: the journal reserves 8 MB, the rest is for logs and the first records."""
ROOM_TO_GO_ON = 2_000_000
"""Free bytes from which a recording is continued after a full disk."""
FREE_SOME = "Free some, choose another disk with --run-dir, or delete old runs with `skillwing runs prune`."


FULL = (errno.ENOSPC, errno.EDQUOT)
"""Error numbers of a full disk."""


class UnwritableError(SkillwingError):
    """A file that cannot be written, so that the command cannot go on.

    path: of the file or directory. full: the disk is full, and may have room later.
    """

    def __init__(self, path: Path, error: OSError) -> None:
        self.path = path
        self.full = error.errno in FULL
        remedy = FREE_SOME if self.full else "Choose another with --run-dir."
        super().__init__(f"`{path}` cannot be written: {error.strerror or error}. {remedy}")


def free_bytes(path: Path) -> int | None:
    """Bytes that this user can still write on the disk of a path, of its nearest parent if it is missing. None if that
    is unknown."""
    for each in (path, *path.parents):
        try:
            found = os.statvfs(each)
        except FileNotFoundError:
            continue
        except OSError:
            return None
        return found.f_bavail * found.f_frsize
    return None


def has_room(path: Path) -> bool:
    """True if a recording on that disk can continue. An unknown room counts as enough."""
    free = free_bytes(path)
    return free is None or free >= ROOM_TO_GO_ON


def require_room(run_dir: Path) -> None:
    """Raise SkillwingError if a run in that directory would find its disk full."""
    free = free_bytes(run_dir)
    if free is not None and free < ROOM_TO_BEGIN:
        least = size_text(ROOM_TO_BEGIN)
        raise SkillwingError(
            f"There is no room for a run in `{run_dir}`: {size_text(free)} are free, it needs {least}. {FREE_SOME}"
        )


def directory_size(path: Path) -> int:
    """Bytes that the files of a directory take on the disk."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with suppress(OSError):  # it was deleted meanwhile
                entry = (Path(folder) / name).lstat()
                if stat.S_ISREG(entry.st_mode):
                    total += entry.st_blocks * 512
    return total


def discard_unwritten() -> None:
    """Discard output that its file does not take. Python would end with another exit code for it."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
