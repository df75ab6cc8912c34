"""Terrain and obstacles as a MuJoCo specification."""

from __future__ import annotations

from collections.abc import Iterable

import mujoco

from skillwing.sim_mujoco.world.terrain import Terrain
from skillwing.sim_mujoco.world.things.obstacle import Obstacle
from skillwing.sim_mujoco.world.things.shapes import Capsule, Cuboid, Cylinder, Ellipsoid, Shape, Solid

_GRASS = (0.42, 0.49, 0.30)


def scene_spec(terrain: Terrain, obstacles: Iterable[Obstacle]) -> mujoco.MjSpec:
    """The static scene. Each geom's name begins with what it belongs to: `terrain`, or an obstacle's name."""
    spec = mujoco.MjSpec()
    _add_terrain(spec, terrain)
    meshes: dict[Shape, str] = {}
    for obstacle in obstacles:
        for solid in obstacle.solids:
            name = f"{obstacle.name}-{solid.part}" if solid.part else obstacle.name
            _add_solid(spec, name, solid, meshes)
    return spec


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
        rgba=[*_GRASS, 1.0],
    )


def _add_solid(spec: mujoco.MjSpec, name: str, solid: Solid, meshes: dict[Shape, str]) -> None:
    """Shapes with a mesh share it: a row of equal houses is stored once."""
    geom = spec.worldbody.add_geom(
        name=name, pos=list(solid.position), quat=list(solid.quaternion), rgba=[*solid.colour, 1.0]
    )
    match solid.shape:
        case Cuboid(half):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, list(half)
        case Cylinder(radius, half):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CYLINDER, [radius, half, 0.0]
        case Ellipsoid(semi_axes):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_ELLIPSOID, list(semi_axes)
        case Capsule(radius, half):
            geom.type, geom.size = mujoco.mjtGeom.mjGEOM_CAPSULE, [radius, half, 0.0]
        case shape:
            if shape not in meshes:
                meshes[shape] = name
                vertices, faces = shape.mesh()
                mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
                mesh.uservert = vertices.ravel()
                mesh.userface = faces.ravel()
            geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, meshes[shape]
