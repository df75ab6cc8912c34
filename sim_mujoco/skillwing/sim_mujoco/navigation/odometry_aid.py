"""Whether odometry's velocity may keep navigation true while there are no fixes.

An autopilot calls it aiding by external vision. What odometry says is gated as fixes are, but nothing absolute is left
then to hold it against: an error that grows slowly enough would be followed by navigation, and the gate with it. So
odometry has to earn its say beforehand, by agreeing with navigation while fixes vouch for that, and loses it by
contradicting the inertial measurements later, until there are fixes again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Vector

GATED = 0.1
"""Standard deviation that odometry's velocity is gated with [m/s], of each axis."""
WEIGHED = 0.5
"""And the one that it is weighed with. Where nothing holds it along its track, odometry slips for seconds, so that
averaging ten reports a second helps little. As white noise of this size the reports lead the position as far astray."""
PROOF = 10
"""So many reports in a row have to agree with navigation while fixes keep that true."""
DOUBTFUL = 5
"""So many contradictions in a row cost odometry its say."""


@dataclass(frozen=True, slots=True)
class OdometryReport:
    """What odometry says of the moment `t`: the `velocity` along the axes that the body had then, FLU [m/s].

    Its frame has drifted away from navigation's, which does not show in these axes. `since` is when this odometry
    began, and `good` whether it believes in itself.
    """

    t: float
    since: float
    velocity: Vector
    good: bool


class Reputation:
    """What one odometry's reports were worth so far."""

    def __init__(self) -> None:
        self.earned = False
        """Whether it may lead navigation."""
        self._since = math.nan
        self._agreed = self._contradicted = 0

    def meet(self, since: float) -> None:
        """A report of the odometry that began at `since`: another one than before has earned nothing yet."""
        if since != self._since:
            self.earned, self._since = False, since
            self._agreed = self._contradicted = 0

    def observe(self, *, agrees: bool, fixed: bool) -> None:
        """A report agrees with navigation or contradicts it; `fixed` if fixes keep navigation true."""
        if agrees:
            self._agreed += fixed
            self._contradicted = 0
        else:
            self._agreed = 0
            self._contradicted += 1
        self.earned = (self.earned or self._agreed >= PROOF) and self._contradicted < DOUBTFUL
