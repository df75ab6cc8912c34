"""A sensor that the drone does not have: everything that one file and one row of the table need."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion
from skillwing.services.protocol import Message, encode
from skillwing.sim_mujoco.sensors.health import Limits
from skillwing.sim_mujoco.sensors.table import SensorSpec

TOPIC = "fl/barometer"


class Pressure(Message, frozen=True, kw_only=True):
    """Air pressure at `t` [Pa]."""

    t: float
    pressure: float


class Barometer:
    """Pressure of the standard atmosphere, with noise."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def measure(self, motion: Motion) -> NDArray[np.float32]:
        """Pressure (1,) [Pa]."""
        return np.array([101_325.0 - 12.0 * motion.position[2] + self._rng.normal(0.0, 2.0)], dtype=np.float32)


def publication(_start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Message of a pressure."""
    return encode(Pressure(t=end, pressure=float(data[0]))), b""


ROW = SensorSpec(
    "barometer",
    TOPIC,
    period=0.05,
    delay=0.01,
    limits=Limits(80_000.0, 110_000.0),
    make=lambda _, rng: Barometer(rng),
    measure=lambda barometer, moment: barometer.measure(moment.motion),
    message=publication,
    unit=np.array([10.0], dtype=np.float32),
    largest=1000.0,
)
