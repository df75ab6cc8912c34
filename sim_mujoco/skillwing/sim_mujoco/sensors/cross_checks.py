"""Cross-checks: instruments of the drone that measure the same, compared with each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from statistics import fmean
from typing import Protocol

import numpy as np

from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.corruptors import Data
from skillwing.sim_mujoco.sensors.health import SensorCondition
from skillwing.sim_mujoco.sensors.instruments import IMU_BATCH, IMU_PERIOD
from skillwing.sim_mujoco.sensors.self_tests import NOT_FINITE, Contradiction

_LIMITS = (0.35, 0.35, 0.35, 0.03, 0.03, 0.03)
"""Mean difference between two IMUs on one body that biases and noise do not explain: [m/s2] (3), [rad/s] (3)."""
_SMOOTHING = 0.04
"""Share of one batch in the mean: half a second counts."""
_REMEMBERED = round((IMU_BATCH + 0.1) / IMU_PERIOD)
"""Number of kept samples of the autopilot's IMU: enough for a batch that comes up to 0.1 s late."""


class ImuCrossCheck:
    """Comparison of the computer's IMU with the autopilot's. They differ by noise, biases and 2 ms in time."""

    def __init__(self) -> None:
        self._difference = [0.0] * len(_LIMITS)

    def residual(self, batch: Data, own: Sequence[tuple[float, ...]]) -> str | None:
        """Description of a difference that refutes a batch (n, 6), or None. own: the autopilot's samples meanwhile."""
        if not np.isfinite(batch).all():
            return NOT_FINITE  # The mean would stay infinite or NaN.
        for k, limit in enumerate(_LIMITS):
            apart = abs(fmean(batch[:, k].tolist()) - fmean([sample[k] for sample in own]))
            # An impact lasts one sample, and may be in the data of only one of the two IMUs.
            self._difference[k] += _SMOOTHING * (min(apart, 3.0 * limit) - self._difference[k])
        excess = [difference / limit for difference, limit in zip(self._difference, _LIMITS, strict=True)]
        worst = excess.index(max(excess))
        if excess[worst] <= 1.0:
            return None
        what, unit = ("specific force", "m/s2") if worst < 3 else ("angular rate", "rad/s")
        return f"its {what} is {self._difference[worst]:.2f} {unit} off the autopilot's"


class GroundCrossCheck:
    """Comparison of the range-finder with the LiDAR's beams that point down, and with its value on the ground."""

    _DOWN = 3 / 4
    """Part of a revolution after which the ring looks down."""
    _SIDE = 2
    _PATIENCE = 10
    _TOLERANCE, _SLOPE = 0.3, 0.05

    def __init__(self, standing: float) -> None:
        """`standing` is the range that the range-finder measures on the ground [m]."""
        self._standing = standing
        self._seen: tuple[float, float, float] | None = None
        self._contradiction = Contradiction(self._PATIENCE)

    def update(self, t: float, scan: Data) -> None:
        """Take a scan (columns, beams) of a LiDAR that can be trusted; it ended at `t`."""
        columns, beams = scan.shape
        middle, centre = round(self._DOWN * columns), beams // 2
        down = scan[middle - self._SIDE : middle + self._SIDE + 1, centre - self._SIDE : centre + self._SIDE]
        down = down[down > 0.0]
        self._seen = (t, float(down.min()), float(down.max())) if down.size else None

    def residual(self, t: float, distance: float, *, standing: bool) -> str | None:
        """Description of a difference that refutes a distance measured at `t` [m; 0: no return], or None."""
        expected = (self._standing, self._standing) if standing else self._below(t)
        if expected is None:
            return None
        slack = self._TOLERANCE + self._SLOPE * expected[1]
        agree = expected[0] - slack <= distance <= expected[1] + slack
        if not self._contradiction.update(agree=agree):
            return None
        whom = "where it stands" if standing else "the LiDAR"
        return f"{distance:.1f} m, while {whom} says {expected[0]:.1f} m"

    def _below(self, t: float) -> tuple[float, float] | None:
        if self._seen is None or t - self._seen[0] > 0.2:
            return None
        return self._seen[1:]


class FixChecker(Protocol):
    """Inertial navigation: it takes a fix that is plausible and `usable`, and returns what speaks against it."""

    def fix(self, now: float, t: float, fix: Data, *, usable: bool) -> str | None: ...


class CrossChecks:
    """Observers of the sensors: each compares a measurement with other instruments of the drone."""

    def __init__(self, standing_range: float, navigator: FixChecker) -> None:
        self.standing = True
        self._imu, self._ground, self._navigator = ImuCrossCheck(), GroundCrossCheck(standing_range), navigator
        self._samples: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=_REMEMBERED)

    def autopilot_imu(self, t: float, sample: tuple[float, ...]) -> None:
        """Remember a sample (6) of the autopilot's IMU, taken at `t`."""
        self._samples.append((t, sample))

    def of_imu(self, _t: float, batch: Measurement, _condition: SensorCondition) -> str | None:
        """Check a late batch of the computer's IMU against the autopilot's IMU."""
        start, end = batch.start + 1e-6, batch.end + 1e-6
        return self._imu.residual(batch.data, [sample for t, sample in self._samples if start < t <= end])

    def of_range(self, _t: float, measured: Measurement, _condition: SensorCondition) -> str | None:
        """Check the range-finder against the LiDAR, or against the ground under the skids."""
        return self._ground.residual(measured.end, float(measured.data[0]), standing=self.standing)

    def of_lidar(self, _t: float, scan: Measurement, condition: SensorCondition) -> None:
        """Take a scan without a check of its own, as reference for the range-finder while the LiDAR can be trusted."""
        if condition is SensorCondition.OK:
            self._ground.update(scan.end, scan.data)

    def of_gnss(self, t: float, fix: Measurement, condition: SensorCondition) -> str | None:
        """Check a fix against inertial navigation, which uses it unless the receiver has failed."""
        return self._navigator.fix(t, fix.end, fix.data, usable=condition is not SensorCondition.FAILED)
