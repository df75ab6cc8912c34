"""Obstacles: outline in plan and height, for the promises of worlds, and the solids within."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.shapes import Solid

SINK = 0.8
"""Depth of obstacles below the home pad, so that none floats over a hollow [m]."""


class ObstacleKind(StrEnum):
    """Kind of an obstacle; its surface label follows from it."""

    BUILDING = "building"
    WALL = "wall"
    POLE = "pole"
    TREE = "tree"
    BOX = "box"
    VEHICLE = "vehicle"
    TANK = "tank"
    PIPES = "pipes"
    WIRE = "wire"


@dataclass(frozen=True, slots=True)
class Obstacle:
    """One obstacle: outline of all its parts, height of its top above the pad [m], and the leg that it blocks, if any.

    No solid reaches beyond outline and height; parts that hang over the ground count as standing on it.
    """

    name: str
    kind: ObstacleKind
    footprint: Footprint
    height: float
    leg: int | None = None
    solids: tuple[Solid, ...] = ()
