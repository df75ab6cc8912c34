"""Path monitor: visibility of the way ahead by the obstacle node's reports, and the speed that it permits."""

from __future__ import annotations

import math
from enum import Enum, auto

from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.trajectory import BRAKING
from skillwing.onboard.topics.obstacles import ObstacleSource, ObstacleStatus
from skillwing.services.protocol import ErrorCode

MARGIN = TIP_RADIUS + 1.2
"""Distance between the drone's centre and an obstacle after a stop for it [m]."""
LEAST_MARGIN = TIP_RADIUS + 0.5
"""The same for an obstacle that appears only at the horizon: the drone, drift and noise [m]."""
ROOM_AT_THE_END = TIP_RADIUS + 0.4
"""An obstacle nearer than this behind the end of a way blocks it [m]."""
STALE = 0.6
"""Largest age of the measurement in a report [s]."""
REPORTED = 0.1
"""Period of reports [s]."""
_TILT_TIME = 0.1
"""Time that the autopilot takes to tilt for braking [s]."""
LATENCY = 0.2 + REPORTED + _TILT_TIME
"""Longest time from an obstacle in view to braking [s]: 0.1 s of a scan, 0.1 s until a second one agrees, the period of
reports, and the autopilot's tilt."""
SILENCE = STALE + 0.02 + _TILT_TIME
"""Longest time from the last measurement to braking, if no other one comes [s]: until it is stale, the next tick, and
the autopilot's tilt."""
SETTLE_TIME = 0.25
"""Time after the start of a way in which a report may still be about the previous way [s]."""
GONE = 3.0
"""Time without a report after which the depth map counts as ended [s]."""
MIN_SPEED = 0.3
"""Speed that is permitted for any view, even the shortest [m/s]."""
TOLERANCE = 0.1
"""Permitted excess over the speed limit of the view, because the horizon of a bent way varies a little [m/s]."""
STEEPEST = math.radians(20.0)
"""Steepest way that a source along the nose sees, with the nose along the way [rad]. The camera sees 27 degrees up and
down, and the drone tilts to accelerate."""
STEP = 0.5
"""Difference in height up to which the end of a way is in view at any distance [m]."""


def stopping_distance(speed: float, margin: float = MARGIN, latency: float = LATENCY) -> float:
    """Free distance ahead that a drone at this speed [m/s] needs to stop `margin` before an obstacle [m]."""
    return speed * speed / (2.0 * BRAKING) + latency * speed + margin


def fastest(horizon: float) -> float:
    """Highest speed with a stop for an obstacle that appears at the horizon as the sensor falls silent [m/s].

    It is the inverse of `stopping_distance`."""
    room = horizon - LEAST_MARGIN
    if room <= 0.0:
        return MIN_SPEED
    lag = SILENCE * BRAKING
    return max(MIN_SPEED, math.sqrt(lag * lag + 2.0 * BRAKING * room) - lag)


class PathVisibility(Enum):
    """Visibility of the way ahead."""

    UNWATCHED = auto()
    """No depth map, or one whose sensor is not meant to look along this way."""
    CLEAR = auto()
    BLOCKED = auto()
    BLIND = auto()
    """Way out of view, although it was in view or should be."""
    TOO_FAST = auto()
    """Clear, but the view is too short for the speed."""


class PathMonitor:
    """Monitor of the present way: once the way was in view, it must stay so until its end."""

    def __init__(self) -> None:
        self._report: ObstacleStatus | None = None
        self._began = 0.0
        self._expected = False
        self._watched = False
        self._across: bool | None = None

    def report(self, status: ObstacleStatus) -> None:
        self._report = status

    def begin(self, t: float, *, across: bool | None = None) -> None:
        """Begin a new way at `t`. A depth map is expected to report on it, even if its last measurement is old: a short
        silence of its sensor must not let the drone fly unwatched.

        `across`: the side (True) or the nose (False) that the drone has turned along the way; None if others command
        the heading. A source that looks there must see the way.
        """
        self._began, self._watched, self._expected = t, False, self.has_depth_map(t)
        self._across = across

    @property
    def free_distance(self) -> float | None:
        return self._report.free_distance if self._report else None

    @property
    def looks_across(self) -> bool:
        """True if the depth map's sensor looks to the sides of the nose."""
        return self._report is not None and self._report.across

    def require_in_view(self, start: Vector, end: Vector, t: float) -> None:
        """Raise CommandRefusedError if a straight way is too steep for a source along the nose."""
        level, up = math.dist(start[:2], end[:2]), end[2] - start[2]
        if self.looks_across or not self.has_depth_map(t) or abs(up) <= STEP + level * math.tan(STEEPEST):
            return
        slope, steepest = math.degrees(math.atan2(abs(up), level)), math.degrees(STEEPEST)
        raise CommandRefusedError(
            ErrorCode.NOT_ALLOWED,
            f"the way is {slope:.0f} degrees steep, and the sensor of the depth map sees {steepest:.0f} at most",
            f"{'climb' if up > 0.0 else 'descend'} to {end[2]:.1f} m first, then fly level",
        )

    def has_depth_map(self, t: float) -> bool:
        """Test for a depth map of any direction and age."""
        report = self._report
        return report is not None and report.source is not ObstacleSource.NONE and t - report.t <= GONE

    def has_report(self, t: float) -> bool:
        """Test for a fresh report, measured after the start of the way."""
        report = self._fresh(t)
        return report is not None and report.stamp is not None and report.stamp >= self._began + SETTLE_TIME

    def may_go_on(self, t: float) -> bool:
        """Test for a way in view; or never in view, because the depth map looks elsewhere or has ended."""
        report = self._fresh(t)
        if report is None:
            return self._is_unwatched
        return report.free_distance is not None or not self._must_see(report)

    def may_join(self, t: float, speed: float, remaining: float) -> bool:
        """Test for a way that may begin before the drone is at rest: without a depth map, or in view and free."""
        if not self.has_report(t):
            return self._is_unwatched
        return self.free_distance is not None and self.view(t, speed, remaining) is PathVisibility.CLEAR

    def speed_limit(self, t: float) -> float:
        """Speed limit for the sensor's horizon [m/s]; infinity without a depth map."""
        report = self._fresh(t)
        return math.inf if report is None or report.horizon <= 0.0 else fastest(report.horizon)

    def view(self, t: float, speed: float, remaining: float) -> PathVisibility:
        """Visibility of the way ahead at this speed [m/s], with `remaining` metres to its end."""
        report = self._fresh(t)
        if report is None or report.stamp is None or report.stamp < self._began + SETTLE_TIME:
            return self._without_report(t)
        if report.free_distance is None:
            return PathVisibility.BLIND if self._must_see(report) else PathVisibility.UNWATCHED
        self._watched = True
        # The drone has flown some of the distance in an overdue report. If the whole rest of the way is free, the
        # reported distance ends a little behind it.
        free = report.free_distance - speed * max(0.0, t - report.t - REPORTED)
        if free < min(stopping_distance(speed), remaining + ROOM_AT_THE_END):
            return PathVisibility.BLOCKED
        return PathVisibility.TOO_FAST if speed > fastest(report.horizon) + TOLERANCE else PathVisibility.CLEAR

    def _without_report(self, t: float) -> PathVisibility:
        """Visibility without a fresh report on this way."""
        if self._is_unwatched:
            return PathVisibility.UNWATCHED
        waiting = not self._watched and t - self._began <= SETTLE_TIME + STALE
        return PathVisibility.CLEAR if waiting else PathVisibility.BLIND

    def _must_see(self, report: ObstacleStatus) -> bool:
        """Test for a way that was in view, or that this source should see after the drone's turn."""
        return self._watched or report.across is self._across

    @property
    def _is_unwatched(self) -> bool:
        """Test for a way without reports, now or later: there was no depth map, or it has ended."""
        given_up = self._report is None or self._report.source is ObstacleSource.NONE
        return not self._watched and (given_up or not self._expected)

    def _fresh(self, t: float) -> ObstacleStatus | None:
        report = self._report
        if report is None or report.source is ObstacleSource.NONE or report.stamp is None or t - report.stamp > STALE:
            return None
        return report
