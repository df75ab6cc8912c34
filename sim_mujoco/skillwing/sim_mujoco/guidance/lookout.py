"""What guidance makes of the obstacle node's reports while it flies a segment."""

from __future__ import annotations

from enum import Enum, auto

from skillwing.sim_mujoco.topics import ObstacleSource, ObstacleStatus

MARGIN = 2.0
"""Free distance that must remain in front of the drone after braking [m]."""
STALE = 0.6
"""Reports whose measurement is older than this are no information [s]."""
_REACTION = 0.3
_SETTLING = 0.25
"""A report measured sooner than this after a segment began may still speak of the segment before [s]."""


class View(Enum):
    """What is known of the way ahead."""

    UNWATCHED = auto()
    CLEAR = auto()
    BLOCKED = auto()
    BLIND = auto()


class Lookout:
    """Remembers whether a segment is watched: once it is, its way must stay in view until its end."""

    def __init__(self) -> None:
        self._report: ObstacleStatus | None = None
        self._began = 0.0
        self._watched = False

    def report(self, status: ObstacleStatus) -> None:
        self._report = status

    def begin(self, t: float) -> None:
        """A new segment begins. If the way was in view until now it is expected to stay so."""
        self._began, self._watched = t, self.is_fresh(t)

    @property
    def free_distance(self) -> float | None:
        return self._report.free_distance if self._report else None

    def is_fresh(self, t: float) -> bool:
        """The latest report says how far the way is free, and is young enough to be believed."""
        report = self._report
        return (
            report is not None
            and report.source is not ObstacleSource.NONE
            and report.free_distance is not None
            and report.stamp is not None
            and t - report.stamp <= STALE
        )

    def view(self, t: float, speed: float, remaining: float, deceleration: float) -> View:
        """Judge the way ahead at this speed [m/s], with `remaining` metres to the segment's end."""
        report = self._report
        if not self.is_fresh(t) or report is None or report.stamp is None or report.free_distance is None:
            return View.BLIND if self._watched else View.UNWATCHED
        if report.stamp < self._began + _SETTLING:
            return View.CLEAR
        self._watched = True
        needed = speed * speed / (2.0 * deceleration) + _REACTION * speed + MARGIN
        # Where the whole rest of the segment is free the report ends with it.
        if report.free_distance < min(needed, remaining - 0.3):
            return View.BLOCKED
        return View.CLEAR
