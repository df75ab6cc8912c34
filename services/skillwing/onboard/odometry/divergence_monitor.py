"""Divergence monitor: detects wrong odometry by its innovations, without ground truth.

The innovation gate rejects a scan that contradicts the map or the inertial measurements. Rejected scans change nothing.
Several in a row mean that odometry has diverged, whether the scans, the inertial measurements or the map are wrong.
`benchmarks/odometry.py` measures the distance of sound flights from the limits (docs/mapping.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from skillwing.onboard.odometry.filter import Posterior
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import POSITION

LEAST_CLOSE: Final = 0.9
"""Least share of the points with a plane that are close to it."""
LARGEST_NIS: Final = 15.0
"""Largest normalised innovation squared (NIS): squared Mahalanobis length of a scan's correction to the prediction.

It includes the NIS of earlier scans, each with nine tenths of the weight of the next. Otherwise the gate would accept a
frozen sensor in the end, which contradicts the other one a little with each scan. Of all sound flights long hovering
comes nearest to the limit: with 8, one mission of 70 was lost."""
REMEMBERED: Final = 0.9
FEWEST_MATCHES: Final = 30
"""Fewest points on planes of an accepted scan."""
MOST_REJECTED: Final = 5
"""Excess of rejected over accepted scans, since they were last even, from which odometry has diverged."""
LARGEST_SIGMA: Final = 0.5
"""Standard deviation of the position from which odometry has diverged [m]."""
LARGEST_GYRO_BIAS, LARGEST_ACCEL_BIAS = 0.05, 0.6
"""Largest biases of a sound IMU [rad/s, m/s2]."""


@dataclass(frozen=True, slots=True)
class GateResult:
    """Result for one scan. `rejection`: the reason, without a full stop; empty for an accepted scan. `nis`: as in
    LARGEST_NIS, with the part remembered of earlier scans."""

    rejection: str
    nis: float


class InnovationGate:
    """Gate on the innovation of each scan, with a memory of those before.

    least_close, largest_nis, remembered: as the constants, for another kind of map.
    """

    def __init__(
        self,
        least_close: float = LEAST_CLOSE,
        largest_nis: float = LARGEST_NIS,
        remembered: float = REMEMBERED,
    ) -> None:
        self._least_close, self._largest_nis, self._remembered = least_close, largest_nis, remembered
        self._nis = 0.0

    def __call__(self, agreement: Agreement, predicted: Floats, posterior: Posterior) -> GateResult:
        """Check a scan by its agreement with the map, the covariance (N, N) of its prediction, and the posterior."""
        # Over all errors, not the pose alone: much of the pose's uncertainty may be older than the last keyframe, and
        # says little about the way since.
        changed = float(posterior.step @ np.linalg.solve(predicted, posterior.step))
        before = self._remembered * self._nis
        result = GateResult(self._rejection(agreement, before + changed), before + changed)
        # The innovation of a rejected scan appears again in the next one.
        self._nis = before if result.rejection else result.nis
        return result

    def _rejection(self, agreement: Agreement, nis: float) -> str:
        if agreement.matched < FEWEST_MATCHES:
            return f"only {agreement.matched} points lie on known planes"
        if agreement.close < self._least_close * agreement.matched:
            share = 100 * agreement.close / agreement.matched
            return f"only {share:.0f} % of the points fit the planes of the map"
        return "the scan contradicts the inertial measurements" if nis > self._largest_nis else ""


class DivergenceMonitor:
    """Monitor of the gate's results and of the state. `failure` is the reason for divergence, empty without one."""

    def __init__(self) -> None:
        self.failure = ""
        self._rejected = 0

    @property
    def rejecting(self) -> bool:
        """Scans were rejected lately, and not made up for by accepted ones."""
        return self._rejected > 0

    def observe(self, result: GateResult, posterior: Posterior) -> None:
        """Take the result for a scan, and the state after it."""
        self._rejected = self._rejected + 1 if result.rejection else max(self._rejected - 1, 0)
        self.failure = self.failure or self._check(result, posterior)

    def _check(self, result: GateResult, posterior: Posterior) -> str:
        if self._rejected >= MOST_REJECTED:
            return f"{result.rejection}, {MOST_REJECTED} times"
        sigma = float(np.sqrt(np.diag(posterior.covariance)[POSITION].max()))
        if sigma > LARGEST_SIGMA:
            return f"the position is uncertain by {sigma:.1f} m"
        if np.abs(posterior.state.gyro_bias).max() > LARGEST_GYRO_BIAS:
            return "the gyroscopes drift more than sound ones do"
        if np.abs(posterior.state.accel_bias).max() > LARGEST_ACCEL_BIAS:
            return "the accelerometers are off by more than sound ones are"
        return ""
