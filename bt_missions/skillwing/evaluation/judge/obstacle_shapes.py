"""True obstacles around a flight, drawn if the robot built no map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.obstacle import Obstacle

OBSTACLE_COLOUR: Final = "#cfc6b8"
_EDGE = "#5b5348"
_ARC = np.linspace(0.0, 0.5 * np.pi, 7)
"""Angles along the arc of a rounded corner [rad]."""


def draw_plan(axes: Axes, obstacles: Sequence[Obstacle]) -> None:
    for number, obstacle in enumerate(obstacles):
        outline = Polygon(_outline(obstacle.footprint), fc=OBSTACLE_COLOUR, ec=_EDGE, lw=0.6, zorder=0)
        outline.set_label("_" if number else "stands there, seen or not")  # an underscore keeps it out of the legend
        axes.add_patch(outline)


def draw_perspective(
    axes: Any,  # matplotlib's types do not cover 3D axes
    obstacles: Sequence[Obstacle],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> None:
    """Draw walls and roofs of obstacles wholly between the corners `low` and `high` (2,): 3D axes do not clip."""
    faces: list[NDArray[np.float64]] = []
    for obstacle in obstacles:
        outline = _outline(obstacle.footprint)
        if (outline < low).any() or (outline > high).any():
            continue
        foot, roof = (np.column_stack([outline, np.full(len(outline), height)]) for height in (0.0, obstacle.height))
        walls = np.stack([foot, np.roll(foot, -1, axis=0), np.roll(roof, -1, axis=0), roof], axis=1)
        faces += [*walls, roof]
    if faces:
        things = Poly3DCollection(faces, fc=OBSTACLE_COLOUR, ec=_EDGE, lw=0.3, alpha=0.5, zorder=1)
        axes.add_collection3d(things, autolim=False)


def _outline(footprint: Footprint) -> NDArray[np.float64]:
    """Outline (N, 2) of a footprint, counter-clockwise, with corners rounded by its radius."""
    corners = np.array(footprint.corners())
    if footprint.radius == 0.0:
        return corners
    bearings = footprint.yaw + np.pi + 0.5 * np.pi * np.arange(4)[:, None] + _ARC
    arcs = footprint.radius * np.stack([np.cos(bearings), np.sin(bearings)], axis=-1)
    return (corners[:, None] + arcs).reshape(-1, 2)
