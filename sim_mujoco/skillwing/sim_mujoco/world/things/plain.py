"""Simple objects of one or two solids: walls, boxes, poles, trees and buildings."""

from __future__ import annotations

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.obstacle import SINK, Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.shapes import (
    Colour,
    Cuboid,
    Cylinder,
    Ellipsoid,
    Solid,
    WindowedBlock,
    about_z,
)

PLASTER: Colour = (0.82, 0.76, 0.66)
MASONRY: Colour = (0.62, 0.57, 0.52)
METAL: Colour = (0.55, 0.57, 0.60)
BARK: Colour = (0.38, 0.29, 0.21)
LEAVES: Colour = (0.27, 0.44, 0.20)
CRATE: Colour = (0.66, 0.47, 0.27)


def block(name: str, kind: ObstacleKind, footprint: Footprint, height: float, colour: Colour | None = None) -> Obstacle:
    """A box that fills its outline: a wall, a crate, a hedge."""
    half = (height + SINK) / 2
    solid = Solid(
        Cuboid((*footprint.half, half)),
        (*footprint.centre, height - half),
        about_z(footprint.yaw),
        colour=colour or (CRATE if kind is ObstacleKind.BOX else MASONRY),
    )
    return Obstacle(name, kind, footprint, height, solids=(solid,))


def pole(name: str, footprint: Footprint, height: float, colour: Colour = METAL) -> Obstacle:
    """A round pole as thick as its outline."""
    return Obstacle(
        name, ObstacleKind.POLE, footprint, height, solids=(column(footprint.centre, footprint.radius, height, colour),)
    )


def tree(name: str, footprint: Footprint, height: float, leaves: Colour = LEAVES) -> Obstacle:
    """A trunk, and a crown that is as wide as the outline."""
    crown = footprint.radius
    half = min(0.35 * height, 1.4 * crown)
    solids = (
        column(footprint.centre, 0.15 * crown, height - half, BARK, part="trunk"),
        Solid(Ellipsoid((crown, crown, half)), (*footprint.centre, height - half), part="crown", colour=leaves),
    )
    return Obstacle(name, ObstacleKind.TREE, footprint, height, solids=solids)


def building(name: str, footprint: Footprint, height: float, colour: Colour = PLASTER) -> Obstacle:
    """A flat-roofed building with windows all around."""
    half = footprint.half
    walls = WindowedBlock((2 * half[0], 2 * half[1], height + SINK))
    solid = Solid(walls, (*footprint.centre, -SINK), about_z(footprint.yaw), colour=colour)
    return Obstacle(name, ObstacleKind.BUILDING, footprint, height, solids=(solid,))


def column(centre: tuple[float, float], radius: float, height: float, colour: Colour, *, part: str = "") -> Solid:
    """A cylinder from below the ground up to this height."""
    half = (height + SINK) / 2
    return Solid(Cylinder(radius, half), (*centre, height - half), part=part, colour=colour)
