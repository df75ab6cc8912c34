"""The small instruments: IMU, range-finder, barometer."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion, add, to_world
from skillwing.onboard.sensor_data.directions import RANGE_MOUNT
from skillwing.onboard.topics import sensors
from skillwing.services.protocol import encode

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.rays import RayScene

IMU_PERIOD = 0.004
IMU_BATCH = 0.02
IMU_DELAY = 0.004
"""Time from a batch's last sample to its delivery [s]. Five samples of twenty bytes take 1 ms on a serial line of
1 Mbit/s; a driver that polls at the sampling rate reads them within 4 ms."""
IMU_NOISE = np.array([0.06] * 3 + [0.005] * 3)
"""Standard deviation of each sample: specific force (3) [m/s2], angular rate (3) [rad/s]."""
IMU_TURN_ON = np.array([0.05] * 3 + [0.003] * 3)
"""Standard deviation of the biases when the unit is switched on."""
IMU_WALK = np.array([1e-3] * 3 + [1e-4] * 3)
"""Standard deviation of the biases' random walk after one second; it grows with the square root of time."""
ACCELERATION_LIMIT = 80.0
RANGE_PERIOD = 0.05
RANGE_DELAY = 0.01
"""Time to the delivery of a distance [s]: it is averaged over many pulses and sent on a slow serial line."""
RANGE_REACH, RANGE_NEAREST = 40.0, 0.05

BAROMETER_NOISE, BAROMETER_DRIFT = 0.1, 0.03
"""Standard deviation of a measurement [m], and of the drift within a second [m]; a MS5611 resolves 0.1 m."""


class NoiseTable:
    """A table of standard normal numbers, read from a random place each time.

    Drawing 57,600 fresh numbers for every depth picture costs time beside casting its rays. A random place in a table
    of a million is as good for a sensor and nearly free.
    """

    def __init__(self, rng: np.random.Generator, size: int = 1 << 20) -> None:
        self._rng = rng
        self._table = rng.standard_normal(size, dtype=np.float32)

    def draw(self, count: int) -> NDArray[np.float32]:
        """Numbers (count,), not to be changed."""
        start = int(self._rng.integers(0, len(self._table) - count))
        return self._table[start : start + count]


class Imu:
    """IMU: specific force [m/s2] and angular rate [rad/s], with white noise, turn-on biases and random walk of biases.

    The model is that of Kalibr's IMU pages and of IEEE 952, with the magnitudes of a small MEMS unit on a drone. Noise
    densities are 0.0038 m/s2 and 0.0003 rad/s per root hertz. Because rotors vibrate, that is about twice the published
    values for the ADIS16448 of the EuRoC flights (0.002 and 0.00017). The accelerometer's random walk is a third of the
    published one (0.003), the gyroscope's five times as large (0.00002).
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.bias = rng.normal(0.0, IMU_TURN_ON)

    def errors(self, count: int) -> NDArray[np.float64]:
        """Errors (count, 6) of the next `count` samples."""
        draws = self._rng.standard_normal((count + 1, 6))
        self.bias = self.bias + IMU_WALK * math.sqrt(count * IMU_PERIOD) * draws[-1]
        return self.bias + IMU_NOISE * draws[:-1]

    def measure(self, truth: NDArray[np.float64]) -> NDArray[np.float32]:
        """Measured specific force and angular rate (n, 6), FLU, from the true ones."""
        return (truth + self.errors(len(truth))).astype(np.float32)


class RangeFinder:
    """Range-finder with one beam along the body's -z."""

    def __init__(self, rays: RayScene, rng: np.random.Generator) -> None:
        self._rays, self._rng = rays, rng

    def measure(self, motion: Motion) -> NDArray[np.float32]:
        """Distance (1,) [m] from the sensor; 0 = nothing in reach."""
        origin = np.array(add(motion.position, to_world(motion.quaternion, RANGE_MOUNT)), dtype=np.float32)
        down = np.array([to_world(motion.quaternion, (0.0, 0.0, -1.0))], dtype=np.float32)
        distance = self._rays.distances(origin, down, RANGE_REACH)[0]
        noise = np.float32(self._rng.normal(0.0, 0.01))
        return np.array([max(distance + noise, RANGE_NEAREST) if distance > 0.0 else 0.0], dtype=np.float32)


class Barometer:
    """Height from air pressure: noise, an unknown offset, and a slow drift with weather and air flow."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._offset = rng.normal(0.0, 2.0)

    def measure(self, motion: Motion, since_last: float) -> float:
        """Height [m] above an unknown level, `since_last` seconds after the measurement before."""
        drift, noise = self._rng.standard_normal(2).tolist()
        self._offset += BAROMETER_DRIFT * math.sqrt(since_last) * drift
        return motion.position[2] + self._offset + BAROMETER_NOISE * noise


def imu_publication(start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Array and header of a batch: times since the first sample, specific force and angular rate (n, 7)."""
    times = np.linspace(0.0, end - start, len(data), endpoint=False, dtype=np.float32)
    rows = np.column_stack([times, data])
    return rows.tobytes(), encode(sensors.ImuHeader(t0=start, count=len(rows)))


def range_publication(_start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Message of a distance."""
    distance = float(data[0])
    return encode(sensors.Range(t=end, distance=distance if distance != 0.0 else None)), b""
