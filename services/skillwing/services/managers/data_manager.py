"""The data manager process: serves the latest value of each datum, and reports data that turn stale."""

from __future__ import annotations

import logging
from typing import Any

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle, Node, Sample
from skillwing.services.core.data_core import DataCore
from skillwing.services.core.refusal import RefusedError
from skillwing.services.managers.alarm import Alarm
from skillwing.services.managers.serving import serve
from skillwing.services.names import DATA_MANAGER
from skillwing.services.options import required
from skillwing.services.protocol import (
    DataReading,
    DataSample,
    Keys,
    ProtocolError,
    QueryData,
    Record,
    decode,
)
from skillwing.services.timeline import Timeline

log = logging.getLogger(__name__)
NO_DATUM = ""
"""Placeholder for all names that the skillset does not have."""


class DataManagerNode:
    """Shell of `DataCore`."""

    name = DATA_MANAGER
    owns_clock = False

    def __init__(self, skillset: Skillset) -> None:
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._names = {item.name for item in skillset.data}

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._timeline = Timeline(bus, self._keys)
        self._core = DataCore(self._skillset, source=self.name, new_record_id=self._timeline.new_id)
        self._alarm = Alarm(bus, self._on_alarm)
        self._complained: set[str] = set()
        bus.subscribe(self._keys.data("*"), self._on_sample, latest_only=True)
        serve(bus, self._keys.data("*"), QueryData, self._answer)
        self._alive: Handle = bus.declare_alive(self._keys.alive(self.name))

    def detach(self) -> None:
        self._alive.cancel()

    def _on_sample(self, sample: Sample) -> None:
        name = self._name(sample.key)
        try:
            message = decode(sample.payload, DataSample)
            if message.name != name:
                raise ProtocolError(f"a sample of `{message.name}` was published as `{name}`")
            records = self._core.update(message, self._bus.now())
        except (ProtocolError, RefusedError) as error:
            self._complain(name, error)
        else:
            self._complained.discard(name)
            self._publish(records)

    def _complain(self, name: str, error: Exception) -> None:
        """Log a warning once for each datum, and once for all unknown names together: their number has no bound."""
        subject = name if name in self._names else NO_DATUM
        if subject not in self._complained:
            self._complained.add(subject)
            log.warning("dropped a sample of %s, and will drop its like in silence: %s", name, error)

    def _answer(self, query: QueryData, key: str) -> DataReading:
        del query
        return self._core.reading(self._name(key), self._bus.now())

    def _on_alarm(self) -> None:
        self._publish(self._core.tick(self._bus.now()))

    def _publish(self, records: tuple[Record, ...]) -> None:
        for record in records:
            self._timeline.publish(record)
        self._alarm.set(self._core.next_tick(self._bus.now()))

    def _name(self, key: str) -> str:
        return key.removeprefix(self._keys.data(""))


def make_data_manager(options: dict[str, Any]) -> Node:
    """Make a data manager. Options: `skillset`, the path of the .skillset file."""
    return DataManagerNode(load(required(options, "skillset")))
