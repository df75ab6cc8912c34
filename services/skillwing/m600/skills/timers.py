"""For how long something has not been as it should: the difference between a bad moment and a failure."""

from __future__ import annotations


class Shortfall:
    """Time in which things were bad, less the time in which they were good since. Pure.

    So a single good moment does not forgive what came before, and bad moments far apart do not add up.
    """

    def __init__(self, t: float) -> None:
        self._t = t
        self.total = 0.0
        """Never below 0 [s]."""

    def observe(self, t: float, *, good: bool) -> float:
        """Things have been like this since the last observation; returns the total as of `t`."""
        elapsed, self._t = max(0.0, t - self._t), max(t, self._t)
        self.total = max(0.0, self.total - elapsed) if good else self.total + elapsed
        return self.total
