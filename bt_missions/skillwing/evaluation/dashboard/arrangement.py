"""Layout of the dashboard: its views, their places, and the tabs in front."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

from skillwing.onboard.topics import common
from skillwing.services.recording import palette
from skillwing.services.recording.mission_view import MissionPanels, trailing, whole_run
from skillwing.services.recording.rerun_stream import framed
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
    "video/SSIM_tenths": "#e69f00",
}
"""Colours of the curves, by `plot/curve`. SSIM is shown in tenths to fit one plot with the frame rate: 10 is a perfect
picture."""

_WINDOW, _NARROW_WINDOW, _AHEAD = 60.0, 30.0, 2.0
"""Seconds of the plots before and after the cursor."""
_DIRECTION = np.array((0.45, 0.7, -0.56))
"""Direction of the overview: north-north-east, and down."""
_HALF_WIDTH, _HALF_HEIGHT = 0.8, 0.46
"""Tangents of the half angles that the site fills: less than those of the viewer, which shows 55 degrees upright."""


class Front(Enum):
    """Subject of a flight; it decides which of two views that share a place is in front."""

    WORLD = "world"
    VIDEO = "video"


@dataclass(frozen=True, slots=True)
class Eye:
    """Eye and target of the overview (ENU, m)."""

    position: common.Vector3
    target: common.Vector3


def overview(site: Site) -> Eye:
    """Nearest eye that has the site's area, its way and the ceiling above its middle in view."""
    west, south, east, north = site.area
    middle = (west + east) / 2, (south + north) / 2
    corners = [(x, y, 0.0) for x in (west, east) for y in (south, north)]
    ahead = _DIRECTION / np.linalg.norm(_DIRECTION)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    depth, aside, above = np.stack([ahead, right, up]) @ np.array([*corners, *site.way, (*middle, site.ceiling)]).T
    # The sides of the view are planes through the eye; both planes of a pair touch an outermost place.
    x, away_for_width = _between(aside, _HALF_WIDTH, depth)
    y, away_for_height = _between(above, _HALF_HEIGHT, depth)
    away = max(away_for_width, away_for_height)
    eye = x * right + y * up - away * ahead
    return Eye(_place(eye), _place(eye + (away + depth.mean()) * ahead))


def _between(across: NDArray[np.float64], slope: float, depth: NDArray[np.float64]) -> tuple[float, float]:
    """Position of the eye across, and its distance behind depth 0, so that |across - x| <= slope * (away + depth)."""
    high, low = float(np.max(across - slope * depth)), float(np.max(-across - slope * depth))
    return (high - low) / 2, (high + low) / 2 / slope


class Arrangement:
    """Views of the dashboard, made once: a repeated arrangement keeps them and their scroll positions."""

    def __init__(self, panels: MissionPanels, eye: Eye) -> None:
        self._panels = panels
        self._scene = rrb.Spatial3DView(
            origin="/world",
            contents=["+ /world/**", "- /world/drone/camera/depth"],
            name="World as the drone knows it",
            background=palette.NIGHT,
            line_grid=rrb.LineGrid3D(visible=True, spacing=5.0, color=[70, 78, 90]),
            eye_controls=rrb.EyeControls3D(position=eye.position, look_target=eye.target, eye_up=(0, 0, 1)),
        )
        self._depth = rrb.Spatial2DView(origin="/world/drone/camera", name="Depth camera")
        self._video = rrb.Spatial2DView(origin="/video", name="Video on the ground")
        self._motion = _plot("motion", "Metres and metres a second", _lately(_WINDOW))
        self._battery = _plot("battery", "Battery [%]", whole_run(_AHEAD), legend=False, high=105.0)
        self._mapped = _plot("mapped", "Mapped [m²]", whole_run(_AHEAD), legend=False)
        self._link = _plot("link", "Link [Mbit/s]", _lately(_NARROW_WINDOW))
        self._quality = _plot("video", "Video", _lately(_NARROW_WINDOW), high=20.0)

    def blueprint(self, front: Front) -> rrb.Blueprint:
        """Blueprint with the view of `front` as the first tab, because tabs that do not fit are hidden."""
        tabs = [(self._depth, self._video), (self._mapped, self._link), (self._battery, self._quality)]
        pictures, left, right = (rrb.Tabs(*(pair if front is Front.WORLD else reversed(pair))) for pair in tabs)
        plots = rrb.Horizontal(left, right)
        now = rrb.Vertical(pictures, self._motion, plots, self._panels.log, row_shares=[9, 5, 5, 12])
        lanes = rrb.Horizontal(self._panels.skills, self._panels.resources)
        so_far = rrb.Vertical(self._scene, lanes)
        return framed(rrb.Horizontal(so_far, now, self._panels.tree, column_shares=[9, 7, 4]))


def _place(xyz: NDArray[np.float64]) -> common.Vector3:
    x, y, z = xyz.round(2).tolist()
    return x, y, z


def _plot(
    group: str, name: str, time: rrb.TimeAxis, *, high: float | None = None, legend: bool = True
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=f"/plots/{group}",
        name=name,
        axis_x=time,
        axis_y=None if high is None else rrb.ScalarAxis(range=(0.0, high)),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )


def _lately(seconds: float) -> rrb.TimeAxis:
    return trailing(seconds, _AHEAD)
