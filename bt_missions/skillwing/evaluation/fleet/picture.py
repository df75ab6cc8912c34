"""Picture of a flight of two drones: both maps and both tracks from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from skillwing.evaluation.fleet.yard import PLACES
from skillwing.evaluation.flights.saved_map import SavedMap
from skillwing.evaluation.judge.obstacle_shapes import draw_plan
from skillwing.onboard.topics.truth import Truth
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.world import World

TRACKS: Final = ("#d62728", "#1756c4")
"""Colours of the tracks, in the order of the robots."""
MAPPED: Final = ("#f2b8a2", "#a9c3ea")
"""Colours of the ground that one robot has mapped."""
BOTH: Final = "#b9aec2"
"""Colour of the ground that both robots have mapped."""
_INK = "#1a1a1a"
_MARGIN = 6.0
_DARKEST, _DARK_AT = 0.45, 6.0
"""Share by which the highest things are darker, and the height from which they are [m]."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Facts of one robot for the picture: its true flight, its map, and its place at the start."""

    flight: Sequence[Truth]
    saved: SavedMap | None
    home: Point


def draw_fleet(file: Path, world: World, robots: Mapping[str, Drawn], title: str) -> None:
    """Write the picture to `file` (PNG): two robots, in the area of the world's fence."""
    low, high = (np.array(corner[:2]) + side * _MARGIN for corner, side in zip(_corners(world), (-1, 1), strict=True))
    figure = Figure(figsize=(11.0, 8.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.01, ha="left", fontsize=13, color=_INK)
    axes = figure.add_subplot()
    _draw_maps(axes, [each.saved for each in robots.values()], list(robots), low, high)
    draw_plan(axes, world.obstacles)
    for (name, drawn), colour in zip(robots.items(), TRACKS, strict=True):
        _draw_track(axes, name, drawn, colour)
    _draw_nearest(axes, [each.flight for each in robots.values()])
    (west, south, _), (east, north, _) = world.geofence.low, world.geofence.high
    fence = Rectangle((west, south), east - west, north - south, fill=False, ec="#c77700", ls="-.", lw=1.2)
    fence.set_label("geofence")
    axes.add_patch(fence)
    for (name, (west, south, east, north)), style in zip(PLACES.items(), ("-", ":"), strict=True):
        place = Rectangle((west, south), east - west, north - south, fill=False, ec=_INK, ls=style, lw=1.6, zorder=6)
        place.set_label(f"{name} that both share")
        axes.add_patch(place)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="east [m]", ylabel="north [m]", aspect="equal")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(file)


def _corners(world: World) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return world.geofence.low, world.geofence.high


def _draw_maps(
    axes: Axes,
    maps: Sequence[SavedMap | None],
    names: Sequence[str],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> None:
    """Colour each square by the robots that have mapped something there. Higher things are darker."""
    size = next((each.voxel_size for each in maps if each is not None), 0.4)
    columns, rows = np.ceil((high - low) / size).astype(int)
    tops = [_tops(each, low, (rows, columns), size) for each in maps]
    seen = [np.isfinite(top) for top in tops]
    picture = np.ones((rows, columns, 3))
    for own, other, colour in zip(seen, reversed(seen), MAPPED, strict=True):
        picture[own & ~other] = to_rgb(colour)
    picture[seen[0] & seen[1]] = to_rgb(BOTH)
    picture *= 1.0 - _DARKEST * np.clip(np.maximum(*tops) / _DARK_AT, 0.0, 1.0)[..., None]
    axes.imshow(picture, origin="lower", extent=(low[0], low[0] + columns * size, low[1], low[1] + rows * size))
    for name, colour in zip((*names, "both"), (*MAPPED, BOTH), strict=True):
        axes.plot([], [], "s", ms=10, color=colour, label=f"mapped by {name}")


def _tops(saved: SavedMap | None, low: NDArray[np.float64], shape: tuple[int, int], size: float) -> NDArray[np.float64]:
    """Height (rows = north, columns = east) of the highest voxel over each square; minus infinity for none."""
    tops = np.full(shape, -np.inf)
    if saved is None:
        return tops
    x, y = np.floor((saved.centres[:, :2] - low) / size).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < shape[1]) & (y < shape[0])
    np.maximum.at(tops, (y[inside], x[inside]), saved.centres[inside, 2])
    return tops


def _draw_track(axes: Axes, name: str, drawn: Drawn, colour: str) -> None:
    path = np.array([truth.position for truth in drawn.flight]).reshape(-1, 3)
    outline = withStroke(linewidth=4.0, foreground="white")
    axes.plot(path[:, 0], path[:, 1], color=colour, lw=2.0, label=f"flown by {name}", path_effects=[outline], zorder=4)
    axes.plot(*drawn.home, "^", ms=12, mfc="white", mec=colour, mew=2.0, label=f"home of {name}", zorder=5)
    if len(path):
        axes.plot(*path[-1, :2], "v", ms=9, mfc=colour, mec=_INK, label="_", zorder=6)


def _draw_nearest(axes: Axes, flights: Sequence[Sequence[Truth]]) -> None:
    """Mark both drones where they were nearest to each other."""
    there = {round(truth.t, 3): truth for truth in flights[1]}
    pairs = [
        (one.separation, one.position[:2], there[round(one.t, 3)].position[:2])
        for one in flights[0]
        if round(one.t, 3) in there and one.separation is not None
    ]
    if not pairs:
        return
    least, *both = min(pairs)
    places, label = np.array(both), f"nearest: {least:.1f} m from tip to tip"
    axes.plot(places[:, 0], places[:, 1], "o:", ms=7, color=_INK, mfc="#ffb000", lw=1.2, label=label, zorder=7)
