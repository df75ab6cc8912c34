"""Whether odometry can still be believed: what it notices about itself, without knowing the truth.

A scan is doubted when it contradicts the map or the inertial measurements. Doubted scans change nothing; several in a
row mean that odometry has diverged, whoever is wrong: the scans, the inertial measurements, or the map. How near sound
flights come to being doubted is measured (`benchmarks/odometry.py`, docs/mapping.md).
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
"""Of the points that have a plane this share has to be close to it."""
LARGEST_SURPRISE: Final = 15.0
"""Squared Mahalanobis length of what a scan may change about the prediction, summed over the scans before it, each of
which counts nine tenths of the next. A frozen sensor contradicts the other one a little with each scan, and would be
believed in the end. A drone that hovers for long comes nearest to it of all that is sound: at 8, one mission of 70 was
lost."""
REMEMBERED: Final = 0.9
FEWEST_MATCHES: Final = 30
"""Points on planes without which a scan says nothing."""
DOUBTS: Final = 5
"""So many doubted scans more than believed ones, counted from the last time they were even, end the belief."""
LARGEST_SIGMA: Final = 0.5
"""With a place that is so uncertain the drone is lost [m]: nothing around has held it in some direction."""
LARGEST_GYRO_BIAS, LARGEST_ACCEL_BIAS = 0.05, 0.6
"""No sound IMU has larger ones [rad/s, m/s2]."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Of one scan. `doubt` is a sentence without full stop, empty for a scan that is believed; `surprise` as in
    LARGEST_SURPRISE, with what is remembered of the scans before."""

    doubt: str
    surprise: float


class Judge:
    """Judges scan after scan what each would change about its prediction, and remembers what the last ones would have.

    least_close, largest_surprise, remembered: as the constants, for another kind of map.
    """

    def __init__(
        self,
        least_close: float = LEAST_CLOSE,
        largest_surprise: float = LARGEST_SURPRISE,
        remembered: float = REMEMBERED,
    ) -> None:
        self._least_close, self._largest_surprise, self._remembered = least_close, largest_surprise, remembered
        self._surprise = 0.0

    def __call__(self, agreement: Agreement, predicted: Floats, posterior: Posterior) -> Judgement:
        """Of a scan that agrees so with the map, and of what came of it and a prediction of this covariance (N, N)."""
        # Of all errors: about the pose alone much may be unknown, of which next to nothing is about the way since the
        # last keyframe.
        changed = float(posterior.step @ np.linalg.solve(predicted, posterior.step))
        before = self._remembered * self._surprise
        judgement = Judgement(self._doubt(agreement, before + changed), before + changed)
        # What a scan would have changed that is not believed, the next one would change again.
        self._surprise = before if judgement.doubt else judgement.surprise
        return judgement

    def _doubt(self, agreement: Agreement, surprise: float) -> str:
        if agreement.matched < FEWEST_MATCHES:
            return f"only {agreement.matched} points lie on known planes"
        if agreement.close < self._least_close * agreement.matched:
            share = 100 * agreement.close / agreement.matched
            return f"only {share:.0f} % of the points fit the planes of the map"
        return "the scan contradicts the inertial measurements" if surprise > self._largest_surprise else ""


class Vigil:
    """Sums up the judgements. `verdict` says why odometry is not to be believed any more, empty while it is."""

    def __init__(self) -> None:
        self.verdict = ""
        self._doubts = 0

    @property
    def doubting(self) -> bool:
        """Whether the last scans were not all believed."""
        return self._doubts > 0

    def observe(self, judgement: Judgement, posterior: Posterior) -> None:
        """Take a judgement into account, and the state that holds after it."""
        self._doubts = self._doubts + 1 if judgement.doubt else max(self._doubts - 1, 0)
        self.verdict = self.verdict or self._decide(judgement, posterior)

    def _decide(self, judgement: Judgement, posterior: Posterior) -> str:
        if self._doubts >= DOUBTS:
            return f"{judgement.doubt}, {DOUBTS} times"
        sigma = float(np.sqrt(np.diag(posterior.covariance)[POSITION].max()))
        if sigma > LARGEST_SIGMA:
            return f"the position is uncertain by {sigma:.1f} m"
        if np.abs(posterior.state.gyro_bias).max() > LARGEST_GYRO_BIAS:
            return "the gyroscopes drift more than sound ones do"
        if np.abs(posterior.state.accel_bias).max() > LARGEST_ACCEL_BIAS:
            return "the accelerometers are off by more than sound ones are"
        return ""
