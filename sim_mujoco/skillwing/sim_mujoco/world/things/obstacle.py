"""Obstacles: an outline in plan and a height, by which promises are kept, and the solids within."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.shapes import Solid

SINK = 0.8
"""How deep obstacles reach below the home pad, so that none floats over a hollow [m]."""


class ObstacleKind(StrEnum):
    """What an obstacle is; its surface label follows from it."""

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
    """One thing: outline of all that belongs to it, height of its top above the pad [m], and the leg it blocks, if any.

    No solid reaches beyond outline and height; what hangs over the ground counts as standing on it.
    """

    name: str
    kind: ObstacleKind
    footprint: Footprint
    height: float
    leg: int | None = None
    solids: tuple[Solid, ...] = ()
