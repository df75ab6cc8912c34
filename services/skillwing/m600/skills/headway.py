"""Whether something that should move still does."""

from __future__ import annotations


class Headway:
    """Judges a quantity that has to grow: `stalled` once it has not grown by `least` for `patience` seconds.

    Pure; `t` is robot time. Slow creeping counts as growth as soon as it adds up to `least`.
    """

    def __init__(self, t: float, value: float, *, patience: float = 5.0, least: float = 0.1) -> None:
        self._patience, self._least = patience, least
        self._best, self._since = value, t

    def stalled(self, t: float, value: float) -> bool:
        """Take the quantity's `value` at time `t` and judge."""
        if value >= self._best + self._least:
            self._best, self._since = value, t
        return t - self._since >= self._patience
