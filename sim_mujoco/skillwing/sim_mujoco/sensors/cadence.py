"""Something that is due once in each period."""

from __future__ import annotations


class Cadence:
    """Due at every multiple of `period` after time 0, without drift."""

    def __init__(self, period: float) -> None:
        self.period = period
        self._count = 1

    def due(self, t: float) -> bool:
        """True at most once a call, once for each period that has ended by `t`."""
        if t < self._count * self.period - 1e-9:
            return False
        self._count += 1
        return True
