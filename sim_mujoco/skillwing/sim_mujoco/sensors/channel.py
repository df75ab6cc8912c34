"""A sensor's way out: its rate, its delay, what corrupts it, and what it notices about itself."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from skillwing.sim_mujoco.sensors.cadence import Cadence
from skillwing.sim_mujoco.sensors.corruptors import Corruption, Data
from skillwing.sim_mujoco.sensors.health import Change, Condition, HealthMonitor, Limits
from skillwing.sim_mujoco.sensors.self_tests import SelfTest


@dataclass(frozen=True, slots=True)
class Measurement:
    """What a sensor delivers: data measured between `start` and `end` (robot time), however late it comes."""

    sensor: str
    start: float
    end: float
    data: Data


def _nobody(_t: float, _measurement: Measurement) -> str | None:
    return None


class Channel:
    """One sensor. `due` tells when to measure, `deliver` hands a measurement in, `collect` gives out what is ready.

    That is what ended `delay` ago [s], or longer, if nobody collected it sooner.

    `witness(t, measurement)` is asked about each measurement that arrives: what others know that speaks against it.
    """

    def __init__(
        self,
        sensor: str,
        period: float,
        delay: float,
        limits: Limits,
        corruption: Corruption,
        tests: Sequence[SelfTest] = (),
    ) -> None:
        self.sensor = sensor
        self.corruption = corruption
        self.witness: Callable[[float, Measurement], str | None] = _nobody
        self._cadence, self._delay = Cadence(period), delay
        self._monitor = HealthMonitor(period, limits, tests)
        self._under_way: deque[Measurement] = deque()

    @property
    def condition(self) -> Condition:
        """What the sensor thinks of itself."""
        return self._monitor.condition

    def due(self, t: float) -> bool:
        """Whether a measurement is due; true once for each period."""
        return self._cadence.due(t)

    def deliver(self, start: float, end: float, data: Data) -> None:
        """A measurement is complete; it comes out, or not, after corruption and delay."""
        corrupted = self.corruption.apply(data)
        if corrupted is not None:
            self._under_way.append(Measurement(self.sensor, start, end, corrupted))

    def collect(self, t: float) -> tuple[list[Measurement], list[Change]]:
        """What has arrived by time `t`, and how the sensor's opinion of itself changed."""
        arrived: list[Measurement] = []
        changes: list[Change] = []
        while self._under_way and self._under_way[0].end + self._delay <= t + 1e-9:
            measurement = self._under_way.popleft()
            arrived.append(measurement)
            change = self._monitor.observe(t, measurement.data, self.witness(t, measurement))
            if change is not None:
                changes.append(change)
        change = self._monitor.check(t)
        if change is not None:
            changes.append(change)
        return arrived, changes
