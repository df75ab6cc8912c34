"""What a seed makes of a site."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.sim_mujoco.world.layouts.paving import Strip
from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle


@dataclass(frozen=True, slots=True)
class Ground:
    """Terrain, obstacles, and paved strips."""

    terrain: Terrain
    obstacles: tuple[Obstacle, ...]
    paving: tuple[Strip, ...] = ()
