"""Restart policy of a process: the pause before the next start, and the end of all tries. Pure: without a clock."""

from __future__ import annotations

from skillwing.services.robot import Restart

FIRST_PAUSE = 0.2
LONGEST_PAUSE = 5.0
EXITS_IN_A_ROW = 5
"""Number of exits after which a process is given up."""
LONG_LIFE = 30.0
"""Seconds after which a process counts as healthy; its next exit begins a new row."""


class RestartPolicy:
    """The exits of one process. Times are seconds of one clock that never goes back.

    The pause before a restart is 0.2 s, and doubles with each further exit in a row, up to 5 s. It has no jitter:
    processes that come back together do not compete for anything.
    """

    def __init__(self, restart: Restart = "always", exits_in_a_row: int = EXITS_IN_A_ROW) -> None:
        self._patience = exits_in_a_row if restart == "always" else 1
        self._row: list[float] = []

    @property
    def exits(self) -> int:
        """Number of exits in the row."""
        return len(self._row)

    @property
    def span(self) -> float:
        """Seconds from the first exit of the row to the last."""
        return self._row[-1] - self._row[0] if self._row else 0.0

    def exited(self, now: float, started: float, *, hopeless: bool = False, told: bool = False) -> float | None:
        """Record a exit; returns the pause before the next start, None if there is no next one.

        started: start of the run that has ended. hopeless: the exit code of the process says that it will fail again.
        told: somebody has ended it in order, which is no sign of a fault and begins a new row.
        """
        if told or now - started >= LONG_LIFE:
            self._row.clear()
        self._row.append(now)
        if hopeless or self.exits >= self._patience:
            return None
        return min(LONGEST_PAUSE, FIRST_PAUSE * 2 ** (self.exits - 1))
