"""LiDAR-inertial odometry as one object without I/O: feed it measurements, and take a fix for each scan."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.odometry.deskew import StillScan, deskew
from skillwing.onboard.odometry.divergence_monitor import Vigil
from skillwing.onboard.odometry.inertial import Inertial, InertialMemory
from skillwing.onboard.odometry.initialisation import Beginning
from skillwing.onboard.odometry.matching import MakeMatcher, PlaneMatcher
from skillwing.onboard.odometry.navigation_bridge import NavigationBridge
from skillwing.onboard.odometry.propagation import ImuNoise, predict
from skillwing.onboard.odometry.registration import Agreement
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.odometry.state import GRAVITY, POSITION, SIZE, G, State
from skillwing.onboard.sensor_data.scans import LidarScan, PlacedPoints
from skillwing.onboard.topics.navigation import Navigation

REACH: Final = 60.0
"""Returns from farther away are not used [m]."""
PATIENCE: Final = 2.0
"""Without scans, or without anything, for so long the drone is lost [s]."""
HUNGRY_SCANS: Final = 5
"""So many scans without inertial measurements in between mean that only these are missing, and will be."""
KEPT: Final = 2.0 * PATIENCE
"""Inertial measurements are kept for so long: by then a drone that nothing has asked for them is lost [s]."""
LARGEST_GAP: Final = 0.1
"""Where inertial measurements are missing for longer, navigation has to say how the drone has moved [s]."""

DRIFT: Final = 0.0015
"""Standard deviation of the drift along each axis, as a share of the way. About twice what sound flights drift, to be
on the safe side: docs/mapping.md has errors in units of it."""


class Phase(StrEnum):
    STARTING = "STARTING"  # there is no pose yet
    TRACKING = "TRACKING"
    DOUBTING = "DOUBTING"  # the last scans did not fit: the pose comes from inertial measurements
    LOST = "LOST"  # poses are not to be believed any more; a new start is needed


@dataclass(frozen=True)
class Fix:
    """What a scan made known: the state at `t` in the frame of the planes, the covariance (N, N) of its error, how
    the scan agrees with the map, and its returns. `believed`: the scan was used; `surprise`: how much it and those
    before it contradict what was predicted (`vigil.py`); `origin` (3,): where odometry began; `way`: how far the drone
    has come since [m]."""

    t: float
    state: State
    covariance: Floats
    agreement: Agreement
    believed: bool
    surprise: float
    origin: Floats
    way: float
    scan: StillScan

    @cached_property
    def levelled(self) -> State:
        """The state as it is given out.

        The frame of the planes leans as the first pose did, by up to a degree, and what is far away would be mapped too
        high or too low. Gravity becomes known in flight; with it the lean does, and is taken out.
        """
        return self.state.levelled(self.origin)

    @property
    def position_sigma(self) -> Floats:
        """Standard deviation (3,) of the levelled position [m].

        The filter takes what was laid before the last keyframes for true. That part of the map has drifted, by a share
        of the way that was measured on flights, and leans by what gravity may be wrong.
        """
        variances = np.diag(self.covariance)
        lean_x, lean_y, _ = variances[GRAVITY] / G**2
        x, y, z = (self.state.position - self.origin) ** 2
        leaning = np.array([lean_x * z, lean_y * z, lean_x * x + lean_y * y])
        return np.sqrt(variances[POSITION] + leaning + (DRIFT * self.way) ** 2)

    def placed(self, reach: float) -> PlacedPoints:
        """The returns within `reach` of the sensor [m], in the world frame."""
        state = self.levelled
        turn = state.turn.astype(np.float32)
        points = turn @ self.scan.within(reach).T + state.position.astype(np.float32)[:, None]
        return PlacedPoints(self.t, state.turn, state.to_world(self.scan.sensor), points.T)


class Odometry:
    """One flight's odometry inside the box from `low` to `high`.

    Its frame is ENU as navigation has it when odometry begins; see `Beginning`. A scan is worked on once the inertial
    measurements cover it, so that `imu` and `scan` both may give a fix.
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
        """Forget everything, and begin anew from navigation."""
        self.phase, self.text = Phase.STARTING, "waits for navigation and for two seconds at rest"
        self.begun_at: float | None = None
        self._beginning: Beginning | None = Beginning()
        self._memory = InertialMemory(KEPT)
        self._waiting: LidarScan | None = None
        self._hungry = 0
        self._bridge = NavigationBridge()
        self._vigil = Vigil()
        self._matcher = self._make_matcher(self._low, self._high)
        self._t = self._fixed_at = self._way = 0.0
        self._state: State | None = None
        self._origin = np.zeros(3)
        self._covariance = np.zeros((SIZE, SIZE))

    def navigation(self, navigation: Navigation) -> None:
        """A navigation solution: it matters only until odometry has begun, and where measurements are missing."""
        self._bridge.navigation(navigation)
        if self._beginning is not None:
            self._beginning.navigation(navigation)

    def imu(self, batch: Inertial) -> Fix | None:
        """A batch of inertial measurements."""
        if not self._memory.add(batch):
            return None
        self._hungry = 0
        if self._beginning is not None:
            self._beginning.imu(batch)
        return self._advance()

    def scan(self, scan: LidarScan) -> Fix | None:
        """A scan. One that comes while another still waits for inertial measurements takes its place."""
        self._waiting = scan
        self._hungry += 1
        return self._advance()

    def check(self, t: float) -> None:
        """Time has passed: notice when one of the sensors has fallen silent."""
        if self._state is None or self.phase is Phase.LOST:
            return
        covered = self._memory.covered_until
        if self._hungry >= HUNGRY_SCANS and covered is not None:
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
        assert self._beginning is not None
        begun = self._beginning.begin(t)
        if begun is None:
            return
        self._state, self._covariance = begun
        self._origin = self._state.position
        self._t = self._fixed_at = self.begun_at = t
        self._bridge.reached(t)
        self._beginning = None
        self.phase, self.text = Phase.TRACKING, ""

    def _follow(self, state: State, scan: LidarScan) -> Fix | None:
        start, end = scan.span
        if start < self._t - 1e-6:
            return None
        measured = self._memory.take(self._t, end)
        gap = measured.largest_gap(self._t, end)
        if not len(measured) or gap > LARGEST_GAP:
            self._cross(state, end, gap)
            return None
        predicted = predict(state, self._covariance, measured, self._t, end, self._noise)
        still = deskew(scan, predicted.track, REACH)
        match = self._matcher.match(predicted, still)
        posterior = match.posterior
        surprise = 0.0
        if match.judgement is not None:
            surprise = match.judgement.surprise
            self._vigil.observe(match.judgement, posterior)
        self._go_to(end, posterior.state, posterior.covariance)
        self._fixed_at = end
        if self._vigil.verdict:
            self._lose(self._vigil.verdict)
        else:
            self.phase, self.text = (Phase.DOUBTING if self._vigil.doubting else Phase.TRACKING), ""
        return Fix(
            end,
            posterior.state,
            posterior.covariance,
            match.agreement,
            match.believed,
            surprise,
            self._origin,
            self._way,
            still,
        )

    def _cross(self, state: State, end: float, gap: float) -> None:
        """Go on at `end`, from where the next scan is followed again; or at a later scan, if navigation is late.

        Measurements that go on being missing leave no scan to be followed, and that ends like no scans at all.
        """
        self.phase, self.text = Phase.DOUBTING, f"inertial measurements were missing for {gap:.2f} s"
        crossed = self._bridge.over(state, self._covariance, end)
        if crossed is not None and end - self._t <= PATIENCE:
            self._go_to(end, *crossed)
            return
        self.text += ", and navigation does not tell how the drone moved meanwhile"
        if end - self._t > PATIENCE:
            self._lose(self.text)

    def _go_to(self, t: float, state: State, covariance: Floats) -> None:
        if self._state is not None:
            self._way += float(np.linalg.norm(state.position - self._state.position))
        self._t, self._state, self._covariance = t, state, covariance
        self._bridge.reached(t)

    def _lose(self, why: str) -> None:
        self.phase, self.text = Phase.LOST, why
