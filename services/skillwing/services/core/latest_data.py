"""Latest values of the skillset's data, and their freshness."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from skillwing.dsl.model import DataItem, Skillset
from skillwing.services.core.values import fit
from skillwing.services.protocol import DataReading, DataSample


@dataclass(frozen=True, slots=True)
class _Stamped:
    """A value with its timestamp. fresh_until: time from which on it is stale, infinity for never."""

    value: object
    t: float
    fresh_until: float


class LatestData:
    """Latest value of each datum of a skillset, restricted to `names` if given.

    A datum that was never published, or whose latest value is three promised periods old, is stale.
    """

    def __init__(self, skillset: Skillset, names: Iterable[str] | None = None) -> None:
        wanted = None if names is None else frozenset(names)
        self._items: dict[str, DataItem] = {
            item.name: item for item in skillset.data if wanted is None or item.name in wanted
        }
        self._latest: dict[str, _Stamped] = {}
        self._unknown_until: dict[str, float] = {}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._items)

    def accept(self, sample: DataSample, now: float) -> str | None:
        """Take a sample. Returns None if it fits the model, else a sentence that explains why it was dropped.

        A sample older than the present one changes nothing: the network may reorder.
        """
        item = self._items.get(sample.name)
        if item is None:
            return f"There is no datum `{sample.name}`."
        value, problems = fit(sample.value, item.type, item.name)
        if problems:
            return " ".join(problem.sentence for problem in problems)
        # A timestamp in the future would keep the value fresh for ever, and reject all newer values.
        stamp = min(sample.t, now)
        self._unknown_until.pop(item.name, None)
        known = self._latest.get(item.name)
        if known is None or stamp >= known.t:
            self._latest[item.name] = _Stamped(value, stamp, _fresh_until(item, stamp))
        return None

    def value(self, name: str) -> object:
        """The latest value, stale or not; None if there is none."""
        stamped = self._latest.get(name)
        return None if stamped is None else stamped.value

    def never_expires(self, name: str) -> bool:
        """True for a datum whose values never turn stale."""
        return self._items[name].stale_after is None

    def clamp_timestamps(self, now: float) -> None:
        """Give values with a later timestamp than `now` the timestamp `now`.

        After a clock was set back they would reject all newer values.
        """
        for name, stamped in self._latest.items():
            stamp = min(stamped.t, now)
            self._latest[name] = _Stamped(stamped.value, stamp, _fresh_until(self._items[name], stamp))

    def mark_unknown(self, now: float) -> None:
        """Mark every datum without a value as unknown: it may have a fresh value that has not arrived here."""
        for item in self._items.values():
            if item.name not in self._latest and item.stale_after is not None:
                self._unknown_until[item.name] = now + item.stale_after

    def freshness_unknown(self, names: Iterable[str], now: float) -> bool:
        """True if one of these data may have a fresh value that has not arrived here."""
        return any(now < self._unknown_until.get(name, -math.inf) for name in names)

    def is_fresh(self, name: str, now: float) -> bool:
        stamped = self._latest.get(name)
        return stamped is not None and now < stamped.fresh_until

    def fresh(self, now: float) -> dict[str, object]:
        """The values that guards are evaluated on at `now`."""
        return {name: stamped.value for name, stamped in self._latest.items() if now < stamped.fresh_until}

    def reading(self, name: str, now: float) -> DataReading:
        """The latest value of `name`, stale or not."""
        stamped = self._latest.get(name)
        if stamped is None:
            return DataReading(name=name, value=None, t=None, age=None, stale=True)
        age = max(0.0, now - stamped.t)
        return DataReading(name=name, value=stamped.value, t=stamped.t, age=age, stale=not self.is_fresh(name, now))

    def next_stale_at(self, now: float) -> float | None:
        """Time at which the next datum turns stale if no sample comes in; None for never. Unknown data count too."""
        ends = [*[stamped.fresh_until for stamped in self._latest.values()], *self._unknown_until.values()]
        return min([until for until in ends if now < until < math.inf], default=None)


def _fresh_until(item: DataItem, stamp: float) -> float:
    return math.inf if item.stale_after is None else stamp + item.stale_after
