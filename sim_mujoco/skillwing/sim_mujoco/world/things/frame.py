"""The frame of an object: x along its outline, y to the left, z up from the pad's height."""

from __future__ import annotations

import math
from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Quaternion, Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.things.shapes import Box, Capsule, Colour, Cylinder, Shape, Solid, about_z, along


@dataclass(frozen=True, slots=True)
class ObjectFrame:
    """Position of an object, and direction of its x axis [rad]."""

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
        return self.put(Box(half), (low[0] + half[0], low[1] + half[1], low[2] + half[2]), part, colour)

    def rod(self, start: Vector, end: Vector, radius: float, part: str, colour: Colour) -> Solid:
        """A rod with round ends."""
        middle, turn, half = along(self.at(*start), self.at(*end))
        return Solid(Capsule(radius, half), middle, turn, part, colour)

    def pipe(self, start: Vector, end: Vector, radius: float, part: str, colour: Colour) -> Solid:
        """A pipe with flat ends."""
        middle, turn, half = along(self.at(*start), self.at(*end))
        return Solid(Cylinder(radius, half), middle, turn, part, colour)
