"""When a process that has died is started again, and when it is given up. Pure: it is told what time it is."""

from __future__ import annotations

from typing import Literal

Restart = Literal["always", "never"]

FIRST_PAUSE = 0.2
LONGEST_PAUSE = 5.0
DEATHS_IN_A_ROW = 5
"""After that many a process is given up."""
LONG_LIFE = 30.0
"""Seconds after which a process counts as healthy: its next death is the first of a new row."""


class RestartPolicy:
    """One process's deaths, judged one after another. Times are seconds of one clock that never goes back.

    The pause before a restart is 0.2 s, and doubles with each further death in a row, up to 5 s. There is no jitter:
    the processes of one system have nothing to fight over when they come back together.
    """

    def __init__(self, restart: Restart = "always", deaths_in_a_row: int = DEATHS_IN_A_ROW) -> None:
        self._patience = deaths_in_a_row if restart == "always" else 1
        self._row: list[float] = []

    @property
    def deaths(self) -> int:
        """How many there are in the row."""
        return len(self._row)

    @property
    def span(self) -> float:
        """Seconds from the first death of the row to the last."""
        return self._row[-1] - self._row[0] if self._row else 0.0

    def died(self, now: float, started: float, *, hopeless: bool = False) -> float | None:
        """Take note of a death; returns the pause before the next start, None if there is none any more.

        started: when the life began that has just ended. hopeless: the process said that it would fail again.
        """
        if now - started >= LONG_LIFE:
            self._row.clear()
        self._row.append(now)
        if hopeless or self.deaths >= self._patience:
            return None
        return min(LONGEST_PAUSE, FIRST_PAUSE * 2 ** (self.deaths - 1))
