"""Lock of a run's recorder, by which `runs prune` finds out that a run is being written."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from skillwing.services.history.recording_state import STATE_FILE


class RecordingLock:
    """The lock on `recording.json`. The kernel releases it at every end of the process.

    A file that cannot be opened, as on a disk that is full at the begin, is locked at a later call of `hold`.
    """

    def __init__(self, run_dir: Path) -> None:
        self._path = run_dir / STATE_FILE
        self._file: int | None = None

    def hold(self) -> None:
        """Take the lock if it is not held. Idempotent."""
        if self._file is not None:
            return
        try:
            self._file = os.open(self._path, os.O_RDWR | os.O_CLOEXEC)
            fcntl.flock(self._file, fcntl.LOCK_SH)
        except OSError:
            return

    def release(self) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None


def is_recorded(run_dir: Path) -> bool:
    """True while a recorder writes to that directory."""
    try:
        file = os.open(run_dir / STATE_FILE, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    else:
        return False
    finally:
        os.close(file)
