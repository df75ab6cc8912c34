"""The latest values of the skillset's data, and how long they count."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from skillwing.dsl.model import DataItem, Skillset
from skillwing.services.core.values import fit
from skillwing.services.protocol import DataReading, DataSample


@dataclass(frozen=True, slots=True)
class _Stamped:
    value: object
    t: float


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
        self._awaited: dict[str, float] = {}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._items)

    def accept(self, sample: DataSample, now: float) -> str | None:
        """Take a sample. Returns None if it fits the model, else a sentence saying why it was dropped.

        A sample older than the one known changes nothing: the network may reorder.
        """
        item = self._items.get(sample.name)
        if item is None:
            return f"There is no datum `{sample.name}`."
        value, problems = fit(sample.value, item.type, item.name)
        if problems:
            return " ".join(problem.sentence for problem in problems)
        # A stamp from the future would keep the value fresh for ever and shut out its successors.
        stamp = min(sample.t, now)
        self._awaited.pop(item.name, None)
        known = self._latest.get(item.name)
        if known is None or stamp >= known.t:
            self._latest[item.name] = _Stamped(value, stamp)
        return None

    def value(self, name: str) -> object:
        """The latest value, stale or not; None if there is none."""
        stamped = self._latest.get(name)
        return None if stamped is None else stamped.value

    def never_expires(self, name: str) -> bool:
        """Tell whether values of the datum never turn stale."""
        return self._items[name].stale_after is None

    def clamp_timestamps(self, now: float) -> None:
        """Take values of later than `now` for ones of now: somebody has set a clock, and they must not shut out their
        successors."""
        for name, stamped in self._latest.items():
            self._latest[name] = _Stamped(stamped.value, min(stamped.t, now))

    def mark_unknown(self, now: float) -> None:
        """Take every datum without a value for one whose value is not known here, but may be fresh."""
        for item in self._items.values():
            if item.name not in self._latest and item.stale_after is not None:
                self._awaited[item.name] = now + item.stale_after

    def freshness_unknown(self, names: Iterable[str], now: float) -> bool:
        """Tell whether one of these data may be fresh although its value is not known here."""
        return any(now < self._awaited.get(name, float("-inf")) for name in names)

    def is_fresh(self, name: str, now: float) -> bool:
        return now < self._fresh_until(name)

    def fresh(self, now: float) -> dict[str, object]:
        """The values that a guard may be judged on at `now`."""
        return {name: stamped.value for name, stamped in self._latest.items() if self.is_fresh(name, now)}

    def reading(self, name: str, now: float) -> DataReading:
        """The latest value of `name`, stale or not."""
        stamped = self._latest.get(name)
        if stamped is None:
            return DataReading(name=name, value=None, t=None, age=None, stale=True)
        age = max(0.0, now - stamped.t)
        return DataReading(name=name, value=stamped.value, t=stamped.t, age=age, stale=not self.is_fresh(name, now))

    def next_stale_at(self, now: float) -> float | None:
        """When the next datum that is or may be fresh at `now` turns stale if nothing more comes in; None for never."""
        ends = [*(self._fresh_until(name) for name in self._latest), *self._awaited.values()]
        times = [until for until in ends if now < until < float("inf")]
        return min(times, default=None)

    def _fresh_until(self, name: str) -> float:
        stamped = self._latest.get(name)
        if stamped is None:
            return float("-inf")
        limit = self._items[name].stale_after
        return float("inf") if limit is None else stamped.t + limit
