"""Objects along streets: lamps, vehicles, signs, hedges, trees of other shapes."""

from __future__ import annotations

import math

from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.things.obstacle import SINK, Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import BARK, METAL, column
from skillwing.sim_mujoco.world.things.shapes import Colour, Cone, Ellipsoid, ObjectFrame, Solid

_TYRES: Colour = (0.13, 0.13, 0.14)
_GLASS: Colour = (0.22, 0.27, 0.33)
CAR, VAN, LORRY = (4.4, 1.8, 1.5), (5.6, 2.0, 2.5), (8.5, 2.5, 3.6)
"""Length, width and height [m]."""


def lamp(name: str, foot: Point, yaw: float, height: float, reach: float) -> Obstacle:
    """A street lamp whose arm reaches out over the street, in the direction `yaw`."""
    middle = foot[0] + reach / 2 * math.cos(yaw), foot[1] + reach / 2 * math.sin(yaw)
    outline = Footprint(middle, (reach / 2 + 0.15, 0.15), yaw)
    place = ObjectFrame(foot, yaw)
    solids = (
        column(foot, 0.09, height - 0.1, METAL, part="post"),
        place.rod((0.0, 0.0, height - 0.15), (reach - 0.1, 0.0, height - 0.08), 0.05, "arm", METAL),
        place.box((reach - 0.6, -0.14, height - 0.22), (reach + 0.1, 0.14, height), "light", (0.75, 0.75, 0.70)),
    )
    return Obstacle(name, ObstacleKind.POLE, outline, height, solids=solids)


def car(name: str, centre: Point, yaw: float, paint: Colour) -> Obstacle:
    length, width, height = CAR
    x, y = length / 2, width / 2
    place = ObjectFrame(centre, yaw)
    solids = (
        _wheels(place, x, y),
        place.box((-x, -y, 0.25), (x, y, 0.9), "body", paint),
        place.box((-0.75 * x, 0.12 - y, 0.9), (0.45 * x, y - 0.12, height), "cabin", _GLASS),
    )
    return Obstacle(name, ObstacleKind.VEHICLE, Footprint(centre, (x, y), yaw), height, solids=solids)


def van(name: str, centre: Point, yaw: float, paint: Colour) -> Obstacle:
    length, width, height = VAN
    x, y = length / 2, width / 2
    place = ObjectFrame(centre, yaw)
    solids = (
        _wheels(place, x, y),
        place.box((-x, -y, 0.3), (x - 1.0, y, height), "body", paint),
        place.box((x - 1.0, -y, 0.3), (x, y, 1.3), "bonnet", paint),
        place.box((x - 1.0, 0.1 - y, 1.3), (x - 0.5, y - 0.1, 2.1), "screen", _GLASS),
    )
    return Obstacle(name, ObstacleKind.VEHICLE, Footprint(centre, (x, y), yaw), height, solids=solids)


def lorry(name: str, centre: Point, yaw: float, paint: Colour) -> Obstacle:
    length, width, height = LORRY
    x, y = length / 2, width / 2
    place = ObjectFrame(centre, yaw)
    solids = (
        _wheels(place, x, y),
        place.box((-x, -y, 0.9), (x - 2.4, y, height), "load", (0.84, 0.84, 0.82)),
        place.box((x - 2.1, -y, 0.5), (x, y, 2.8), "cab", paint),
    )
    return Obstacle(name, ObstacleKind.VEHICLE, Footprint(centre, (x, y), yaw), height, solids=solids)


def billboard(name: str, outline: Footprint, height: float, colour: Colour) -> Obstacle:
    """A board that reaches down to the ground, on a frame."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    solids = (
        place.box((-x, -y, -SINK), (x, y, 0.8), "foot", METAL),
        place.box((0.25 * -x, -y, 0.8), (0.25 * x, y, height), "board", colour),
        place.box((-x, -y, 0.8), (x, 0.15 - y, height), "left", METAL),
        place.box((-x, y - 0.15, 0.8), (x, y, height), "right", METAL),
    )
    return Obstacle(name, ObstacleKind.WALL, outline, height, solids=solids)


def conifer(name: str, outline: Footprint, height: float, needles: Colour) -> Obstacle:
    """A spruce: a cone on a short trunk, as wide as the outline."""
    radius = outline.radius
    solids = (
        column(outline.centre, 0.12 * radius, 0.3 * height, BARK, part="trunk"),
        Solid(Cone(radius, 0.02, 0.85 * height), (*outline.centre, 0.15 * height), part="crown", colour=needles),
    )
    return Obstacle(name, ObstacleKind.TREE, outline, height, solids=solids)


def broad_tree(name: str, outline: Footprint, height: float, leaves: Colour) -> Obstacle:
    """An old tree: a crown of three parts on a trunk."""
    radius = outline.radius
    half = min(0.36 * height, 1.2 * radius)
    middle = height - half
    place = ObjectFrame(outline.centre)
    part = Ellipsoid((0.68 * radius, 0.68 * radius, 0.7 * half))
    crown = [
        place.put(
            part, (0.3 * radius * math.cos(a), 0.3 * radius * math.sin(a), middle + up * half), f"crown-{i}", leaves
        )
        for i, (a, up) in enumerate(((0.4, 0.3), (2.5, 0.0), (4.6, -0.25)))
    ]
    return Obstacle(
        name,
        ObstacleKind.TREE,
        outline,
        middle + half,
        solids=(column(outline.centre, 0.12 * radius, middle, BARK, part="trunk"), *crown),
    )


def _wheels(place: ObjectFrame, x: float, y: float) -> Solid:
    return place.box((0.15 - x, 0.08 - y, -SINK), (x - 0.15, y - 0.08, 0.3), "wheels", _TYRES)
