"""How the dashboard is laid out: which views there are, where they stand, and which are in front."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

from skillwing.services.telemetry import palette
from skillwing.services.telemetry.mission_view import MissionPanels, trailing
from skillwing.services.telemetry.recording import framed
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.world.site import Site

SERIES = {
    "motion/altitude": "#3b82f6",
    "motion/free_distance": "#e69f00",
    "motion/speed": "#2e9e4f",
    "battery/battery": "#c3a3e3",
    "mapped/surface": "#76c7c0",
    "link/bandwidth": "#9aa4b2",
    "link/received": "#0072b2",
    "video/fps": "#2e9e4f",
    "video/quality": "#e69f00",
}
"""Every curve, as `plot/curve`, with its colour."""

_WINDOW, _AHEAD = 60.0, 2.0
"""Seconds of the plots before and after the cursor."""
_DIRECTION = np.array((0.45, 0.7, -0.56))
"""In which the overview looks: north-north-east, and down."""
_HALF_WIDTH, _HALF_HEIGHT = 0.8, 0.46
"""Tangents of the half angles that are filled: a bit less than those of the viewer, 55 degrees from top to bottom."""


class Front(Enum):
    """What a flight is about, hence what is in front of what shares its place."""

    WORLD = "world"
    VIDEO = "video"


@dataclass(frozen=True, slots=True)
class Eye:
    """Where the overview looks from, and at what (ENU, m)."""

    position: topics.Vector3
    target: topics.Vector3


def overview(site: Site) -> Eye:
    """As near as it can be for the site's area, its way and what stands highest in its midst to be in view."""
    west, south, east, north = site.area
    x, y = (west + east) / 2, (south + north) / 2
    corners = [(a, b, 0.0) for a in (west, east) for b in (south, north)]
    target = np.array((x, y, site.ceiling / 4))
    ahead = _DIRECTION / np.linalg.norm(_DIRECTION)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    shown = np.array([*corners, *site.way, (x, y, site.ceiling)]) - target
    depth, aside, above = np.stack([ahead, right, np.cross(right, ahead)]) @ shown.T
    away = np.max([np.abs(aside) / _HALF_WIDTH - depth, np.abs(above) / _HALF_HEIGHT - depth])
    return Eye(_place(target - away * ahead), _place(target))


class Arrangement:
    """The views, made once: an arrangement that is sent again shows the same ones, as far scrolled as they were."""

    def __init__(self, panels: MissionPanels, eye: Eye) -> None:
        self._panels = panels
        self._scene = rrb.Spatial3DView(
            origin="/world",
            contents=["+ /world/**", "- /world/drone/camera/depth"],
            name="World as mapped",
            background=palette.NIGHT,
            line_grid=rrb.LineGrid3D(visible=True, spacing=5.0, color=[70, 78, 90]),
            eye_controls=rrb.EyeControls3D(position=eye.position, look_target=eye.target, eye_up=(0, 0, 1)),
        )
        self._depth = rrb.Spatial2DView(origin="/world/drone/camera", name="Depth camera")
        self._video = rrb.Spatial2DView(origin="/video", name="Video on the ground")
        self._motion = _plot("motion", "Metres and metres a second", legend=True)
        self._battery = _plot("battery", "Battery [%]", low=0.0, high=100.0)
        self._mapped = _plot("mapped", "Mapped [m²]")
        self._link = _plot("link", "Link [Mbit/s]", legend=True)
        self._quality = _plot("video", "Video [FPS, SSIM %]", low=0.0, high=100.0, legend=True)

    def blueprint(self, front: Front) -> rrb.Blueprint:
        shown = front is Front.VIDEO
        pictures = rrb.Tabs(self._depth, self._video, active_tab=int(shown))
        left = rrb.Tabs(self._mapped, self._link, active_tab=int(shown))
        right = rrb.Tabs(self._battery, self._quality, active_tab=int(shown))
        seen = rrb.Vertical(pictures, self._motion, rrb.Horizontal(left, right), row_shares=[5, 4, 4])
        told = rrb.Horizontal(self._panels.skills, self._panels.resources, self._panels.log, column_shares=[4, 3, 5])
        flight = rrb.Vertical(rrb.Horizontal(self._scene, seen, column_shares=[5, 3]), told, row_shares=[6, 5])
        return framed(rrb.Horizontal(flight, self._panels.tree, column_shares=[4, 1]))


def _place(xyz: NDArray[np.float64]) -> topics.Vector3:
    x, y, z = xyz.round(2).tolist()
    return x, y, z


def _plot(
    group: str, name: str, *, low: float | None = None, high: float | None = None, legend: bool = False
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=f"/plots/{group}",
        name=name,
        axis_x=trailing(_WINDOW, _AHEAD),
        axis_y=None if low is None or high is None else rrb.ScalarAxis(range=(low, high)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )
