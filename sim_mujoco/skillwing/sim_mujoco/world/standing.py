"""Places beside the pad where several drones stand at the start."""

from __future__ import annotations

import math

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.site import Site

STANDING_RADIUS = 4.0
"""Distance of the places from the pad [m]. The ground is free of obstacles up to 5 m, and the drones need 0.84 m."""
LEAST_GAP = 1.5
"""Least distance between two standing drones, tip to tip [m]."""
MOST_DRONES = math.floor(math.pi / math.asin((LEAST_GAP / 2.0 + TIP_RADIUS) / STANDING_RADIUS))


def standing_places(site: Site, count: int) -> tuple[Point, ...]:
    """Places of `count` drones: the pad for a single one, else a circle around it, from the north counter-clockwise.

    Raises ValueError for more drones than there is room for, and for none.
    """
    if not 1 <= count <= MOST_DRONES:
        raise ValueError(f"there is room for 1 to {MOST_DRONES} drones around the pad, not for {count}")
    if count == 1:
        return (site.home,)
    x, y = site.home
    angles = (math.pi / 2.0 + 2.0 * math.pi * number / count for number in range(count))
    return tuple(
        (round(x + STANDING_RADIUS * math.cos(angle), 3), round(y + STANDING_RADIUS * math.sin(angle), 3))
        for angle in angles
    )
