"""Solid shapes and their placement: the parts of obstacles, for physics and rays.

Shapes are values: the same seed gives equal ones, and meshes are only computed when a scene is made of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Quaternion, Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.things.facade import DWELLING, Windows, building_mesh

MeshData: TypeAlias = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Vertices (N, 3) and faces (M, 3), counter-clockwise seen from outside."""
Colour: TypeAlias = tuple[float, float, float]
"""Red, green and blue, 0 to 1. Only pictures show it; sensors that measure distances do not."""

_AROUND = 16


@dataclass(frozen=True, slots=True)
class Cuboid:
    """Half extents [m], centred."""

    half: Vector


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Around z, centred: radius and half height [m]."""

    radius: float
    half: float


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """Semi-axes [m], centred."""

    semi_axes: Vector


@dataclass(frozen=True, slots=True)
class Capsule:
    """Along z, centred: radius and half length without the caps [m]."""

    radius: float
    half: float


@dataclass(frozen=True, slots=True)
class WindowedBlock:
    """A flat-roofed block of length, width and height [m] with windows, standing on z = 0."""

    size: Vector
    windows: Windows = DWELLING
    blind_ends: bool = False

    def mesh(self) -> MeshData:
        return building_mesh(self.size, self.windows, blind_ends=self.blind_ends)


@dataclass(frozen=True, slots=True)
class GableRoof:
    """A prism on z = 0 [m]: its ridge runs along x, `rise` above the eaves."""

    length: float
    width: float
    rise: float

    def mesh(self) -> MeshData:
        x, y, z = self.length / 2, self.width / 2, self.rise
        vertices = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0), (-x, 0, z), (x, 0, z)], dtype=np.float64)
        faces = [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (0, 4, 3), (1, 2, 5)]
        return vertices, np.array(faces, dtype=np.int32)


@dataclass(frozen=True, slots=True)
class Spire:
    """A pyramid on z = 0 over a rectangle of these half extents [m]."""

    half: tuple[float, float]
    height: float

    def mesh(self) -> MeshData:
        (x, y), z = self.half, self.height
        vertices = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0), (0, 0, z)], dtype=np.float64)
        faces = [(0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
        return vertices, np.array(faces, dtype=np.int32)


@dataclass(frozen=True, slots=True)
class Cone:
    """A cone, or a part of one, on z = 0: radius below and above, height [m]. The corners lie on the true circle."""

    below: float
    above: float
    height: float

    def mesh(self) -> MeshData:
        angle = np.arange(_AROUND) * (2 * np.pi / _AROUND)
        circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(_AROUND)], axis=1)
        top = np.array([0.0, 0.0, self.height])
        vertices = np.concatenate([circle * self.below, circle * max(self.above, 0.01) + top, [np.zeros(3), top]])
        i = np.arange(_AROUND)
        j = (i + 1) % _AROUND
        low, high = np.full(_AROUND, 2 * _AROUND), np.full(_AROUND, 2 * _AROUND + 1)
        faces = [(j, i, low), (i, j, j + _AROUND), (i, j + _AROUND, i + _AROUND), (i + _AROUND, j + _AROUND, high)]
        return vertices, np.concatenate([np.stack(each, axis=1) for each in faces]).astype(np.int32)


Shape: TypeAlias = Cuboid | Cylinder | Ellipsoid | Capsule | WindowedBlock | GableRoof | Spire | Cone


@dataclass(frozen=True, slots=True)
class Solid:
    """A shape at a place in the world, turned. `part` names it among the solids of one obstacle."""

    shape: Shape
    position: Vector
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    part: str = ""
    colour: Colour = (0.6, 0.6, 0.6)


def about_z(yaw: float) -> Quaternion:
    """A turn to the left by so many radians."""
    return math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)


def along(start: Vector, end: Vector) -> tuple[Vector, Quaternion, float]:
    """Middle of a stretch, the turn that lays z along it, and half its length [m]."""
    way = np.subtract(end, start)
    length = float(np.linalg.norm(way))
    x, y, z = (float(each) / length for each in way)
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2, (start[2] + end[2]) / 2
    # Half the turn from (0, 0, 1) to (x, y, z), about a horizontal axis.
    cosine = math.sqrt(max(0.0, (1.0 + z) / 2))
    if cosine < 1e-9:
        return middle, (0.0, 1.0, 0.0, 0.0), length / 2
    return middle, (cosine, -y / (2 * cosine), x / (2 * cosine), 0.0), length / 2


@dataclass(frozen=True, slots=True)
class ObjectFrame:
    """Frame of an object: x along its outline, y to the left, z up from the pad's height.

    centre, yaw: position of its origin, and direction of its x axis [rad].
    """

    centre: Point
    yaw: float = 0.0

    @staticmethod
    def of(outline: Footprint) -> ObjectFrame:
        return ObjectFrame(outline.centre, outline.yaw)

    def at(self, x: float, y: float, z: float = 0.0) -> Vector:
        """World coordinates of a point in the object's frame."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.centre[0] + c * x - s * y, self.centre[1] + s * x + c * y, z

    @property
    def turn(self) -> Quaternion:
        return about_z(self.yaw)

    def put(self, shape: Shape, at: Vector, part: str, colour: Colour) -> Solid:
        """A shape, turned with the object."""
        return Solid(shape, self.at(*at), self.turn, part, colour)

    def box(self, low: Vector, high: Vector, part: str, colour: Colour) -> Solid:
        """The box between two opposite corners."""
        half = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2
        return self.put(Cuboid(half), (low[0] + half[0], low[1] + half[1], low[2] + half[2]), part, colour)

    def rod(self, start: Vector, end: Vector, radius: float, part: str, colour: Colour) -> Solid:
        """A rod with round ends."""
        middle, turn, half = along(self.at(*start), self.at(*end))
        return Solid(Capsule(radius, half), middle, turn, part, colour)

    def pipe(self, start: Vector, end: Vector, radius: float, part: str, colour: Colour) -> Solid:
        """A pipe with flat ends."""
        middle, turn, half = along(self.at(*start), self.at(*end))
        return Solid(Cylinder(radius, half), middle, turn, part, colour)
