"""The radio shadow of a building, for flights that are to lose their video behind it."""

from __future__ import annotations

from skillwing.sim_mujoco.link.radio import RadioZone
from skillwing.sim_mujoco.world.site import Target

POOR, CRITICAL = 0.4, 0.008
"""What the link carries beside a building and behind it, as seen from home [Mbit/s]."""
RIM = 30.0
"""How far its shadow reaches beyond the circle round it [m]."""
LOW, HIGH = -10.0, 100.0


def shadow_of(target: Target) -> tuple[RadioZone, RadioZone]:
    """Beside the building and behind it: the farther round, the worse the link. Home lies to the west of it."""
    (x, y), radius = target.centre, target.radius

    def east_of(west: float, bandwidth: float) -> RadioZone:
        low, high = (west, y - radius - RIM, LOW), (x + radius + RIM, y + radius + RIM, HIGH)
        return RadioZone(low=low, high=high, bandwidth=bandwidth)

    return east_of(x - 0.3 * radius, POOR), east_of(x + 0.6 * radius, CRITICAL)
