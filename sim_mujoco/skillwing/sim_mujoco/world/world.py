"""A seeded world: its site for missions, and terrain and obstacles as a MuJoCo specification."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.kinds import KINDS, make_site
from skillwing.sim_mujoco.world.layouts.ground import Strip
from skillwing.sim_mujoco.world.scene import scene_spec
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.triangulation import face_colours, static_triangles

TERRAIN, BUILDING, OTHER = 0, 1, 2
LABELS: Final = ("terrain", "building", "other")
"""Names of the triangle labels, by value."""
_LABEL_OF = {"terrain": TERRAIN} | {k.value: BUILDING if k is ObstacleKind.BUILDING else OTHER for k in ObstacleKind}


@dataclass(frozen=True)
class World:
    """One world. Missions get only the `site`; the rest is truth for physics and metrics."""

    site: Site
    obstacles: tuple[Obstacle, ...]
    terrain: Terrain
    paving: tuple[Strip, ...] = ()

    @property
    def seed(self) -> int:
        return self.site.seed

    @property
    def route(self) -> tuple[Vector, ...]:
        """The waypoints in their order, from over home to over home."""
        return self.site.way

    @property
    def home(self) -> Point:
        return self.site.home

    @property
    def geofence(self) -> Box:
        return self.site.fence

    def fenced(self, fence: Box) -> World:
        """The same world inside another fence."""
        return replace(self, site=replace(self.site, fence=fence))

    def spec(self) -> mujoco.MjSpec:
        """A fresh specification of the static scene; a vehicle can be attached to it."""
        return scene_spec(self.terrain, self.obstacles)

    def triangles(self) -> Triangles:
        """Every surface as triangles with labels (see LABELS), taken from the compiled model."""
        return self._triangles

    def colours(self) -> NDArray[np.float32]:
        """Red, green and blue (M, 3), 0 to 1, of each triangle: for pictures only."""
        return face_colours(self.spec().compile())

    @cached_property
    def _triangles(self) -> Triangles:
        return static_triangles(self.spec().compile(), _LABEL_OF)


def make_world(seed: int, kind: str = "courtyard", scale: float = 1.0) -> World:
    """The world of this seed, kind and scale. Raises ValueError for an unknown kind or scale."""
    site = make_site(seed, kind, scale)
    ground = KINDS[kind].build(site)
    return World(site, ground.obstacles, ground.terrain, ground.paving)
