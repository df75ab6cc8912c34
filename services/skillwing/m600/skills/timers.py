"""Timers that distinguish a failure from a short disturbance."""

from __future__ import annotations


class StallDetector:
    """Detector for a quantity that has to grow: stalled once it has not grown by `least` for `patience` seconds.

    Pure; `t` is robot time. Slow growth counts as soon as it adds up to `least`.
    """

    def __init__(self, t: float, value: float, *, patience: float = 5.0, least: float = 0.1) -> None:
        self._patience, self._least = patience, least
        self._best, self._since = value, t

    def stalled(self, t: float, value: float) -> bool:
        """Take the quantity's `value` at time `t`; return True if it has stalled."""
        if value >= self._best + self._least:
            self._best, self._since = value, t
        return t - self._since >= self._patience


class LeakyTimer:
    """Total time in a bad state, which leaks away during good time at the same rate. Pure.

    A single good moment does not clear the total, and bad moments far apart do not add up.
    """

    def __init__(self, t: float) -> None:
        self._t = t
        self.total = 0.0
        """Present total, at least 0 [s]."""

    def observe(self, t: float, *, good: bool) -> float:
        """Add the time since the last observation, all of it good or bad; return the total at `t`."""
        elapsed, self._t = max(0.0, t - self._t), max(t, self._t)
        self.total = max(0.0, self.total - elapsed) if good else self.total + elapsed
        return self.total
