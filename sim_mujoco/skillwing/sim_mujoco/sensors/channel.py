"""Channels: the path from a sensor to its readers, with rate, delay, corruption and health."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from skillwing.sim_mujoco.sensors.corruptors import Corruption, Data
from skillwing.sim_mujoco.sensors.health import ConditionChange, HealthMonitor, Limits, SensorCondition
from skillwing.sim_mujoco.sensors.self_tests import SelfTest


class Cadence:
    """A period without drift: due at every multiple after time 0."""

    def __init__(self, period: float) -> None:
        self.period = period
        self._count = 1

    def due(self, t: float) -> bool:
        """True at most once a call, once for each period that has ended by `t`."""
        if t < self._count * self.period - 1e-9:
            return False
        self._count += 1
        return True


@dataclass(frozen=True, slots=True)
class Measurement:
    """Data that a sensor has measured between `start` and `end` (robot time), however late it arrives."""

    sensor: str
    start: float
    end: float
    data: Data


Observer: TypeAlias = Callable[[float, Measurement, SensorCondition], str | None]
"""A cross-check of an arriving measurement by other instruments: from time, measurement and the sensor's condition to a
sentence against the measurement, or None."""


def no_residual(_t: float, _measurement: Measurement, _condition: SensorCondition) -> None:
    """Find nothing: the observer of a sensor that no other instrument can check."""


class SensorChannel:
    """The path of one sensor's measurements. `deliver` takes one when it is `due`; `collect` returns those that ended
    at least `delay` seconds ago."""

    def __init__(
        self,
        sensor: str,
        period: float,
        delay: float,
        limits: Limits,
        corruption: Corruption,
        tests: Sequence[SelfTest] = (),
        observer: Observer = no_residual,
    ) -> None:
        self.sensor = sensor
        self.corruption = corruption
        self._observer = observer
        self._cadence, self._delay = Cadence(period), delay
        self._monitor = HealthMonitor(period, limits, tests)
        self._under_way: deque[Measurement] = deque()

    @property
    def condition(self) -> SensorCondition:
        """Condition of the sensor, by its own diagnosis."""
        return self._monitor.condition

    def due(self, t: float) -> bool:
        """A measurement is due; true once for each period."""
        return self._cadence.due(t)

    def deliver(self, start: float, end: float, data: Data) -> None:
        """Take a complete measurement, which arrives after corruption and delay, if at all."""
        corrupted = self.corruption.apply(data)
        if corrupted is not None:
            self._under_way.append(Measurement(self.sensor, start, end, corrupted))

    def collect(self, t: float) -> tuple[list[Measurement], list[ConditionChange]]:
        """The measurements that have arrived by time `t`, and the changes of the sensor's health."""
        arrived: list[Measurement] = []
        changes: list[ConditionChange] = []
        while self._under_way and self._under_way[0].end + self._delay <= t + 1e-9:
            measurement = self._under_way.popleft()
            arrived.append(measurement)
            change = self._monitor.observe(t, measurement.data, self._observer(t, measurement, self.condition))
            if change is not None:
                changes.append(change)
        change = self._monitor.check(t)
        if change is not None:
            changes.append(change)
        return arrived, changes
