"""Rows of logs and lanes on their way to Rerun, many in one call."""

from __future__ import annotations

from collections.abc import Callable

import rerun as rr

MOST_ROWS = 5000
"""Rows that wait for others at most. Each call makes a chunk of each entity, and a kilobyte of the file."""


class RowBuffer:
    """Rows of text logs and state lanes that wait to be sent, by entity.

    A call for each row would convert each value into an Arrow array of its own, which takes three times as long.

    timeline: of the rows' times. wake: called when the first row waits, to have `send` called soon. Rows that nobody
    sends are sent when there are `MOST_ROWS`.
    """

    def __init__(self, recording: rr.RecordingStream, timeline: str) -> None:
        self._recording = recording
        self._timeline = timeline
        self._lines: dict[str, list[tuple[float, str, str]]] = {}
        self._states: dict[str, list[tuple[float, str]]] = {}
        self._waiting = 0
        self.wake: Callable[[], object] = lambda: None

    def add_line(self, entity: str, t: float, text: str, level: str) -> None:
        """Add a line of a log. t: seconds of the timeline."""
        self._lines.setdefault(entity, []).append((t, text, level))
        self._note_row()

    def add_state(self, entity: str, t: float, state: str) -> None:
        """Add a state of a lane from `t` on, in seconds of the timeline. Of two for one `t` the later one counts."""
        self._states.setdefault(entity, []).append((t, state))
        self._note_row()

    def send(self) -> None:
        """Send all rows that wait."""
        lines, self._lines = self._lines, {}
        states, self._states = self._states, {}
        self._waiting = 0
        for entity, logged in lines.items():
            times, texts, levels = zip(*logged, strict=True)
            self._send(entity, times, rr.TextLog.columns(text=texts, level=levels))
        for entity, changes in states.items():
            times, values = zip(*changes, strict=True)
            self._send(entity, times, rr.StateChange.columns(state=values))

    def _send(self, entity: str, times: tuple[float, ...], columns: rr.ComponentColumnList) -> None:
        self._recording.send_columns(entity, [rr.TimeColumn(self._timeline, duration=times)], columns)

    def _note_row(self) -> None:
        self._waiting += 1
        if self._waiting >= MOST_ROWS:
            self.send()
        elif self._waiting == 1:
            self.wake()
