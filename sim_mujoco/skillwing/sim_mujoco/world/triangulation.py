"""Triangles of a compiled MuJoCo model: rays hit exactly the shapes that physics collides with."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.world.triangles import Triangles

_ROUND = 24
"""Facets of a cylinder; a 0.4 m trunk deviates by less than 4 mm from the true circle."""
_FACET_ERROR = 0.004


def static_triangles(model: mujoco.MjModel, label_of: dict[str, int]) -> Triangles:
    """All world-fixed geoms of a compiled model as triangles.

    `label_of` maps the part of a geom's name before its first dash to a label. Boxes, cylinders, capsules, ellipsoids,
    meshes and height fields are understood; anything else raises ValueError.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    vertices, faces, labels, count = [], [], [], 0
    for geom in np.flatnonzero(model.geom_bodyid == 0):
        v, f = local_triangles(model, int(geom))
        vertices.append(v @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        faces.append(f + count)
        labels.append(np.full(len(f), label_of[model.geom(geom).name.split("-")[0]]))
        count += len(v)
    return Triangles(
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(faces).astype(np.int32),
        np.concatenate(labels).astype(np.int8),
    )


def face_colours(model: mujoco.MjModel) -> NDArray[np.float32]:
    """The colour (M, 3), 0 to 1, of each of the static triangles."""
    static = np.flatnonzero(model.geom_bodyid == 0)
    counts = [len(local_triangles(model, int(geom))[1]) for geom in static]
    return np.repeat(model.geom_rgba[static, :3], counts, axis=0).astype(np.float32)


def local_triangles(model: mujoco.MjModel, geom: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (N, 3) in the geom's own frame, and faces (M, 3)."""
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return _box(size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return _lathe(np.array([(0, -1), (1, -1), (1, 1), (0, 1)]) * (size[0], size[1]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return _capsule(*size[:2])
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        latitude = np.linspace(-np.pi / 2, np.pi / 2, _ROUND // 2 + 1)
        v, f = _lathe(np.stack([np.cos(latitude), np.sin(latitude)], axis=1))
        return v * size, f
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[geom]))
    if kind == mujoco.mjtGeom.mjGEOM_HFIELD:
        return _height_field(model, int(model.geom_dataid[geom]))
    raise ValueError(f"geom {model.geom(geom).name!r} has type {kind.name}, which has no triangulation")


def _box(half: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    return signs * half, _split(quads)


def _capsule(radius: float, half: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A capsule with enough facets to lie within 4 mm of the true circle, but at least six."""
    facets = max(6, math.ceil(math.pi / math.acos(max(0.0, 1.0 - _FACET_ERROR / radius))))
    profile = [(0, -half - radius), (0.7 * radius, -half - 0.7 * radius), (radius, -half)]
    return _lathe(np.array([*profile, *((r, -z) for r, z in reversed(profile))]), facets)


def _lathe(profile: NDArray[np.float64], facets: int = _ROUND) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Turn a profile of (radius, height) points around z."""
    angle = np.arange(facets) * 2 * np.pi / facets
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(facets)], axis=1)
    vertices = (profile[:, None, [0, 0, 1]] * ring[None]).reshape(-1, 3)
    i = np.arange(facets)
    j = (i + 1) % facets
    low = facets * np.arange(len(profile) - 1)[:, None]
    quads = np.stack([low + i, low + j, low + j + facets, low + i + facets], axis=-1).reshape(-1, 4)
    return vertices, _split(quads)


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    v0, f0 = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[v0 : v0 + model.mesh_vertnum[mesh]]
    faces = model.mesh_face[f0 : f0 + model.mesh_facenum[mesh]]
    return vertices.astype(np.float64), faces.astype(np.int64)


def _height_field(model: mujoco.MjModel, field: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, height, _ = model.hfield_size[field]
    start = model.hfield_adr[field]
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    z = model.hfield_data[start : start + rows * columns] * height
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    corner = (i * columns + j).ravel()
    quads = np.stack([corner, corner + 1, corner + columns + 1, corner + columns], axis=1)
    return np.stack([x.ravel(), y.ravel(), z], axis=1), _split(quads)


def _split(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
