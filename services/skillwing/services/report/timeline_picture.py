"""`timeline.png`: a picture of a run, after Figures 11 and 12 of the paper.

Skills are above, resources below, on one axis of time. Every switch between branches of the mission is a numbered line
through both, with its causes in words under the title.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from textwrap import shorten
from typing import Any, NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from skillwing.dsl.model import Resource
from skillwing.dsl.whole_files import write_whole
from skillwing.services.history.history import History, SkillBar, StateSpan, SwitchEvent
from skillwing.services.history.wording import chain_text
from skillwing.services.recording import palette

WIDTH, HEIGHT, DPI = 1600, 900, 100
ROBOT_TIME, MISSION_TIME, RUN_TIME = "robot time", "time since the mission began", "time since the first record"
"""Labels of the time axis: robot time, which begins before any mission, or time since a moment in it."""
_LETTER_PX = 6.3
"""Width of a letter in a bar; a text that does not fit its bar is left out."""
_HALF_HEIGHT = 0.36
"""Half of a bar's height [lanes]."""
_LEAST_PX = 2.0
"""Least width of a bar."""
_LEAST_WITH_EDGE_PX = 3.0
"""Width from which a bar has a white edge."""
_IN_FRONT = {palette.AMBER: 1, palette.RED: 2}
"""Ranks of the colours that cover others; the rest have 0."""
_MAX_SWITCHES = 6
_REFUSED: dict[str, Any] = {"marker": "v", "markersize": 6}
"""Marker of a goal that never ran, which has no bar."""


def draw_timeline(
    history: History, path: Path, *, title: str, resources: Sequence[Resource] = (), clock: str = ROBOT_TIME
) -> None:
    """Write the picture of `history` to `path` (PNG), whose folder exists.

    resources: order and colours of resource lanes. clock: label of the time axis.
    """
    end = max(history.end, 1.0)
    skills = list(dict.fromkeys(bar.skill for bar in history.bars))
    lanes = history.lanes
    known = [resource.name for resource in resources if resource.name in lanes]
    known += [name for name in lanes if name not in known]
    changing = [name for name in known if len(lanes[name]) > 1]
    steady = [f"{name} {lanes[name][0].state}" for name in known if len(lanes[name]) == 1]

    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    switches = history.switches
    top = 0.90 - 0.026 * min(len(switches), _MAX_SWITCHES)
    upper, lower = figure.subplots(
        2,
        1,
        sharex=True,
        height_ratios=[max(len(skills), 1), max(len(changing), 1)],
        gridspec_kw={"left": 0.125, "right": 0.985, "top": top, "bottom": 0.085, "hspace": 0.05},
    )
    upper.set_xlim(0.0, end * 1.005)
    letter = _LETTER_PX * end / (0.86 * WIDTH)
    _draw_skills(upper, history.bars, skills, end, letter)
    colours = {resource.name: palette.state_colours(resource.states, resource.initial) for resource in resources}
    drawn = _draw_resources(lower, {name: lanes[name] for name in changing}, colours, end, letter)
    lower.set_xlabel(f"{clock} [s]", loc="left", fontsize=11, color=palette.INK)
    _draw_switches(figure, upper, lower, switches)

    figure.text(0.015, 0.962, title, fontsize=15, fontweight="bold", color=palette.INK, va="center")
    legend: list[Artist] = [Patch(color=colour, label=outcome) for outcome, colour in palette.OUTCOME_COLOURS.items()]
    if any(bar.refused for bar in history.bars):
        legend.append(Line2D([], [], **_REFUSED, color=palette.INK, linestyle="none", label="refused"))
    figure.legend(
        handles=legend,
        loc="upper right",
        bbox_to_anchor=(0.99, 0.985),
        ncols=len(legend),
        frameon=False,
        fontsize=10,
    )
    _explain_states(figure, drawn)
    if steady:
        note = "Unchanged throughout: " + ", ".join(steady)
        figure.text(0.015, 0.012, shorten(note, 210, placeholder=" ..."), fontsize=9, color="#57606a")
    picture = BytesIO()
    canvas.print_png(picture)
    write_whole(path, picture.getvalue())


class _Bar(NamedTuple):
    """A bar of one lane, from `start` on for `width` seconds, with a text if that fits."""

    start: float
    width: float
    colour: str
    text: str
    ink: str


def _draw_skills(axes: Axes, bars: Sequence[SkillBar], skills: Sequence[str], end: float, letter: float) -> None:
    _prepare(axes, skills, "Skills")
    for lane, skill in enumerate(skills):
        ran: list[_Bar] = []
        refused: dict[str, list[float]] = {}
        for bar in (bar for bar in bars if bar.skill == skill):
            colour = palette.OUTCOME_COLOURS[bar.outcome]
            if bar.refused:
                refused.setdefault(colour, []).append(bar.t_start)
            else:
                width = (end if bar.t_end is None else bar.t_end) - bar.t_start
                ran.append(_Bar(bar.t_start, width, colour, bar.terminal or "running", "white"))
        _draw_lane(axes, lane, ran, letter)
        for colour, times in refused.items():
            height = [lane - _HALF_HEIGHT] * len(times)
            axes.plot(times, height, **_REFUSED, linestyle="none", color=colour, clip_on=False)


def _draw_resources(
    axes: Axes,
    lanes: Mapping[str, Sequence[StateSpan]],
    colours: Mapping[str, Mapping[str, str]],
    end: float,
    letter: float,
) -> set[str]:
    """Draw the lanes of resources; returns the colours in use."""
    _prepare(axes, list(lanes), "Resources")
    drawn = set[str]()
    for lane, (name, spans) in enumerate(lanes.items()):
        of_resource = colours.get(name) or palette.state_colours(
            tuple(dict.fromkeys(span.state for span in spans)), spans[0].state
        )
        bars: list[_Bar] = []
        for span in spans:
            width = (end if span.t_end is None else span.t_end) - span.t_start
            colour = of_resource.get(span.state, palette.REST)
            ink = "white" if colour == palette.RED else palette.INK
            bars.append(_Bar(span.t_start, width, colour, span.state, ink))
        _draw_lane(axes, lane, bars, letter)
        drawn.update(bar.colour for bar in bars)
    return drawn


def _draw_lane(axes: Axes, lane: int, bars: Sequence[_Bar], letter: float) -> None:
    """Draw all bars of a lane as one collection: an artist for each costs a millisecond.

    In a long run bars are narrower than a pixel. They are drawn wider then, without the edges, which would hide them.
    Trouble is drawn last.
    """
    pixel = letter / _LETTER_PX
    drawn = sorted(bars, key=lambda bar: _IN_FRONT.get(bar.colour, 0))
    axes.broken_barh(
        [(bar.start, max(bar.width, _LEAST_PX * pixel)) for bar in drawn],
        (lane - _HALF_HEIGHT, 2.0 * _HALF_HEIGHT),
        facecolors=[bar.colour for bar in drawn],
        edgecolor="white",
        linewidths=[0.8 if bar.width >= _LEAST_WITH_EDGE_PX * pixel else 0.0 for bar in drawn],
    )
    for bar in bars:
        if bar.width >= letter * (len(bar.text) + 1):
            middle = bar.start + bar.width / 2
            axes.text(middle, lane, bar.text, ha="center", va="center", fontsize=8, color=bar.ink, clip_on=True)


def _explain_states(figure: Figure, drawn: set[str]) -> None:
    """Add a legend of the drawn colours below the resources."""
    meanings: dict[str, Any] = {
        meaning: tuple(Patch(color=colour) for colour in colours if colour in drawn)
        for meaning, colours in palette.STATE_COLOURS.items()
        if not drawn.isdisjoint(colours)
    }
    figure.legend(
        meanings.values(),
        meanings.keys(),
        handler_map={tuple: HandlerTuple(ndivide=None)},
        loc="lower right",
        bbox_to_anchor=(0.99, 0.022),
        ncols=max(len(meanings), 1),
        frameon=False,
        fontsize=10,
    )


def _prepare(axes: Axes, names: Sequence[str], what: str) -> None:
    axes.set_yticks(range(len(names)), names, fontsize=10)
    axes.set_ylim(max(len(names), 1) - 0.4, -0.6)
    axes.set_ylabel(what, fontsize=11, color=palette.INK)
    axes.grid(axis="x", color="#d8dee4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, labelcolor=palette.INK)
    for spine in axes.spines.values():
        spine.set_color("#d0d7de")


def _draw_switches(figure: Figure, upper: Axes, lower: Axes, switches: Sequence[SwitchEvent]) -> None:
    for number, switch in enumerate(switches, start=1):
        for axes in (upper, lower):
            axes.axvline(switch.t, color=palette.INK, linewidth=1.6, linestyle=(0, (5, 2)))
        upper.annotate(
            str(number),
            (switch.t, 1.0),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="center",
            fontsize=10,
            fontweight="bold",
            color="white",
            bbox={"boxstyle": "circle,pad=0.25", "facecolor": palette.INK, "edgecolor": "none"},
            annotation_clip=False,
        )
    for row, switch in enumerate(switches[:_MAX_SWITCHES]):
        more = len(switches) - _MAX_SWITCHES
        last = row == _MAX_SWITCHES - 1 and more > 0
        change = f"({row + 1}) at {switch.t:.1f} s  {switch.before} -> {switch.after}"
        text = f"{change}  because  {chain_text(switch.chain[:-1])}"
        text = f"... and {more + 1} more switches" if last else shorten(text, 190, placeholder=" ...")
        figure.text(0.017, 0.926 - 0.026 * row, text, fontsize=10.5, color=palette.INK, va="center")
