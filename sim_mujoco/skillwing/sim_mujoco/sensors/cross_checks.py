"""Instruments of the drone that measure the same, held against each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from statistics import fmean

import numpy as np

from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.corruptors import Data
from skillwing.sim_mujoco.sensors.instruments import IMU_BATCH, IMU_PERIOD
from skillwing.sim_mujoco.sensors.self_tests import NOT_FINITE, Contradiction

_LIMITS = (0.35, 0.35, 0.35, 0.03, 0.03, 0.03)
"""Mean difference between two IMUs on one body that biases and noise do not explain: [m/s2] (3), [rad/s] (3)."""
_SMOOTHING = 0.04
"""Part that one batch has in the mean: half a second counts."""
_REMEMBERED = round((IMU_BATCH + 0.1) / IMU_PERIOD)
"""So many samples of the autopilot's IMU are kept: those of a batch that comes up to 0.1 s late are among them."""


class InertialTwin:
    """Compares the computer's IMU with the autopilot's. Both feel the same, but for noise, biases and 2 ms."""

    def __init__(self) -> None:
        self._difference = [0.0] * len(_LIMITS)

    def objection(self, batch: Data, own: Sequence[tuple[float, ...]]) -> str | None:
        """What speaks against a batch (n, 6), given the autopilot's samples of the same time, at least one."""
        if not np.isfinite(batch).all():
            return NOT_FINITE  # A mean with it in would tell nothing, now or later.
        for k, limit in enumerate(_LIMITS):
            apart = abs(fmean(batch[:, k].tolist()) - fmean([sample[k] for sample in own]))
            # An impact is over in one sample, which only one of the two may have met.
            self._difference[k] += _SMOOTHING * (min(apart, 3.0 * limit) - self._difference[k])
        excess = [difference / limit for difference, limit in zip(self._difference, _LIMITS, strict=True)]
        worst = excess.index(max(excess))
        if excess[worst] <= 1.0:
            return None
        what, unit = ("specific force", "m/s2") if worst < 3 else ("angular rate", "rad/s")
        return f"its {what} is {self._difference[worst]:.2f} {unit} off the autopilot's"


class GroundTwin:
    """Compares the range-finder with the part of the LiDAR's ring that looks the same way, and with standing."""

    _DOWN = 3 / 4
    """Where in a revolution the ring looks down."""
    _SIDE = 2
    _PATIENCE = 10
    _TOLERANCE, _SLOPE = 0.3, 0.05

    def __init__(self, standing: float) -> None:
        """`standing` is what the range-finder measures on the ground [m]."""
        self._standing = standing
        self._seen: tuple[float, float, float] | None = None
        self._contradiction = Contradiction(self._PATIENCE)

    def look(self, t: float, scan: Data) -> None:
        """A scan (columns, beams) of a LiDAR that can be trusted ended at `t`."""
        columns, beams = scan.shape
        middle, centre = round(self._DOWN * columns), beams // 2
        down = scan[middle - self._SIDE : middle + self._SIDE + 1, centre - self._SIDE : centre + self._SIDE]
        down = down[down > 0.0]
        self._seen = (t, float(down.min()), float(down.max())) if down.size else None

    def objection(self, t: float, distance: float, *, standing: bool) -> str | None:
        """What speaks against a distance [m], 0 for none, measured at `t`."""
        expected = (self._standing, self._standing) if standing else self._below(t)
        if expected is None:
            return None
        slack = self._TOLERANCE + self._SLOPE * expected[1]
        agree = expected[0] - slack <= distance <= expected[1] + slack
        if not self._contradiction.weigh(agree=agree):
            return None
        whom = "where it stands" if standing else "the LiDAR"
        return f"{distance:.1f} m, while {whom} says {expected[0]:.1f} m"

    def _below(self, t: float) -> tuple[float, float] | None:
        if self._seen is None or t - self._seen[0] > 0.2:
            return None
        return self._seen[1:]


class Twins:
    """Both pairs, as witnesses of the channels of IMU and range-finder."""

    def __init__(self, standing_range: float) -> None:
        self.standing = True
        self._imu, self._ground = InertialTwin(), GroundTwin(standing_range)
        self._felt: deque[tuple[float, tuple[float, ...]]] = deque(maxlen=_REMEMBERED)

    def felt(self, t: float, sample: tuple[float, ...]) -> None:
        """A sample (6) of the autopilot's IMU, taken at `t`."""
        self._felt.append((t, sample))

    def look(self, scan: Measurement) -> None:
        """A scan of a LiDAR that can be trusted."""
        self._ground.look(scan.end, scan.data)

    def of_imu(self, _: float, batch: Measurement) -> str | None:
        """What the autopilot's IMU says against a batch of the computer's, which comes late."""
        start, end = batch.start + 1e-6, batch.end + 1e-6
        return self._imu.objection(batch.data, [sample for t, sample in self._felt if start < t <= end])

    def of_range(self, _: float, measured: Measurement) -> str | None:
        """What the LiDAR, or the ground under the skids, says against the range-finder."""
        return self._ground.objection(measured.end, float(measured.data[0]), standing=self.standing)
