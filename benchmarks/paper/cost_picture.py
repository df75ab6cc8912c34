"""Picture of the cost of recovery: a dot for each flight, a row for each policy, a panel for each figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Final

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator
from paper_flights import POLICIES, Policy
from paper_page import COLUMNS, NOMINAL, RECOVERY, Column

from skillwing.evaluation.flights.result import FlightResult

COST_PICTURE = "price.png"
COLOURS: Final = {NOMINAL: "#6b6b6b", RECOVERY: "#2e9e4f"}
OTHER, CRASHED, INK = "#1756c4", "#d62728", "#1a1a1a"
PANELS = 4
"""Number of drawn figures of a mission, from the first one on."""
SPREAD = 0.36
"""Height of one policy's dots [rows]; seeds are ordered from top to bottom."""


def draw_costs(file: Path, results: Sequence[FlightResult]) -> None:
    """Write the picture (PNG): a row of panels for each mission that was flown."""
    missions = [mission for mission in POLICIES if any(each.plan.mission == mission for each in results)]
    figure = Figure(figsize=(14.0, 0.5 + 2.9 * len(missions)), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    parts = figure.subfigures(len(missions), squeeze=False)[:, 0]
    for mission, part in zip(missions, parts, strict=True):
        part.suptitle(mission.capitalize(), x=0.005, ha="left", fontsize=13, fontweight="bold", color=INK)
        flown = [each for each in results if each.plan.mission == mission]
        row = part.subplots(1, PANELS)
        for axes, column in zip(row, COLUMNS[mission][:PANELS], strict=True):
            _draw_panel(axes, column, POLICIES[mission], flown)
            axes.set_yticks(range(len(POLICIES[mission])), [policy.words for policy in POLICIES[mission]])
            axes.tick_params(labelleft=axes is row[0])
    figure.legend(handles=_legend(), loc="outside lower right", ncols=4, frameon=False)
    figure.savefig(file, metadata={"Software": None})


def _draw_panel(axes: Axes, column: Column, policies: Sequence[Policy], results: Sequence[FlightResult]) -> None:
    for row, policy in enumerate(policies):
        flown = sorted((each for each in results if each.plan.label == policy.label), key=lambda each: each.plan.seed)
        known = [(value, each.collisions > 0) for each in flown if (value := column.figure(each)) is not None]
        if not known:
            continue
        middle = median(value for value, _ in known)
        axes.plot([middle, middle], [row - 0.32, row + 0.32], color=INK, lw=2.2, zorder=4, solid_capstyle="butt")
        if policy.label == NOMINAL:
            axes.axvline(middle, color=COLOURS[NOMINAL], lw=0.9, ls=(0, (4, 3)), zorder=1)
        for index, (value, crashed) in enumerate(known):
            y = row + SPREAD * ((index + 0.5) / len(known) - 0.5)
            colour = CRASHED if crashed else COLOURS.get(policy.label, OTHER)
            marker = "X" if crashed else "o"
            axes.plot(value, y, marker, ms=8, mfc=colour, mec="white", mew=0.8, zorder=5)
    axes.set_ylim(len(policies) - 0.45, -0.55)
    axes.margins(x=0.08)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: column.unit.show(value)))
    axes.set_title(column.heading, fontsize=11, color=INK)
    axes.grid(axis="x", alpha=0.25)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)


def _legend() -> list[Line2D]:
    def mark(label: str, colour: str, marker: str = "o") -> Line2D:
        return Line2D([], [], ls="", marker=marker, ms=8, mfc=colour, mec="white", label=label)

    return [
        mark("a flight", OTHER),
        mark("a flight that hit something", CRASHED, "X"),
        Line2D([], [], color=INK, lw=0, marker="|", ms=14, mew=2.2, label="median of the policy"),
        Line2D([], [], color=COLOURS[NOMINAL], lw=0.9, ls=(0, (4, 3)), label="median of the nominal flights"),
    ]
