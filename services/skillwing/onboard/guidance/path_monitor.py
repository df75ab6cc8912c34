"""What guidance makes of the obstacle node's reports while it flies along a way."""

from __future__ import annotations

import math
from enum import Enum, auto

from skillwing.onboard.commands.authority import RefusedError
from skillwing.onboard.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.trajectory import BRAKING
from skillwing.onboard.topics.obstacles import ObstacleSource, ObstacleStatus
from skillwing.services.protocol import ErrorCode

MARGIN = TIP_RADIUS + 1.2
"""Distance between the drone's centre and an obstacle when it has stopped for it [m]."""
LEAST_MARGIN = TIP_RADIUS + 0.5
"""The same for what shows itself only at the very end of what can be seen: the drone, drift and noise [m]."""
ROOM_AT_THE_END = TIP_RADIUS + 0.4
"""What stands nearer than this behind the end of a way stands on it [m]."""
STALE = 0.6
"""Reports whose measurement is older than this are no information [s]."""
REPORTED = 0.1
"""Between two reports [s]."""
_LEAN = 0.1
"""Until the autopilot has leant back to brake [s]."""
LATENCY = 0.2 + REPORTED + _LEAN
"""At most so long after an obstacle could be seen the drone brakes for it [s]: 0.1 s of a scan, 0.1 s until a second
one agrees, and until the next report, and the autopilot's lean."""
SILENCE = STALE + 0.02 + _LEAN
"""At most so long after the last measurement the drone brakes because there is no other [s]: until it is stale, the
next tick, and the autopilot's lean."""
SETTLING = 0.25
"""A report measured sooner than this after a way began may still speak of the way before [s]."""
GONE = 3.0
"""An obstacle process that has said nothing for so long makes no depth map any more [s]."""
CRAWL = 0.3
"""No view is so short that it forbids this speed [m/s]."""
TOLERANCE = 0.1
"""By so much a drone may be faster than its view allows, for the reach of a bent way varies a little [m/s]."""
STEEPEST = math.radians(20.0)
"""Up to this slope a source that looks along the nose sees where a way leads, with the nose along it [rad]: the camera
sees 27 degrees up and down, and the drone leans to fly off."""
STEP = 0.5
"""So much higher or lower an end of a way is in view, however near [m]."""


def stopping_distance(speed: float, margin: float = MARGIN, latency: float = LATENCY) -> float:
    """Free way that a drone at this speed [m/s] needs ahead to stop so far (`margin`) before an obstacle [m]."""
    return speed * speed / (2.0 * BRAKING) + latency * speed + margin


def fastest(horizon: float) -> float:
    """The speed at which the drone can stop for what appears at the horizon as the sensor falls silent [m/s]:
    `stopping_distance` reversed."""
    room = horizon - LEAST_MARGIN
    if room <= 0.0:
        return CRAWL
    lag = SILENCE * BRAKING
    return max(CRAWL, math.sqrt(lag * lag + 2.0 * BRAKING * room) - lag)


class View(Enum):
    """What is known of the way ahead."""

    UNWATCHED = auto()
    """There is no depth map, or none that is meant to look along this way."""
    CLEAR = auto()
    BLOCKED = auto()
    BLIND = auto()
    """The way was in view, or should be, and is not."""
    TOO_FAST = auto()
    """Clear, but faster than the view reaches."""


class Lookout:
    """Remembers whether a way is watched: once it is, it must stay in view until its end."""

    def __init__(self) -> None:
        self._report: ObstacleStatus | None = None
        self._began = 0.0
        self._expected = False
        self._watched = False
        self._across: bool | None = None

    def report(self, status: ObstacleStatus) -> None:
        self._report = status

    def begin(self, t: float, *, across: bool | None = None) -> None:
        """A new way begins at `t`. If there is a depth map, a word on this way is expected of it, however old its last
        measurement: a sensor that is silent just now must not let the drone fly off unwatched.

        `across` tells what the drone has turned along the way, so that it be seen: a side (True) or the nose (False);
        None if it is left to others where the drone looks. A source that looks there must see the way.
        """
        self._began, self._watched, self._expected = t, False, self.has_depth_map(t)
        self._across = across

    @property
    def free_distance(self) -> float | None:
        return self._report.free_distance if self._report else None

    @property
    def looks_across(self) -> bool:
        """The depth map's sensor looks to the sides of the nose."""
        return self._report is not None and self._report.across

    def require_in_view(self, start: Vector, end: Vector, t: float) -> None:
        """Raise RefusedError if a straight way is too steep for what looks along the nose."""
        level, up = math.dist(start[:2], end[:2]), end[2] - start[2]
        if self.looks_across or not self.has_depth_map(t) or abs(up) <= STEP + level * math.tan(STEEPEST):
            return
        slope, steepest = math.degrees(math.atan2(abs(up), level)), math.degrees(STEEPEST)
        raise RefusedError(
            ErrorCode.NOT_ALLOWED,
            f"the way is {slope:.0f} degrees steep, and the sensor of the depth map sees {steepest:.0f} at most",
            f"{'climb' if up > 0.0 else 'descend'} to {end[2]:.1f} m first, then fly level",
        )

    def has_depth_map(self, t: float) -> bool:
        """Somebody makes one, of whatever direction and whether or not it is young enough to be believed."""
        report = self._report
        return report is not None and report.source is not ObstacleSource.NONE and t - report.t <= GONE

    def knows_the_way(self, t: float) -> bool:
        """The latest report is fresh and measured after the way began, so that it speaks of it if it can."""
        report = self._fresh(t)
        return report is not None and report.stamp is not None and report.stamp >= self._began + SETTLING

    def lets_go_on(self, t: float) -> bool:
        """The way that began last is in view; or it never was, and the depth map looks elsewhere or was given up."""
        report = self._fresh(t)
        if report is None:
            return self._is_unwatched
        return report.free_distance is not None or not self._must_see(report)

    def speed_limit(self, t: float) -> float:
        """No faster than this [m/s], as far as the sensor's reach is known; infinity without a depth map."""
        report = self._fresh(t)
        return math.inf if report is None or report.horizon <= 0.0 else fastest(report.horizon)

    def view(self, t: float, speed: float, remaining: float) -> View:
        """Judge the way ahead at this speed [m/s], with `remaining` metres to its end."""
        report = self._fresh(t)
        if report is None or report.stamp is None or report.stamp < self._began + SETTLING:
            return self._without_word(t)
        if report.free_distance is None:
            return View.BLIND if self._must_see(report) else View.UNWATCHED
        self._watched = True
        # Of what an overdue report has told, some has been flown since. Where the whole rest of the way is free the
        # report ends a little behind it.
        free = report.free_distance - speed * max(0.0, t - report.t - REPORTED)
        if free < min(stopping_distance(speed), remaining + ROOM_AT_THE_END):
            return View.BLOCKED
        return View.TOO_FAST if speed > fastest(report.horizon) + TOLERANCE else View.CLEAR

    def _without_word(self, t: float) -> View:
        """No fresh report speaks of this way, or not yet."""
        if self._is_unwatched:
            return View.UNWATCHED
        waiting = not self._watched and t - self._began <= SETTLING + STALE
        return View.CLEAR if waiting else View.BLIND

    def _must_see(self, report: ObstacleStatus) -> bool:
        """The way was in view, or the drone has turned so that this source looks along it."""
        return self._watched or report.across is self._across

    @property
    def _is_unwatched(self) -> bool:
        """No word on this way has come, and none is expected: there was no depth map, or it was given up meanwhile."""
        given_up = self._report is None or self._report.source is ObstacleSource.NONE
        return not self._watched and (given_up or not self._expected)

    def _fresh(self, t: float) -> ObstacleStatus | None:
        report = self._report
        if report is None or report.source is ObstacleSource.NONE or report.stamp is None or t - report.stamp > STALE:
            return None
        return report
