"""One part of `recording.rrd`, written by this process and not by Rerun.

Rerun writes into a pipe, and a thread reads it. So a full disk neither blocks Rerun nor keeps it from its end.
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

from skillwing.services.history.parts import PartWriter
from skillwing.services.recording.rrd_messages import RrdMessages

_CHUNK = 1 << 18
CLOSE_TIMEOUT = 2.0
"""Longest wait for the end of the thread [wall s]: the disk may hang."""


class RecordingFile:
    """The next part of a recording. Any thread may call its methods.

    A failure is final: what comes later is read and lost, and another part has to begin. folder, name: of the first
    part. `sink` is the path that Rerun writes to.
    """

    def __init__(self, folder: Path, name: str) -> None:
        reading, self._writing = os.pipe()
        self.sink = f"/dev/fd/{self._writing}"
        self.size = 0
        """Bytes that were written."""
        self._parts = PartWriter(folder, name, part_bytes=sys.maxsize, resume=False)
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._drain, args=(reading,), name="recording", daemon=True)
        self._thread.start()

    def opened(self) -> None:
        """Rerun has opened the sink: from now on the pipe ends when Rerun closes it."""
        os.close(self._writing)

    @property
    def failure(self) -> str:
        """The reason why nothing can be written; empty while all is well."""
        with self._lock:
            return self._parts.failure

    def take_lost(self) -> int:
        """The number of lost messages of Rerun, which is set back."""
        with self._lock:
            return self._parts.take_lost()

    def close(self) -> None:
        """Wait for what Rerun has written last. Call it after Rerun has closed the sink."""
        self._thread.join(CLOSE_TIMEOUT)

    def _drain(self, reading: int) -> None:
        messages = RrdMessages()
        while data := os.read(reading, _CHUNK):
            whole = messages.feed(data)
            with self._lock:
                for message in whole:
                    if self._parts.write(message):
                        self.size += len(message)
        with self._lock:
            self._parts.close()
        os.close(reading)
