"""Picture of a run's map, as in the paper's Figures 8 and 9: from above, and in perspective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from textwrap import shorten
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from skillwing.evaluation.judge.obstacle_shapes import draw_perspective, draw_plan
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.things.obstacle import Obstacle

BRANCH_COLOURS: Final = {"zed": "#d62728", "lidar": "#1756c4"}
"""Colours of Figure 1: red while the camera looks ahead, blue while the LiDAR does."""
_BRANCH_NAMES: Final = {
    "zed": "flown looking ahead by camera",
    "lidar": "flown looking ahead by LiDAR",
    "none": "flown without looking ahead",
}
_ELSEWHERE, _ROUTE, _INK = "#3d3d3d", "#6b6b6b", "#1a1a1a"
END: Final = "#19a974"
"""Colour of the position at the end of the flight."""
TROUBLE: Final = "#d5008f"
"""Colour of positions at failures and losses."""
FENCE: Final = "#c77700"
_HEIGHTS = LinearSegmentedColormap.from_list("heights", ["#ece7dc", "#c3cfae", "#82ab96", "#4c7485", "#2b3350"])
UNSEEN: Final = "#ccd3dd"
"""Colour of unknown places, which are hatched as well. No height has this colour."""
_HATCHING = "#7d8794"
_MARGIN = 8.0
_BEYOND_FENCE = 1.0
_MOST_SWITCHES = 4
"""Largest number of switches listed in words."""
_LETTERS = 100
"""Length of a line of text above the map [characters]."""
_MOST_CUBES = 60_000
"""Largest number of drawn cubes; larger maps are thinned, which shows as stripes on the walls."""
_STAYED = 0.5
"""Least motion along an axis that counts as flight [m]; less may be a drone that settles on its skids."""
_BADGE: Final[dict[str, Any]] = {
    "color": "white",
    "fontsize": 10,
    "fontweight": "bold",
    "ha": "center",
    "va": "center",
    "bbox": {"boxstyle": "circle,pad=0.2", "facecolor": _INK, "edgecolor": "white"},
}
_POINTER: Final = {"arrowstyle": "-", "color": _INK, "shrinkA": 0.0, "shrinkB": 0.0}
_PADDING = 0.14
"""Margin above and below the axes, so that the axis label does not touch the legend [inch]."""


@dataclass(frozen=True, slots=True)
class Flown:
    """A stretch of the flown path (N, 3) and the branch of the mission that flew it: `zed`, `lidar` or another name."""

    branch: str
    path: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Happening:
    """An event and the drone's position at that time."""

    place: Vector
    text: str


@dataclass(frozen=True, slots=True)
class MapScene:
    """Content of the picture in the world frame [m].

    centres: of the occupied voxels (N, 3). route: the planned one. flown: stretches of the flown path. obstacles_met:
    positions of stops for obstacles. ended: label of the path's end. switches: of the mission, in order. troubles:
    failures and losses. obstacles: true obstacles, drawn only without a map.
    """

    centres: NDArray[np.float32]
    voxel_size: float
    route: Sequence[Vector]
    flown: Sequence[Flown]
    obstacles_met: Sequence[Vector] = ()
    home: Vector = (0.0, 0.0, 0.0)
    ended: str = "end of the flight"
    fence: Box | None = None
    switches: Sequence[Happening] = ()
    troubles: Sequence[Happening] = ()
    obstacles: Sequence[Obstacle] = ()

    @property
    def was_flown(self) -> bool:
        return any(np.ptp(stretch.path, axis=0).max() >= _STAYED for stretch in self.flown)

    @property
    def caveats(self) -> str:
        """Remark about a missing map or flown path."""
        lacking = list[str]()
        if not len(self.centres):
            drawn = "drawn as the simulator knows it" if self.obstacles else "not drawn"
            lacking.append(f"No map was built: what stands here is {drawn}.")
        if not self.was_flown:
            lacking.append("Nothing was flown." if self.flown else "No flown path was recorded.")
        return " ".join(lacking)


def draw_map(file: Path, scene: MapScene, title: str) -> None:
    """Write the picture to `file` (PNG). It shows the map around the route and the flown path."""
    low, high = _frame(scene)
    centres = scene.centres[((scene.centres[:, :2] >= low) & (scene.centres[:, :2] <= high)).all(axis=1)]
    bottom, top = np.quantile(centres[:, 2], (0.02, 0.995)) if len(centres) else (0.0, 1.0)
    heights = Normalize(vmin=float(bottom), vmax=float(top))
    figure = Figure(figsize=(15.0, 6.8), dpi=110, layout=ConstrainedLayoutEngine(h_pad=_PADDING))
    FigureCanvasAgg(figure)
    figure.suptitle(title, x=0.01, ha="left", fontsize=14, color=_INK)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.0, 1.15))
    above = figure.add_subplot(grid[0, 0])
    _draw_from_above(above, scene, centres, heights, (low, high))
    above.set_title("\n".join(_sentences(scene)), loc="left", fontsize=11, color=_INK)
    if len(centres):
        scale = ScalarMappable(heights, _HEIGHTS)
        figure.colorbar(scale, ax=above, shrink=0.7, aspect=40, pad=0.02, label="height of what was seen there [m]")
    oblique = figure.add_subplot(grid[0, 1], projection="3d", computed_zorder=False)
    _draw_in_perspective(oblique, scene, centres, heights, (low, high))
    if len(scene.centres):
        oblique.set_title("Where no ground is drawn, none was seen.", loc="left", fontsize=11, color=_INK)
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower left", ncols=6, frameon=False)
    figure.savefig(file)


def _frame(scene: MapScene) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (2,) of the picture, in whole voxels: route and flown path with a margin, and the fence.

    Pixels of another size than voxels would leave stripes that look like unknown places.
    """
    shown = np.concatenate([np.array([scene.home, *scene.route]), *(stretch.path for stretch in scene.flown)])[:, :2]
    low, high = shown.min(axis=0) - _MARGIN, shown.max(axis=0) + _MARGIN
    if scene.fence is not None:
        low = np.minimum(low, np.array(scene.fence.low[:2]) - _BEYOND_FENCE)
        high = np.maximum(high, np.array(scene.fence.high[:2]) + _BEYOND_FENCE)
    if len(scene.centres):
        border = scene.centres[0, :2].astype(float) - scene.voxel_size / 2
        low = border + np.floor((low - border) / scene.voxel_size) * scene.voxel_size
        high = border + np.ceil((high - border) / scene.voxel_size) * scene.voxel_size
    return low, high


def _sentences(scene: MapScene) -> list[str]:
    """Legend: remarks, failures and losses, and the numbered switches."""
    troubles = shorten(", ".join(trouble.text for trouble in scene.troubles), _LETTERS, placeholder=" ...")
    switches = [f"({number}) {switch.text}" for number, switch in enumerate(scene.switches, 1)]
    if len(switches) > _MOST_SWITCHES:
        switches[_MOST_SWITCHES - 1 :] = [f"... and {len(switches) - _MOST_SWITCHES + 1} more switches"]
    return [sentence for sentence in (scene.caveats, troubles, *switches) if sentence]


def _draw_from_above(
    axes: Axes,
    scene: MapScene,
    centres: NDArray[np.float32],
    heights: Normalize,
    frame: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    low, high = frame
    roof = _highest(centres, scene.voxel_size, low, high)
    extent = (low[0], high[0], low[1], high[1])
    if len(scene.centres):
        width, height = high - low
        unseen = Rectangle((low[0], low[1]), width, height, fc=UNSEEN, ec=_HATCHING, hatch="////", lw=0.0, zorder=-1)
        unseen.set_label("no surface seen: may be anything")
        axes.add_patch(unseen)
    else:
        draw_plan(axes, scene.obstacles)
    axes.imshow(roof, cmap=_HEIGHTS, norm=heights, origin="lower", extent=extent, interpolation="nearest")
    for number, piece in enumerate(_pieces(np.array(scene.route).reshape(-1, 3)[:, :2])):
        axes.plot(*piece.T, "--", color=_ROUTE, lw=1.4, label="_" if number else "planned route")
    labelled = set[str]()
    outline = withStroke(linewidth=4.5, foreground="white")
    for stretch in scene.flown if scene.was_flown else ():
        name = _BRANCH_NAMES.get(stretch.branch, "flown otherwise")
        label = "_" if name in labelled else name  # an underscore keeps it out of the legend
        labelled.add(name)
        colour = BRANCH_COLOURS.get(stretch.branch, _ELSEWHERE)
        axes.plot(stretch.path[:, 0], stretch.path[:, 1], color=colour, lw=2.2, label=label, path_effects=[outline])
    met = np.array(scene.obstacles_met).reshape(-1, 3)
    if len(met):
        axes.plot(met[:, 0], met[:, 1], "X", ms=12, mfc="#ffb000", mec=_INK, label="stopped for an obstacle", zorder=5)
    axes.plot(*scene.home[:2], "^", ms=12, mfc="white", mec=_INK, mew=1.5, label="home", zorder=5)
    if scene.was_flown:
        axes.plot(*scene.flown[-1].path[-1, :2], "v", ms=9, mfc=END, mec=_INK, label=scene.ended, zorder=6)
    _draw_happenings(axes, scene)
    if scene.fence is not None:
        (west, south, _), (east, north, _) = scene.fence.low, scene.fence.high
        fence = Rectangle((west, south), east - west, north - south, fill=False, ec=FENCE, ls="-.", lw=1.4)
        fence.set_label("geofence")
        axes.add_patch(fence)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="east [m]", ylabel="north [m]", aspect="equal")


def _draw_happenings(axes: Axes, scene: MapScene) -> None:
    for number, trouble in enumerate(scene.troubles):
        label = "_" if number else "failed or lost here"
        axes.plot(*trouble.place[:2], "D", ms=9, mfc=TROUBLE, mec=_INK, label=label, ls="none", zorder=7)
    for number, switch in enumerate(scene.switches, 1):
        label = "_" if number > 1 else "switch, as in timeline.png"
        axes.plot(*switch.place[:2], "o", ms=6, mfc=_INK, mec="white", label=label, ls="none", zorder=8)
        axes.annotate(
            str(number), switch.place[:2], (-18.0, 16.0), textcoords="offset points", **_BADGE, arrowprops=_POINTER
        )


def _draw_in_perspective(
    axes: Any,  # matplotlib's types do not cover 3D axes
    scene: MapScene,
    centres: NDArray[np.float32],
    heights: Normalize,
    frame: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    low, high = frame
    drawn = centres[:: max(1, -(-len(centres) // _MOST_CUBES))]
    colours = _HEIGHTS(heights(drawn[:, 2])) if len(drawn) else None
    if not len(scene.centres):
        draw_perspective(axes, scene.obstacles, low, high)
    axes.scatter(drawn[:, 0], drawn[:, 1], drawn[:, 2], c=colours, s=15, marker="s", linewidths=0, depthshade=False)
    route = np.array(scene.route).reshape(-1, 3)
    for piece in _pieces(route):
        axes.plot(*piece.T, "--", color=_ROUTE, lw=1.2)
    for stretch in scene.flown if scene.was_flown else ():
        colour = BRANCH_COLOURS.get(stretch.branch, _ELSEWHERE)
        line = axes.plot(stretch.path[:, 0], stretch.path[:, 1], stretch.path[:, 2], color=colour, lw=2.2, zorder=10)
        line[0].set_path_effects([withStroke(linewidth=4.0, foreground="white")])
    for place in scene.obstacles_met:
        _mark(axes, place, "X", 110, "#ffb000", 11)
    _mark(axes, scene.home, "^", 110, "white", 11)
    if scene.was_flown:
        _mark(axes, scene.flown[-1].path[-1], "v", 70, END, 12)
    for trouble in scene.troubles:
        _mark(axes, trouble.place, "D", 60, TROUBLE, 12)
    for number, switch in enumerate(scene.switches, 1):
        axes.text(*switch.place, str(number), **_BADGE, zorder=13)
    up = drawn[:, 2] if len(drawn) else np.concatenate([route[:, 2], *(each.path[:, 2] for each in scene.flown)])
    if not len(scene.centres):
        up = np.concatenate([up, [obstacle.height for obstacle in scene.obstacles]])
    bottom, top = float(up.min(initial=0.0)), float(up.max(initial=0.0))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(bottom, max(top, bottom + 1.0)))
    axes.set_xlabel("east [m]", labelpad=8.0)
    axes.set_ylabel("north [m]", labelpad=8.0)
    axes.set_zlabel("up [m]")
    axes.set_box_aspect((*(high - low), 1.5 * max(top - bottom, 1.0)), zoom=1.05)
    axes.zaxis.set_major_locator(MaxNLocator(3, integer=True))
    axes.view_init(elev=38.0, azim=-58.0)


def _mark(
    axes: Any, place: Sequence[float] | NDArray[np.float64], marker: str, size: int, colour: str, zorder: int
) -> None:
    x, y, z = place
    axes.scatter([x], [y], [z], marker=marker, s=size, c=colour, edgecolors=_INK, depthshade=False, zorder=zorder)


def _highest(
    centres: NDArray[np.float32], size: float, low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Height (rows = north, columns = east) of the highest occupied voxel over each place; NaN where there is none."""
    columns, rows = np.round((high - low) / size).astype(int)
    roof = np.full((rows, columns), -np.inf)
    x, y = ((centres[:, :2] - low) / size).astype(int).T
    np.maximum.at(roof, (y, x), centres[:, 2])
    return np.where(np.isfinite(roof), roof, np.nan)


def _pieces(route: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The route (N, D) without repeated legs in either direction, because dashes drawn twice look like a solid line."""
    had, pieces = set[frozenset[tuple[float, ...]]](), list[list[tuple[float, ...]]]()
    for start, end in pairwise(tuple(place) for place in np.round(route, 3).tolist()):
        if (leg := frozenset((start, end))) in had:
            continue
        had.add(leg)
        if pieces and pieces[-1][-1] == start:
            pieces[-1].append(end)
        else:
            pieces.append([start, end])
    return [np.array(piece) for piece in pieces]
