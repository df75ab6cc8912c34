"""Checkpoints of a journal's write-ahead log, on a thread of their own."""

from __future__ import annotations

import sqlite3
import threading
from contextlib import closing, suppress
from pathlib import Path

WRITES_BETWEEN = 100
"""Steps between two checkpoints. Their pages are fewer than the 1000 at which SQLite makes one within a commit."""

CHECKPOINT = "checkpoint"
"""Name of the thread."""


class Checkpoints:
    """Checkpoints beside the writes to a journal.

    A checkpoint waits for the disk, some milliseconds or, on a memory card, much longer. SQLite would make it within a
    commit, and a goal would wait for it.
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
            self._thread = threading.Thread(target=self._checkpoint, name=CHECKPOINT, daemon=True)
            self._thread.start()

    def finish(self) -> None:
        """Wait for the checkpoint under way, so that the file may be closed or moved."""
        if self._thread is not None:
            self._thread.join()

    def _checkpoint(self) -> None:
        # The writer finds out by itself that the disk is full or the file is gone.
        with suppress(sqlite3.Error), closing(sqlite3.connect(self._address, uri=True)) as connection:
            connection.execute("PRAGMA wal_checkpoint(PASSIVE)")
