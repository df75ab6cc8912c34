"""Aiding of navigation by odometry's velocity while there are no fixes; autopilots call it external vision.

Its reports are gated as fixes are, but without fixes there is no absolute reference: navigation and its gate would
follow an error that grows slowly. So odometry has to qualify beforehand, by agreement with navigation that has fixes.
It loses this status by contradictions to the inertial measurements, until there are fixes again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector

GATED = 0.1
"""Standard deviation of odometry's velocity for the gate [m/s], of each axis."""
WEIGHED = 0.5
"""Standard deviation for the update [m/s]. It is larger because errors of odometry last for seconds where little
constrains it along the track; white noise of this size causes the same position error."""
PROOF = 10
"""Number of reports in a row that have to agree with navigation while it has fixes."""
CONTRADICTIONS = 5
"""Number of contradictions in a row after which odometry no longer aids."""


@dataclass(frozen=True, slots=True)
class OdometryReport:
    """A report of odometry for the time `t`: the `velocity` in body axes, FLU [m/s].

    The drift of odometry's frame has no effect in these axes. `since` is the start of this odometry; `good` is its own
    assessment of its tracking.
    """

    t: float
    since: float
    velocity: Vector
    good: bool


class Reputation:
    """Record of the agreement between one odometry and navigation."""

    def __init__(self) -> None:
        self.earned = False
        """True if this odometry may aid navigation."""
        self._since = math.nan
        self._agreed = self._contradicted = 0

    def reported_by(self, since: float) -> None:
        """Take the start of the reporting odometry; a new one has to qualify again."""
        if since != self._since:
            self.earned, self._since = False, since
            self._agreed = self._contradicted = 0

    def observe(self, *, agrees: bool, fixed: bool) -> None:
        """Take the agreement of a report with navigation; `fixed` if that has fixes."""
        if agrees:
            self._agreed += fixed
            self._contradicted = 0
        else:
            self._agreed = 0
            self._contradicted += 1
        self.earned = (self.earned or self._agreed >= PROOF) and self._contradicted < CONTRADICTIONS
