"""The fence guard: it detects that the drone could soon no longer stop inside the fence.

Guidance keeps its setpoints inside. The guard watches the motion itself, caused by setpoints or wind.
"""

from __future__ import annotations

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, clamp

REACTION = 0.25
"""Time until the drone begins to brake [s]."""
LEVEL_BRAKING, UPRIGHT_BRAKING = 3.5, 3.0
"""Reliable deceleration, also in wind: horizontal, vertical [m/s2]."""
MARGIN = 0.2
"""Distance from the fence at which the drone comes to rest [m]."""
_DRIFTING = 0.2
"""Speed below which the margin shrinks in proportion, so that a hover inside the margin is allowed [m/s]."""
_WALLS = (("west", "east"), ("south", "north"), ("lower", "upper"))


class FenceGuard:
    """Guard of the four walls and the ceiling. There is no guard of the floor, since a drone has to land."""

    def __init__(self, fence: Box) -> None:
        self._fence = fence

    def threatened(self, position: Vector, velocity: Vector) -> str | None:
        """The wall that this motion would cross unless the drone brakes now: "east", "upper", ...; None if none."""
        for axis, (low_name, high_name) in enumerate(_WALLS):
            x, v = position[axis], velocity[axis]
            if self._breaks(self._fence.high[axis] - x, v, axis):
                return high_name
            if axis != 2 and self._breaks(x - self._fence.low[axis], -v, axis):
                return low_name
        return None

    def inside(self, position: Vector) -> Vector:
        """The nearest place that keeps the margin from walls and ceiling."""
        low, high = self._fence.low, self._fence.high
        x, y = (clamp(position[i], low[i] + MARGIN, high[i] - MARGIN) for i in (0, 1))
        return x, y, min(position[2], high[2] - MARGIN)

    @staticmethod
    def _breaks(gap: float, closing: float, axis: int) -> bool:
        closing = max(0.0, closing)
        margin = MARGIN * min(1.0, closing / _DRIFTING)
        braking = UPRIGHT_BRAKING if axis == 2 else LEVEL_BRAKING
        return gap < margin + REACTION * closing + closing * closing / (2.0 * braking)
