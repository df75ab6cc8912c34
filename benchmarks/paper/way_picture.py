"""Picture of the inspections that lose their link: the path and the link's state under each policy, from above."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from paper_flights import POLICIES
from paper_page import NOMINAL

from skillwing.evaluation.demo.story import INSPECTION
from skillwing.evaluation.flights.plan import FlightPlan, planned_circle
from skillwing.evaluation.judge.flight_log import read_flight
from skillwing.m600.robot import ROBOT
from skillwing.services.history.files import read_goals, read_records
from skillwing.services.history.history import History
from skillwing.sim_mujoco.link.radio import occlusion_zones
from skillwing.sim_mujoco.world.world import make_world

WAYS_PICTURE = "inspection-ways.png"
LINK: Final = "link_status"
COLOURS: Final = {"GOOD": "#2e9e4f", "DEGRADED": "#e69f00", "LOST": "#d62728"}
"""Colours of the path by the state of the link, as in the timelines."""
ZONES: Final = ("#f6e3b5", "#f3c6c1")
INK, WALL = "#1a1a1a", "#5f6773"
MARGIN = 6.0


def flights_drawn() -> frozenset[tuple[str, str]]:
    """Mission and policy of the flights whose recordings the picture needs."""
    return frozenset((INSPECTION, policy.label) for policy in POLICIES[INSPECTION] if policy.label != NOMINAL)


def draw_ways(file: Path, plan: FlightPlan, runs: Mapping[str, Path]) -> None:
    """Write the picture (PNG): a panel for each policy. plan: any of them; runs: recorded flights, by policy."""
    figure = Figure(figsize=(4.1 * len(runs), 4.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    row = figure.subplots(1, len(runs), sharey=True, squeeze=False)[0]
    for axes, (label, run) in zip(row, runs.items(), strict=True):
        words = next(policy.words for policy in POLICIES[INSPECTION] if policy.label == label)
        _draw_site(axes, plan)
        _draw_way(axes, run)
        axes.set_title(words, fontsize=11, color=INK)
        axes.set_xlabel("east [m]")
    row[0].set_ylabel("north [m]")
    figure.legend(handles=_legend(), loc="outside lower left", ncols=8, frameon=False)
    figure.savefig(file, metadata={"Software": None})


def _draw_site(axes: Axes, plan: FlightPlan) -> None:
    """Draw the site: prior knowledge, and the zones of the bad link, which the robot does not know."""
    world = make_world(plan.seed, plan.world)
    target = world.site.target
    assert target is not None, "an inspection has something to inspect"
    circle = np.array([*planned_circle(plan.site(), INSPECTION), planned_circle(plan.site(), INSPECTION)[0]])
    low = np.minimum(circle[:, :2].min(axis=0), world.home) - MARGIN
    high = circle[:, :2].max(axis=0) + MARGIN
    for zone, colour in zip(occlusion_zones(target), ZONES, strict=True):
        assert zone.low is not None, "a building's shadow is a box"
        assert zone.high is not None, "a building's shadow is a box"
        (west, south, _), (east, north, _) = zone.low, zone.high
        axes.add_patch(Rectangle((west, south), east - west, north - south, color=colour, lw=0, zorder=0))
    for each in world.obstacles:
        if each.footprint.distance_to(target.centre) == 0.0:
            axes.add_patch(Polygon(each.footprint.corners(), closed=True, color=WALL, lw=0, zorder=2))
    axes.plot(circle[:, 0], circle[:, 1], "--", color=INK, lw=1.0, zorder=3)
    axes.plot(*world.home, "^", ms=10, mfc="white", mec=INK, mew=1.4, zorder=6)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def _draw_way(axes: Axes, run: Path) -> None:
    history = History.of(read_records(run), read_goals(run), ROBOT.load_skillset())
    flight = read_flight(run)
    times = np.array([truth.t for truth in flight])
    places = np.array([truth.position for truth in flight])
    for span in history.lanes[LINK]:
        # Begins at the last sample of the previous stretch, so that there is no gap.
        first = max(int(np.searchsorted(times, span.t_start)) - 1, 0)
        end = len(times) if span.t_end is None else int(np.searchsorted(times, span.t_end, side="right"))
        colour = COLOURS.get(span.state, INK)
        axes.plot(places[first:end, 0], places[first:end, 1], color=colour, lw=2.6, zorder=4)
    axes.plot(*places[-1, :2], "s", ms=8, mfc=INK, mec="white", zorder=7)


def _legend() -> list[Line2D | Patch]:
    def line(label: str, colour: str) -> Line2D:
        return Line2D([], [], color=colour, lw=2.6, label=label)

    def mark(label: str, marker: str, fill: str) -> Line2D:
        return Line2D([], [], ls="", marker=marker, ms=9, mfc=fill, mec=INK, label=label)

    return [
        *(line(f"link {state.lower()}", colour) for state, colour in COLOURS.items()),
        Patch(color=ZONES[0], label="radio shadow, poor"),
        Patch(color=ZONES[1], label="radio shadow, critical"),
        Patch(color=WALL, label="building"),
        mark("home", "^", "white"),
        mark("landed", "s", INK),
    ]
