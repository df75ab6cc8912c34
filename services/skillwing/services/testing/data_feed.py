"""The data of a test's context, published periodically so that they stay fresh."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle, Publisher
from skillwing.services.protocol import DataSample, Keys, encode
from skillwing.services.testing.context import checked_data


class DataFeed:
    """A publisher of data: at once, and then at the promised period, until it is stopped."""

    def __init__(self, bus: Bus, skillset: Skillset) -> None:
        self._bus = bus
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._publishers: dict[str, Publisher] = {}
        self._timers: dict[str, Handle] = {}
        self._values: dict[str, object] = {}

    def set(self, values: Mapping[str, object]) -> None:
        """Publish these values from now on. Raises ContextError if they do not fit the model."""
        for name, value in checked_data(self._skillset, values).items():
            self._values[name] = value
            self._publish(name)
            period = self._skillset.datum(name).period
            if name not in self._timers and period is not None:
                self._timers[name] = self._bus.every(period, lambda name=name: self._publish(name))

    def stop(self, name: str) -> None:
        """Stop publishing a datum. After three of its periods it is stale. Raises UnknownNameError."""
        timer = self._timers.pop(self._skillset.datum(name).name, None)
        if timer is not None:
            timer.cancel()

    def _publish(self, name: str) -> None:
        if name not in self._publishers:
            self._publishers[name] = self._bus.advertise(self._keys.data(name))
        sample = DataSample(name=name, value=self._values[name], t=self._bus.now())
        self._publishers[name].put(encode(sample))
