"""The last line of defence of the fence: notices that the drone could soon no longer stop inside it.

Guidance keeps what it asks for inside; this looks at the motion itself, whoever asked for it, and at the wind's doing.
"""

from __future__ import annotations

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, clamp

REACTION = 0.25
"""Time until the drone begins to brake [s]."""
LEVEL_BRAKING, UPRIGHT_BRAKING = 3.5, 3.0
"""What braking can be relied upon, in wind as well [m/s2]."""
MARGIN = 0.2
"""From the fence, where the drone comes to rest [m]."""
_DRIFTING = 0.2
"""Of the margin whoever comes more slowly than this [m/s] gets a share only: who hovers within it is left alone."""
_WALLS = (("west", "east"), ("south", "north"), ("lower", "upper"))


class FenceGuard:
    """Looks at the four walls and the ceiling; the floor is the ground's business, since a drone has to land."""

    def __init__(self, fence: Box) -> None:
        self._fence = fence

    def threatened(self, position: Vector, velocity: Vector) -> str | None:
        """The wall that this motion would break unless the drone brakes now: "east", "upper", ...; None if none."""
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
