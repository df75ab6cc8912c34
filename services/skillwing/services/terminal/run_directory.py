"""Directory of a run: made for it alone, and used by one system at a time."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from itertools import count
from pathlib import Path

from skillwing.services.disk import FULL, UnwritableError
from skillwing.services.errors import InvalidOptionError
from skillwing.services.terminal.output import relative_path


def make_run_dir(given: Path | None, command: str) -> Path:
    """The directory of a run, which exists on return; its default name has the time and the command.

    A default name is of one run only: another run of that second gets `-2` behind it. Raises InvalidOptionError for a
    directory that cannot be made, and UnwritableError for a full disk.
    """
    path = (given or Path("runs") / f"{datetime.now().astimezone():%Y%m%d-%H%M%S}-{command}").absolute()
    try:
        if given is None:
            return _make_next(path)
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if error.errno in FULL:
            raise UnwritableError(path, error) from error
        text = f"`{relative_path(path)}` cannot be made: {error.strerror}. Choose another directory with --run-dir."
        raise InvalidOptionError("run-dir", text) from error
    return path


def _make_next(path: Path) -> Path:
    """Make that directory, or the first of `-2`, `-3` and so on that does not exist."""
    for number in count(1):
        free = path if number == 1 else path.with_name(f"{path.name}-{number}")
        try:
            free.mkdir(parents=True)
        except FileExistsError:
            continue
        return free
    raise AssertionError


def is_claimed(run_dir: Path) -> bool:
    """True while a system of any user runs in a directory, or starts or ends there."""
    try:
        with claimed(run_dir):
            return False
    except InvalidOptionError:
        return True
    except OSError:  # it cannot be opened, or is gone
        return False


@contextmanager
def claimed(run_dir: Path) -> Iterator[None]:
    """Be the only system that runs in a directory; raises InvalidOptionError if another one does.

    The kernel releases the lock at every end of this process.
    """
    folder = os.open(run_dir, os.O_RDONLY | os.O_CLOEXEC)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            text = f"A system runs in {relative_path(run_dir)} already. Choose another directory, or stop it first."
            raise InvalidOptionError("run-dir", text) from error
        yield
    finally:
        os.close(folder)
