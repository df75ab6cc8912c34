"""LiDAR-inertial odometry without I/O: measurements in, a fix for each scan out."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.odometry.deskew import StillScan, deskew
from skillwing.onboard.odometry.divergence_monitor import DivergenceMonitor
from skillwing.onboard.odometry.inertial import Inertial, InertialMemory
from skillwing.onboard.odometry.initialisation import Initialisation
from skillwing.onboard.odometry.matching import MakeMatcher, PlaneMatcher
from skillwing.onboard.odometry.navigation_bridge import NavigationBridge
from skillwing.onboard.odometry.propagation import ImuNoise, predict
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import GRAVITY, POSITION, SIZE, FilterState, G
from skillwing.onboard.sensor_data.scans import LidarScan, PlacedPoints
from skillwing.onboard.topics.navigation import Navigation

REACH: Final = 60.0
"""Largest range of returns in use [m]."""
PATIENCE: Final = 2.0
"""Time without scans after which odometry is lost [s]."""
SCANS_WITHOUT_IMU: Final = 5
"""Number of scans without inertial measurements in between from which odometry is lost."""
KEPT: Final = 2.0 * PATIENCE
"""Span of the memory of inertial measurements; without a scan for so long odometry is lost [s]."""
LARGEST_GAP: Final = 0.1
"""Longest gap in inertial measurements; navigation has to bridge a longer one [s]."""

DRIFT: Final = 0.0015
"""Standard deviation of the drift along each axis, as a share of the way. It is about twice the drift of sound flights:
docs/mapping.md has errors in units of it."""


class Phase(StrEnum):
    STARTING = "STARTING"  # there is no pose yet
    TRACKING = "TRACKING"
    REJECTING = "DOUBTING"  # the last scans were rejected: the pose comes from inertial measurements
    LOST = "LOST"  # poses are wrong; odometry has to be initialised again


@dataclass(frozen=True)
class Fix:
    """Result of a scan: the state at `t` in the frame of the planes, and the covariance (N, N) of its error.

    `accepted`: the scan was used. `nis`: normalised innovation squared, with that of scans before
    (`divergence_monitor.py`). `origin` (3,): start of odometry. `way`: metres flown since.
    """

    t: float
    state: FilterState
    covariance: Floats
    agreement: Agreement
    accepted: bool
    nis: float
    origin: Floats
    way: float
    scan: StillScan

    @cached_property
    def levelled(self) -> FilterState:
        """The state in a level frame, as odometry publishes it.

        The frame of the planes is tilted as the first pose was, by up to a degree: distant points would be mapped too
        high or too low. In flight the filter estimates gravity, and with it the tilt, which is taken out here.
        """
        return self.state.levelled(self.origin)

    @property
    def position_sigma(self) -> Floats:
        """Standard deviation (3,) of the levelled position [m].

        The filter takes planes mapped before the last keyframes for exact. That part of the map has drifted, by a share
        of the way that was measured on flights. It is tilted by the error of gravity.
        """
        variances = np.diag(self.covariance)
        tilt_x, tilt_y, _ = variances[GRAVITY] / G**2
        x, y, z = (self.state.position - self.origin) ** 2
        tilted = np.array([tilt_x * z, tilt_y * z, tilt_x * x + tilt_y * y])
        return np.sqrt(variances[POSITION] + tilted + (DRIFT * self.way) ** 2)

    def placed(self, reach: float) -> PlacedPoints:
        """The returns within `reach` of the sensor [m], in the world frame."""
        state = self.levelled
        turn = state.turn.astype(np.float32)
        points = turn @ self.scan.within(reach).T + state.position.astype(np.float32)[:, None]
        return PlacedPoints(self.t, state.turn, state.to_world(self.scan.sensor), points.T)


class LidarInertialOdometry:
    """One flight's odometry inside the box from `low` to `high`.

    Its frame is navigation's ENU at the start of odometry; see `Initialisation`. Odometry processes a scan once the
    inertial measurements cover it, so that both `imu` and `scan` may return a fix.
    """

    def __init__(
        self,
        low: Vector,
        high: Vector,
        noise: ImuNoise | None = None,
        make_matcher: MakeMatcher = PlaneMatcher,
    ) -> None:
        self._low, self._high = low, high
        self._noise = noise or ImuNoise()
        self._make_matcher = make_matcher
        self.restart()

    def restart(self) -> None:
        """Discard everything, and initialise again from navigation."""
        self.phase, self.text = Phase.STARTING, "waits for navigation and for two seconds at rest"
        self.begun_at: float | None = None
        self._initialisation: Initialisation | None = Initialisation()
        self._memory = InertialMemory(KEPT)
        self._waiting: LidarScan | None = None
        self._scans_without_imu = 0
        self._bridge = NavigationBridge()
        self._monitor = DivergenceMonitor()
        self._matcher = self._make_matcher(self._low, self._high)
        self._t = self._fixed_at = self._way = 0.0
        self._state: FilterState | None = None
        self._origin = np.zeros(3)
        self._covariance = np.zeros((SIZE, SIZE))

    def navigation(self, navigation: Navigation) -> None:
        """Take a navigation solution, for the initialisation and to bridge gaps in measurements."""
        self._bridge.navigation(navigation)
        if self._initialisation is not None:
            self._initialisation.navigation(navigation)

    def imu(self, batch: Inertial) -> Fix | None:
        """Take a batch of inertial measurements."""
        if not self._memory.add(batch):
            return None
        self._scans_without_imu = 0
        if self._initialisation is not None:
            self._initialisation.imu(batch)
        return self._advance()

    def scan(self, scan: LidarScan) -> Fix | None:
        """Take a scan. It replaces one that still waits for inertial measurements."""
        self._waiting = scan
        self._scans_without_imu += 1
        return self._advance()

    def check(self, t: float) -> None:
        """Detect a silent sensor at `t`."""
        if self._state is None or self.phase is Phase.LOST:
            return
        covered = self._memory.covered_until
        if self._scans_without_imu >= SCANS_WITHOUT_IMU and covered is not None:
            self._lose(f"there were no inertial measurements for {t - covered:.1f} s")
        elif t - self._fixed_at > PATIENCE:
            self._lose(self.text or f"there were no scans for {PATIENCE:g} s")

    def _advance(self) -> Fix | None:
        scan, covered = self._waiting, self._memory.covered_until
        if scan is None or covered is None or covered < scan.span[1] - 1e-6 or self.phase is Phase.LOST:
            return None
        self._waiting = None
        if self._state is None:
            self._begin(scan.span[1])
            return None
        return self._follow(self._state, scan)

    def _begin(self, t: float) -> None:
        assert self._initialisation is not None
        begun = self._initialisation.begin(t)
        if begun is None:
            return
        self._state, self._covariance = begun
        self._origin = self._state.position
        self._t = self._fixed_at = self.begun_at = t
        self._bridge.reached(t)
        self._initialisation = None
        self.phase, self.text = Phase.TRACKING, ""

    def _follow(self, state: FilterState, scan: LidarScan) -> Fix | None:
        start, end = scan.span
        if start < self._t - 1e-6:
            return None
        measured = self._memory.take(self._t, end)
        gap = measured.largest_gap(self._t, end)
        if not len(measured) or gap > LARGEST_GAP:
            self._bridge_gap(state, end, gap)
            return None
        predicted = predict(state, self._covariance, measured, self._t, end, self._noise)
        still = deskew(scan, predicted.track, REACH)
        match = self._matcher.match(predicted, still)
        posterior = match.posterior
        nis = 0.0
        if match.result is not None:
            nis = match.result.nis
            self._monitor.observe(match.result, posterior)
        self._go_to(end, posterior.state, posterior.covariance)
        self._fixed_at = end
        if self._monitor.failure:
            self._lose(self._monitor.failure)
        else:
            self.phase, self.text = (Phase.REJECTING if self._monitor.rejecting else Phase.TRACKING), ""
        return Fix(
            end,
            posterior.state,
            posterior.covariance,
            match.agreement,
            match.accepted,
            nis,
            self._origin,
            self._way,
            still,
        )

    def _bridge_gap(self, state: FilterState, end: float, gap: float) -> None:
        """Bridge a gap in inertial measurements by navigation, up to the scan's `end`, or up to a later scan's.

        If the measurements stay away, odometry is lost as without scans.
        """
        self.phase, self.text = Phase.REJECTING, f"inertial measurements were missing for {gap:.2f} s"
        crossed = self._bridge.over(state, self._covariance, end)
        if crossed is not None and end - self._t <= PATIENCE:
            self._go_to(end, *crossed)
            return
        self.text += ", and navigation does not tell how the drone moved meanwhile"
        if end - self._t > PATIENCE:
            self._lose(self.text)

    def _go_to(self, t: float, state: FilterState, covariance: Floats) -> None:
        if self._state is not None:
            self._way += float(np.linalg.norm(state.position - self._state.position))
        self._t, self._state, self._covariance = t, state, covariance
        self._bridge.reached(t)

    def _lose(self, why: str) -> None:
        self.phase, self.text = Phase.LOST, why
