"""A seeded world: terrain and obstacles as a MuJoCo specification, and what a mission may know of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import mujoco
import numpy as np

from skillwing.sim_mujoco.geofence import COURTYARD, COURTYARD_FENCE, Box
from skillwing.sim_mujoco.world.facade import building_mesh
from skillwing.sim_mujoco.world.layout import HOME, ROUTE, Kind, Obstacle, make_courtyard
from skillwing.sim_mujoco.world.terrain import Terrain, make_terrain
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.triangulation import static_triangles

TERRAIN, BUILDING, OTHER = 0, 1, 2
LABELS: Final = ("terrain", "building", "other")
"""Names of the triangle labels, by value."""
_LABEL_OF = {"terrain": TERRAIN} | {k.value: BUILDING if k is Kind.BUILDING else OTHER for k in Kind}
_SINK = 0.8
"""How deep obstacles reach below the home pad, so that none floats over a hollow [m]."""


@dataclass(frozen=True)
class World:
    """One world. The drone knows only `route`, `home` and `geofence`; the rest is truth for physics and metrics."""

    seed: int
    kind: str
    obstacles: tuple[Obstacle, ...]
    terrain: Terrain
    route: tuple[tuple[float, float, float], ...] = ROUTE
    home: tuple[float, float] = HOME
    area: Box = COURTYARD
    geofence: Box = COURTYARD_FENCE

    def spec(self) -> mujoco.MjSpec:
        """A fresh specification of the static scene; a vehicle can be attached to it."""
        spec = mujoco.MjSpec()
        _add_terrain(spec, self.terrain)
        for obstacle in self.obstacles:
            _add_obstacle(spec, obstacle)
        return spec

    def triangles(self) -> Triangles:
        """Every surface as triangles with labels (see LABELS), taken from the compiled model."""
        return self._triangles

    @cached_property
    def _triangles(self) -> Triangles:
        return static_triangles(self.spec().compile(), _LABEL_OF)


def make_world(seed: int, kind: str = "courtyard") -> World:
    """The world of this seed. The only kind so far is 'courtyard'; another raises ValueError."""
    if kind != "courtyard":
        raise ValueError(f"there is no world of kind {kind!r}; the known kind is 'courtyard'")
    terrain = make_terrain(np.random.default_rng((seed, 1)), centre=(15.0, 10.0), half=(35.0, 30.0))
    return World(seed, kind, make_courtyard(seed), terrain)


def _add_terrain(spec: mujoco.MjSpec, terrain: Terrain) -> None:
    rows, columns = terrain.heights.shape
    span = terrain.highest - terrain.lowest
    field = spec.add_hfield(name="terrain", nrow=rows, ncol=columns, size=[*terrain.half, span, 1.0])
    # The compiler stretches heights to 0..1, so the lowest point is put back by the geom's position.
    field.userdata = terrain.heights.ravel()
    spec.worldbody.add_geom(
        name="terrain-0",
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname="terrain",
        pos=[*terrain.centre, terrain.lowest],
    )


def _add_obstacle(spec: mujoco.MjSpec, obstacle: Obstacle) -> None:
    if obstacle.kind is Kind.TREE:
        _add_tree(spec, obstacle)
    elif obstacle.kind is Kind.BUILDING:
        _add_building(spec, obstacle)
    elif obstacle.kind is Kind.POLE:
        _add_column(spec, obstacle.name, obstacle.footprint.centre, obstacle.footprint.radius, obstacle.height)
    else:
        half = (obstacle.height + _SINK) / 2
        spec.worldbody.add_geom(
            name=obstacle.name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[*obstacle.footprint.half, half],
            pos=[*obstacle.footprint.centre, obstacle.height - half],
            quat=_about_z(obstacle.footprint.yaw),
        )


def _add_tree(spec: mujoco.MjSpec, tree: Obstacle) -> None:
    crown = tree.footprint.radius
    half = min(0.35 * tree.height, 1.4 * crown)
    _add_column(spec, f"{tree.name}-trunk", tree.footprint.centre, 0.15 * crown, tree.height - half)
    spec.worldbody.add_geom(
        name=f"{tree.name}-crown",
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=[crown, crown, half],
        pos=[*tree.footprint.centre, tree.height - half],
    )


def _add_building(spec: mujoco.MjSpec, building: Obstacle) -> None:
    half = building.footprint.half
    vertices, faces = building_mesh((2 * half[0], 2 * half[1], building.height + _SINK))
    mesh = spec.add_mesh(name=building.name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = vertices.ravel()
    mesh.userface = faces.ravel()
    spec.worldbody.add_geom(
        name=building.name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=building.name,
        pos=[*building.footprint.centre, -_SINK],
        quat=_about_z(building.footprint.yaw),
    )


def _add_column(spec: mujoco.MjSpec, name: str, centre: tuple[float, float], radius: float, height: float) -> None:
    half = (height + _SINK) / 2
    spec.worldbody.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, half, 0.0], pos=[*centre, height - half]
    )


def _about_z(yaw: float) -> list[float]:
    return [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
