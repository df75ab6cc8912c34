"""Ground of a world: terrain, obstacles and paving. Paving is flat: pictures show it, sensors do not measure it."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle
from skillwing.sim_mujoco.world.things.shapes import Colour

ASPHALT: Colour = (0.36, 0.36, 0.38)
FOOTWAY: Colour = (0.62, 0.60, 0.57)
GRAVEL: Colour = (0.60, 0.55, 0.46)
CONCRETE: Colour = (0.58, 0.58, 0.56)
PAINT: Colour = (0.85, 0.85, 0.82)


@dataclass(frozen=True, slots=True)
class Strip:
    """Paved ground from `start` to `end`, `width` metres wide. Of overlapping strips the later one is on top."""

    start: Point
    end: Point
    width: float
    colour: Colour


@dataclass(frozen=True, slots=True)
class Ground:
    """Terrain, obstacles, and paved strips."""

    terrain: Terrain
    obstacles: tuple[Obstacle, ...]
    paving: tuple[Strip, ...] = ()
