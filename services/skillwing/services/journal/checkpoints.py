"""Checkpoints of a journal's write-ahead log, on a thread of their own."""

from __future__ import annotations

import sqlite3
import threading
from contextlib import closing, suppress
from pathlib import Path

WRITES_BETWEEN = 100
"""Steps between two checkpoints."""
ATTEMPTS = 3
"""Repetitions of a checkpoint to which a write has come in between. Only a complete one lets the log begin again."""
CHECKPOINT = "checkpoint"
"""Name of the thread."""


class Checkpoints:
    """Checkpoints beside the writes to a journal.

    A checkpoint waits for the disk twice, some milliseconds or, on a memory card, much longer. SQLite would make it
    within a commit, and a goal would wait for it. It still does so when the log has 1000 pages, after hundreds
    of steps without a pause. What is left in other commits is one wait for the head of a log that begins again.
    """

    def __init__(self, path: Path) -> None:
        self._address = f"{path.absolute().as_uri()}?mode=rw"
        self._writes = 0
        self._thread: threading.Thread | None = None

    def note_write(self) -> None:
        """Count a step, and begin a checkpoint if one is due."""
        self._writes += 1
        if self._writes >= WRITES_BETWEEN and (self._thread is None or not self._thread.is_alive()):
            self._writes = 0
            thread = threading.Thread(target=self._checkpoint, name=CHECKPOINT, daemon=True)
            with suppress(RuntimeError):  # no more threads: SQLite makes the checkpoint itself, later
                thread.start()
                self._thread = thread

    def finish(self) -> None:
        """Wait for the checkpoint under way, so that the file may be closed or moved."""
        if self._thread is not None:
            self._thread.join()

    def _checkpoint(self) -> None:
        # The writer finds out by itself that the disk is full or the file is gone.
        with suppress(sqlite3.Error), closing(sqlite3.connect(self._address, uri=True)) as connection:
            for _ in range(ATTEMPTS):
                _, pages, done = connection.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()
                if done == pages:
                    return
