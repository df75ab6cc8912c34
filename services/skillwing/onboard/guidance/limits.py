"""Limits of guidance: the fence with a margin, heights and speeds."""

from __future__ import annotations

import math

from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, clamp
from skillwing.services.protocol import ErrorCode

LOWEST, HIGHEST = 1.0, 120.0
"""Lowest and highest target above the home pad, whatever the fence [m]; 120 m is the limit of EU law."""
FENCE_MARGIN = 0.5
"""Distance of targets and setpoints from the fence [m]. Wind and overshoot carry the drone less far past them. So it
neither breaks the fence, nor comes so near that the autopilot's guard stops it."""
MAX_SPEED = 6.0
SETPOINT_TIMEOUT = 0.5
"""Age above which an autopilot ignores a setpoint; without a fresh one it holds its position [s]."""
HOLD_TIME = 5.0
"""Time for which an autopilot without setpoints holds its position before it lands [s]."""
_BLOWN_OUT = 1.0
"""Distance outside the fence from which the drone counts as having left it [m]."""


class GuidanceLimits:
    """Fence, altitude limits and speed limit of one drone.

    A target has to lie between the altitude limits; a setpoint may be lower, on the way up or down.
    """

    def __init__(self, fence: Box) -> None:
        self._fence = fence
        west, south, floor = (x + FENCE_MARGIN for x in fence.low)
        east, north, ceiling = (x - FENCE_MARGIN for x in fence.high)
        self.targets = Box((west, south, max(floor, LOWEST)), (east, north, min(ceiling, HIGHEST)))
        """The box of permitted targets."""

    def require_inside(self, *targets: Vector) -> None:
        """Raise CommandRefusedError unless all these targets are permitted."""
        for target in targets:
            if not self.targets.contains(target):
                raise CommandRefusedError(
                    ErrorCode.NOT_ALLOWED,
                    "the target ({:.1f}, {:.1f}, {:.1f}) lies outside the geofence, or too near to it".format(*target),
                    f"stay between {_text(self.targets.low)} and {_text(self.targets.high)}",
                )

    @staticmethod
    def require_speed(speed: float) -> None:
        if not 0.0 < speed <= MAX_SPEED:
            raise CommandRefusedError(
                ErrorCode.BAD_REQUEST, f"a speed of {speed:g} m/s cannot be flown", f"give 0 to {MAX_SPEED:g} m/s"
            )

    def has_left(self, place: Vector) -> bool:
        """Test for a drone outside the fence by more than a gust carries it."""
        return not self._fence.contains(place, _BLOWN_OUT)

    def confine(self, place: Vector, *, landing: bool = False) -> Vector:
        """The place itself, or the nearest one with the margin. A landing ends on the ground, however low that is."""
        low, high = self.targets.low, self.targets.high
        floor = -math.inf if landing else self._fence.low[2]
        return (
            clamp(place[0], low[0], high[0]),
            clamp(place[1], low[1], high[1]),
            clamp(place[2], floor, high[2]),
        )


def _text(place: Vector) -> str:
    return "({:g}, {:g}, {:g})".format(*place)
