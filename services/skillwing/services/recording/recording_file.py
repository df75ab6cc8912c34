"""`recording.rrd` in parts, written by this process and not by Rerun.

Rerun writes into a pipe, and a thread reads it. So a disk that is full neither blocks Rerun nor keeps it from its end,
and a recording continues in another part. A part begins with the blueprint and what else came before the data.
"""

from __future__ import annotations

import fcntl
import os
import struct
import sys
import termios
import threading
import time
from pathlib import Path

from skillwing.services.history.parts import PartWriter
from skillwing.services.recording.rrd_messages import RrdMessages

_CHUNK = 1 << 18
SETTLE_TIMEOUT = 1.0
"""Longest wait until the thread has read what Rerun has written [wall s]."""
CLOSE_TIMEOUT = 2.0
"""Longest wait for the end of the thread [wall s]: the disk may hang."""


class RecordingFile:
    """The parts of a recording. Any thread may call its methods.

    folder, name: of the first part. part_bytes: size at which a part is full. `sink` is the path that Rerun writes to.
    """

    def __init__(self, folder: Path, name: str, part_bytes: int) -> None:
        self._reading, self._writing = os.pipe()
        self.sink = f"/dev/fd/{self._writing}"
        self.name = name
        self._part_bytes = part_bytes
        self._parts = PartWriter(folder, name, part_bytes=sys.maxsize, head=self._make_head, resume=False)
        self._messages = RrdMessages()
        self._prefix = bytearray()
        self._prefix_complete = False
        self._begun = 0
        self._lock = threading.Lock()
        self._restate = False
        self._thread = threading.Thread(target=self._drain, name="recording", daemon=True)
        self._thread.start()

    def opened(self) -> None:
        """Rerun has opened the sink: from now on the pipe ends when Rerun closes it."""
        os.close(self._writing)

    def end_prefix(self) -> None:
        """All that was written so far is to begin each part. Call it after a flush of Rerun."""
        deadline = time.monotonic() + SETTLE_TIMEOUT
        while time.monotonic() < deadline:
            with self._lock:
                if self._messages.whole and not _waiting(self._reading):
                    break
            time.sleep(0.002)
        with self._lock:
            self._prefix_complete = True
            self._parts.part_bytes = self._part_bytes
            self._parts.end_head()

    def take_restate(self) -> bool:
        """True once after a new part has begun, which lacks the static data of the parts before."""
        with self._lock:
            restate, self._restate = self._restate, False
        return restate

    @property
    def failure(self) -> str:
        """The reason why nothing can be written; empty while all is well."""
        with self._lock:
            return self._parts.failure

    def retry(self) -> None:
        """Try again after a failure."""
        with self._lock:
            self._parts.retry()

    def take_lost(self) -> int:
        """The number of lost messages of Rerun, which is set back."""
        with self._lock:
            return self._parts.take_lost()

    def close(self) -> None:
        """Wait for what Rerun has written last. Call it after Rerun has closed the sink."""
        self._thread.join(CLOSE_TIMEOUT)

    def _make_head(self) -> bytes:
        self._begun += 1
        self._restate = self._begun > 1
        return bytes(self._prefix) if self._begun > 1 else b""

    def _drain(self) -> None:
        while data := os.read(self._reading, _CHUNK):
            with self._lock:
                for message in self._messages.feed(data):
                    if not self._prefix_complete:
                        self._prefix += message.content
                    # The index at the end is that of the whole stream, which fits a file of one part only.
                    if not message.ends or self._begun == 1:
                        self._parts.write(message.content)
        with self._lock:
            self._parts.close()
        os.close(self._reading)


def _waiting(pipe: int) -> int:
    """Bytes in a pipe."""
    (count,) = struct.unpack("i", fcntl.ioctl(pipe, termios.FIONREAD, b"\0" * 4))
    return count
