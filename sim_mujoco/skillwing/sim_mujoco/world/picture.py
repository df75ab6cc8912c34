"""A picture of a world: a map with its site, and an oblique view."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke
from PIL import Image

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.world.rendering import Renderer, from_above, from_place
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.world import World

_AROUND = 14.0
"""Width of the border of the map around the fence [m]."""
ROWS: Final = 480
_WIDTH = 44.0
"""Angle of the oblique view [degrees]."""
_DPI: Final = 100
_ROUTE, _AREA, _FENCE, _TARGET = "#e0115f", "#ffffff", "#ffcf33", "#19d3ff"
_EDGE = withStroke(linewidth=3.2, foreground="#00000090")


def draw_world(file: Path, world: World, rows: int = ROWS) -> None:
    """Write the picture to `file` (PNG, 256 colours); `rows` is the height of its two views in pixels."""
    renderer, site = Renderer(world), world.site
    (west, south, _), (east, north, _) = site.fence.low, site.fence.high
    low, high = (west - _AROUND, south - _AROUND), (east + _AROUND, north + _AROUND)
    above = renderer.picture(from_above(low, high, 200.0, 2 * rows))
    columns = round(1.5 * rows)
    oblique = renderer.picture(from_place(*_oblique_view(site), (2 * rows, 2 * columns), _WIDTH))
    figure = Figure(figsize=((above.shape[1] + columns + 70) / _DPI, (rows + 76) / _DPI), dpi=_DPI)
    canvas = FigureCanvasAgg(figure)
    width, height = (size * _DPI for size in figure.get_size_inches())
    plan = figure.add_axes((50 / width, 42 / height, above.shape[1] / width, rows / height))
    plan.imshow(above, extent=(low[0], high[0], low[1], high[1]))
    _draw_site(plan, site)
    plan.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    plan.set_xlabel("east [m]", loc="left", labelpad=0)
    plan.set_ylabel("north [m]", labelpad=0)
    plan.tick_params(labelsize=8)
    view = figure.add_axes((1 - (columns + 8) / width, 42 / height, columns / width, rows / height))
    view.imshow(oblique)
    view.set_axis_off()
    figure.text(50 / width, 1 - 22 / height, _title(site), fontsize=12)
    plan.legend(loc="upper center", bbox_to_anchor=(1.0, -0.022), ncols=5, fontsize=8, frameon=False, handlelength=1.6)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    image.quantize(256, kmeans=1, dither=Image.Dither.NONE).save(file, format="PNG", optimize=True)


def _draw_site(axes: Axes, site: Site) -> None:
    (west, south, _), (east, north, _) = site.fence.low, site.fence.high
    axes.add_patch(
        Rectangle((west, south), east - west, north - south, fill=False, ec=_FENCE, lw=1.3, label="geofence")
    )
    west, south, east, north = site.area
    area = Rectangle((west, south), east - west, north - south, fill=False, ec=_AREA, lw=1.1, ls=":", label="detours")
    area.set_path_effects([_EDGE])
    axes.add_patch(area)
    if site.target is not None:
        target = site.target
        axes.add_patch(Circle(target.centre, target.radius, fill=False, ec=_TARGET, lw=1.6, label="inspection"))
    way = np.array(site.way)
    axes.plot(way[:, 0], way[:, 1], "--", color=_ROUTE, lw=1.8, label=f"route at {way[0, 2]:g} m")
    axes.plot(*site.home, "^", ms=9, mfc="white", mec="#1a1a1a", label="home")


def _oblique_view(site: Site) -> tuple[Vector, Vector]:
    """Eye and target of the oblique view: from the south-west, with the route filling the picture."""
    way = np.array(site.way)[:, :2]
    middle = (way.min(axis=0) + way.max(axis=0)) / 2
    reach = 0.5 * float(np.linalg.norm(way.max(axis=0) - way.min(axis=0))) + 0.55 * site.ceiling + 12.0
    distance = reach / math.tan(math.radians(_WIDTH) / 2)
    bearing, dip = math.radians(236.0), math.radians(31.0)
    aim = 0.2 * site.ceiling
    eye = (
        float(middle[0]) + distance * math.cos(dip) * math.cos(bearing),
        float(middle[1]) + distance * math.cos(dip) * math.sin(bearing),
        aim + distance * math.sin(dip),
    )
    return eye, (float(middle[0]), float(middle[1]), aim)


def _title(site: Site) -> str:
    scale = "" if site.scale == 1.0 else f", scale {site.scale:g}"
    return f"{site.kind}, seed {site.seed}{scale}: home at {site.return_height:g} m, over everything"
