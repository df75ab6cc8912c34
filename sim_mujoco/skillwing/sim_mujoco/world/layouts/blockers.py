"""Obstacles on the legs of a route, higher than the route and passable on both sides."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.layouts.plot import Plot, Spot
from skillwing.sim_mujoco.world.layouts.surroundings import LEAVES
from skillwing.sim_mujoco.world.things.industry import CONTAINER, containers, stack
from skillwing.sim_mujoco.world.things.obstacle import Obstacle
from skillwing.sim_mujoco.world.things.plain import pole, tree
from skillwing.sim_mujoco.world.things.shapes import Colour
from skillwing.sim_mujoco.world.things.street import billboard

Blocker: TypeAlias = Callable[[Plot, Spot, str], Obstacle]
"""Maker of an obstacle at a spot on a leg, with this end of its name."""

SHORTEST_LEG = 25.0
"""Length below which a leg has no obstacle [m]."""
_STRETCH = 60.0
_TRIES = 20
CONTAINER_COLOURS: tuple[Colour, ...] = ((0.62, 0.24, 0.18), (0.16, 0.35, 0.52), (0.20, 0.42, 0.30), (0.78, 0.60, 0.22))


def mast(plot: Plot, spot: Spot, name: str) -> Obstacle:
    return pole(f"pole-{name}", Footprint(spot.centre, radius=plot.between(0.25, 0.4)), plot.between(7.0, 9.0))


def board(plot: Plot, spot: Spot, name: str) -> Obstacle:
    """A board that is seen from the leg."""
    outline = Footprint(spot.centre, (0.25, plot.between(1.5, 2.2)), spot.yaw)
    return billboard(f"wall-{name}", outline, plot.between(7.0, 9.0), plot.one_of(CONTAINER_COLOURS))


def lone_tree(plot: Plot, spot: Spot, name: str) -> Obstacle:
    """A tree whose crown hangs at the height of the route."""
    outline = Footprint(spot.centre, radius=plot.between(1.4, 1.9))
    return tree(f"tree-{name}", outline, plot.between(7.5, 8.5), plot.one_of(LEAVES))


def chimney(plot: Plot, spot: Spot, name: str) -> Obstacle:
    return stack(f"pole-{name}", Footprint(spot.centre, radius=plot.between(0.5, 0.9)), plot.between(9.0, 14.0))


def container_stack(plot: Plot, spot: Spot, name: str) -> Obstacle:
    outline = Footprint(spot.centre, (CONTAINER[0] / 2, CONTAINER[1] / 2), spot.yaw)
    colours = [plot.one_of(CONTAINER_COLOURS) for _ in range(3)]
    return containers(f"box-{name}", outline, 3, colours)


def block_legs(plot: Plot, blockers: Sequence[Blocker]) -> None:
    """Put an obstacle on the first long leg, and on each further stretch of 60 m with a probability of one half.

    Call it before any other obstacle is added, because the ways round these obstacles have to stay free.
    """
    certain = True
    for leg, (a, b) in enumerate(plot.legs):
        length = math.dist(a, b)
        if length < SHORTEST_LEG:
            continue
        stretches = max(1, round(length / _STRETCH))
        for stretch in range(stretches):
            if certain or plot.chance(0.5):
                share = (stretch + 0.35) / stretches, (stretch + 0.65) / stretches
                _block(plot, leg, share, f"on-leg-{leg}-{stretch}", blockers)
                certain = False


def _block(plot: Plot, leg: int, share: tuple[float, float], name: str, blockers: Sequence[Blocker]) -> None:
    for _ in range(_TRIES):
        obstacle = plot.one_of(blockers)(plot, plot.spot(leg, share), name)
        if plot.block(leg, obstacle):
            return
