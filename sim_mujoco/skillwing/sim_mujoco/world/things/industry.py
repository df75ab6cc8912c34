"""Objects of an industrial site: tanks, stacks, pipe racks, containers, pylons and wires."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.footprint import Footprint, Point
from skillwing.sim_mujoco.world.things.obstacle import SINK, Obstacle, ObstacleKind
from skillwing.sim_mujoco.world.things.plain import column
from skillwing.sim_mujoco.world.things.shapes import Colour, Cone, ObjectFrame, Solid

STEEL: Colour = (0.66, 0.68, 0.70)
_RUST: Colour = (0.52, 0.38, 0.30)
_BRICK: Colour = (0.58, 0.33, 0.26)
CONTAINER = (6.06, 2.44, 2.59)
"""Length, width and height of a container [m]."""
CONDUCTOR_RADIUS = 0.015
"""Radius of the wires of a power line [m]."""
SAG = 0.03
"""Sag of a wire, relative to its span."""
_PIECES = 8


def tank(name: str, outline: Footprint, height: float, colour: Colour) -> Obstacle:
    """A round tank with a shallow cone for a roof, and a rail around its rim."""
    radius = outline.radius - 0.15
    wall = height - 0.14 * radius
    solids = (
        column(outline.centre, radius, wall, colour, part="wall"),
        Solid(Cone(radius, 0.3, 0.14 * radius), (*outline.centre, wall), part="roof", colour=STEEL),
        ObjectFrame(outline.centre).box((radius - 0.1, -0.25, -SINK), (radius + 0.12, 0.25, wall), "ladder", _RUST),
    )
    return Obstacle(name, ObstacleKind.TANK, outline, height, solids=solids)


def stack(name: str, outline: Footprint, height: float) -> Obstacle:
    """A chimney that tapers, with a painted top."""
    radius, top = outline.radius, 0.85 * height
    tip = 0.62 * radius
    waist = radius + (tip - radius) * (top + SINK) / (height + SINK)
    solids = (
        Solid(Cone(radius, waist, top + SINK), (*outline.centre, -SINK), part="shaft", colour=_BRICK),
        Solid(Cone(waist, tip, height - top), (*outline.centre, top), part="tip", colour=(0.86, 0.84, 0.80)),
    )
    return Obstacle(name, ObstacleKind.POLE, outline, height, solids=solids)


def containers(name: str, outline: Footprint, storeys: int, colours: Sequence[Colour]) -> Obstacle:
    """Containers on top of each other, one colour each."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    solids = [
        place.box(
            (-x, -y, storey * CONTAINER[2] - (SINK if storey == 0 else 0.0)),
            (x, y, (storey + 1) * CONTAINER[2]),
            str(storey),
            colour,
        )
        for storey, colour in zip(range(storeys), colours, strict=False)
    ]
    return Obstacle(name, ObstacleKind.BOX, outline, storeys * CONTAINER[2], solids=tuple(solids))


def pipe_rack(name: str, outline: Footprint, height: float, colours: Sequence[Colour]) -> Obstacle:
    """Pipes along x on two levels, carried by portals every 6 m or so."""
    place, (x, y) = ObjectFrame.of(outline), outline.half
    radii = (0.22, 0.12, 0.3, 0.16)
    levels = (height - 2 * max(radii) - 1.9, height - 2 * max(radii))
    portals = max(2, round(2 * x / 6.0) + 1)
    solids: list[Solid] = []
    for portal in range(portals):
        at = -x + 0.15 + portal * (2 * x - 0.3) / (portals - 1)
        for side, edge in (("left", y - 0.15), ("right", 0.15 - y)):
            low, high = (at - 0.15, edge - 0.15, -SINK), (at + 0.15, edge + 0.15, levels[1])
            solids.append(place.box(low, high, f"post-{portal}-{side}", STEEL))
        for level, beam in enumerate(levels):
            low, high = (at - 0.12, -y, beam - 0.25), (at + 0.12, y, beam)
            solids.append(place.box(low, high, f"beam-{portal}-{level}", STEEL))
    for level, beam in enumerate(levels):
        for lane, radius in enumerate(radii):
            across = -y + 0.6 + lane * (2 * y - 1.2) / (len(radii) - 1)
            start, end = (-x, across, beam + radius), (x, across, beam + radius)
            colour = colours[(lane + level) % len(colours)]
            solids.append(place.pipe(start, end, radius, f"pipe-{level}-{lane}", colour))
    return Obstacle(name, ObstacleKind.PIPES, outline, height, solids=tuple(solids))


PYLON_ARM = 4.2
"""Length of a pylon's arms to each side [m]."""
PYLON_BASE = 1.7
"""Half the side of the square of a pylon's legs [m]."""
_ARMS = (0.62, 0.76, 0.9)
"""Heights of a pylon's arms, relative to its own."""


def pylon(name: str, centre: Point, yaw: float, height: float) -> Obstacle:
    """A lattice tower that carries wires along its x axis: six on three arms across, one on its tip."""
    outline = Footprint(centre, (PYLON_BASE + 0.1, PYLON_ARM + 0.1), yaw)
    place = ObjectFrame(centre, yaw)
    solids = [place.rod(start, end, radius, part, STEEL) for part, start, end, radius in _lattice(height)]
    for arm, share in enumerate(_ARMS):
        z = share * height
        solids.append(place.rod((0.0, -PYLON_ARM, z), (0.0, PYLON_ARM, z), 0.09, f"arm-{arm}", STEEL))
        for side in (-1, 1):
            stay = place.rod((0.0, side * PYLON_ARM, z), (0.0, side * 0.3, z + 1.1), 0.05, f"stay-{arm}-{side}", STEEL)
            solids.append(stay)
    return Obstacle(name, ObstacleKind.POLE, outline, height, solids=tuple(solids))


def _lattice(height: float) -> Iterator[tuple[str, Vector, Vector, float]]:
    """Legs and braces of a square tower that narrows to its tip: name, both ends, radius."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    shares = (0.0, 0.2, 0.38, 0.54, 0.68, 0.8, 0.9)

    def at(corner: tuple[int, int], share: float) -> Vector:
        half = PYLON_BASE + (0.18 - PYLON_BASE) * min(share / 0.8, 1.0)
        return corner[0] * half, corner[1] * half, share * height if share else -SINK

    for i, corner in enumerate(corners):
        yield f"leg-{i}", at(corner, 0.0), at(corner, 0.8), 0.1
        yield f"neck-{i}", at(corner, 0.8), (0.0, 0.0, height - 0.1), 0.08
        beside = corners[(i + 1) % 4]
        for panel, (low, high) in enumerate(pairwise(shares)):
            yield f"brace-{i}-{panel}-up", at(corner, low), at(beside, high), 0.045
            yield f"brace-{i}-{panel}-down", at(beside, low), at(corner, high), 0.045


def wires(name: str, start: Point, end: Point, height: float) -> Obstacle:
    """The wires between two pylons of this height. Each hangs as a parabola, in straight pieces."""
    length = math.dist(start, end)
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    place = ObjectFrame(middle, yaw)
    hung = [(side * (PYLON_ARM - 0.1), share * height) for share in _ARMS for side in (-1, 1)]
    solids: list[Solid] = []
    top = height - 0.15
    for number, (y, z) in enumerate([*hung, (0.0, top)]):
        knots = [_hanging(length, y, z, piece / _PIECES) for piece in range(_PIECES + 1)]
        solids += [
            place.rod(a, b, CONDUCTOR_RADIUS, f"{number}-{piece}", (0.2, 0.2, 0.22))
            for piece, (a, b) in enumerate(pairwise(knots))
        ]
    return Obstacle(
        name,
        ObstacleKind.WIRE,
        Footprint(middle, (length / 2 + 0.1, PYLON_ARM), yaw),
        top + CONDUCTOR_RADIUS,
        solids=tuple(solids),
    )


def _hanging(length: float, y: float, z: float, share: float) -> Vector:
    return (share - 0.5) * length, y, z - 4.0 * SAG * length * share * (1.0 - share)
