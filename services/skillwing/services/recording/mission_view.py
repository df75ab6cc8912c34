"""A mission in Rerun: skills and resources as lanes, the tree as pills, causes as a log.

It is the same for every robot. A robot's own part is a `Scene`, whose factory is an option of the recorder.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from skillwing.dsl.model import Skill, Skillset
from skillwing.services.bus import Bus
from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.history.history import GoalOutcome, History, SkillBar, is_switch
from skillwing.services.history.recent_history import GOALS_KEPT
from skillwing.services.history.wording import abridge, brief, headlines
from skillwing.services.protocol import Ending, MissionStatus, Record, RecordKind, State, TreeNode, TreeSnapshot
from skillwing.services.recording import palette
from skillwing.services.recording.row_buffer import RowBuffer
from skillwing.services.recording.tree_layout import ROW, ROWS, WIDTH, Outline, TreeLayout, lay_out

TIMELINE = "mission_time"
"""Name of the one timeline: robot time as a duration."""
_AHEAD = 2.0
"""Seconds after the cursor that the lanes show."""
_WINDOW = 120.0
"""Seconds of the lanes in a view that does not show the whole run."""
_LEAD = 1.0
"""Seconds for which the lanes show the state before the first change."""
_PILL = 0.45
"""Half the height of a pill, in rows."""
_LABEL_BELOW = 12.5
"""Rerun writes a label this many pixels below its point."""
_LOG_WIDTH = 54
"""Letters that fit a row of the log: a row is one line, and Rerun hides the rest."""
_INDENT = "    "
_HARD_BLANK = "\u00a0"
_PASSING = frozenset({State.VALIDATING, State.DISPATCHING, State.INTERRUPTING, "GRANTED", "ENDED", "NOT_READY"})
_WAITING = "IDLE"
"""Phase of a mission that has not begun."""
_BAD = ("FAILED", "RI", "ERROR", "LOST", "N_", "CRITICAL", "DIVERGED", "ABORTED", "VIOLATED")
_WARNING = ("NR", "NV", "BUSY", "S_BLOCKED", "S_ABORTED")
_RULES = ("NV", "NR", "RI", "BUSY", "ERROR", "LOST")


@dataclass(frozen=True, slots=True)
class MissionPanels:
    """Views of the mission that a scene's blueprint arranges."""

    skills: rrb.View
    resources: rrb.View
    tree: rrb.View
    log: rrb.View


class Scene(Protocol):
    """A robot's part of the recording, made by a factory `(recording, options) -> Scene`."""

    def blueprint(self, panels: MissionPanels) -> rrb.Blueprint:
        """The whole dashboard, with the mission's panels in it."""
        ...

    def attach(self, bus: Bus) -> None: ...

    def restate(self) -> None:
        """Log all static data again, and what else is still to be seen: a new file lacks what came before it."""
        ...

    def close(self) -> None: ...


def at(recording: rr.RecordingStream, t: float) -> None:
    """Set the robot time of the data that is logged next."""
    recording.set_time(TIMELINE, duration=t)


def trailing(seconds: float, ahead: float = 0.0) -> rrb.TimeAxis:
    """A time axis that shows the last `seconds` before the cursor and `ahead` after it."""
    start = rr.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    end = rr.TimeRangeBoundary.cursor_relative(seconds=ahead)
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def whole_run(ahead: float = 0.0) -> rrb.TimeAxis:
    """A time axis from the beginning of robot time to `ahead` seconds after the cursor."""
    start = rr.TimeRangeBoundary.absolute(seconds=0.0)
    end = rr.TimeRangeBoundary.cursor_relative(seconds=ahead)
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


class MissionView:
    """Logs one robot's mission into `recording`. A skill or resource has a lane from its first use or change on.

    from_zero: robot time begins with the run, as in a simulated world; for mocks it is the time of day. rows: of its
    log and lanes, which its owner sends.
    """

    def __init__(self, recording: rr.RecordingStream, skillset: Skillset, *, from_zero: bool = True) -> None:
        self._recording = recording
        self.rows = RowBuffer(recording, TIMELINE)
        self._skills = {skill.name: skill for skill in skillset.skills}
        self._lanes: dict[str, str] = {}
        self._looks: dict[str, rr.StateConfiguration] = {}
        self._states: dict[str, tuple[float, str]] = {}
        """Latest state of each lane, and its time."""
        self._drawn = BoundedDict[str, SkillBar](GOALS_KEPT)
        self._shape: tuple[tuple[int, int | None, str], ...] = ()
        self._layout = TreeLayout((), ())
        self._outline = Outline()
        self._waited_for = ""
        self._resources = {resource.name: resource for resource in skillset.resources}
        self._begin: float | None = 0.0 if from_zero else None
        """Robot time at which lanes begin: for None, shortly before the first record."""

    @staticmethod
    def panels(*, from_zero: bool) -> MissionPanels:
        """The views. Lanes show all of a run that begins with robot time, and the latest part of another."""
        lanes = whole_run(_AHEAD) if from_zero else trailing(_WINDOW, _AHEAD)
        return MissionPanels(
            skills=rrb.StateTimelineView(origin="/skills", name="Skills", time_view=lanes),
            resources=rrb.StateTimelineView(origin="/resources", name="Resources", time_view=lanes),
            tree=rrb.Spatial2DView(
                origin="/tree",
                name="Behaviour tree",
                background=palette.NIGHT,
                visual_bounds=rrb.VisualBounds2D(x_range=[0.0, WIDTH], y_range=[-ROW / 2, (ROWS + 0.5) * ROW]),
            ),
            log=rrb.TextLogView(
                origin="/log",
                name="Why things happened",
                columns=rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"]),
                rows=rrb.TextLogRows(filter_by_log_level=["INFO", "WARN", "ERROR", "CRITICAL"]),
            ),
        )

    # --- skills and resources ------------------------------------------------------------------------------

    def show_goal(self, bar: SkillBar) -> None:
        """Draw or recolour the bar of one goal. A goal that never ran has no bar, but a line in the log."""
        if bar.skill not in self._skills or not bar.ran or bar == self._drawn.get(bar.goal_id):
            return
        lane = self._lanes.get(bar.skill) or self._new_lane("skills", bar.skill, _bar_colours(self._skills[bar.skill]))
        self._drawn[bar.goal_id] = bar
        # Logging again at the start recolours the whole bar; the empty state ends it.
        self._state(lane, bar.t_start, bar.terminal or GoalOutcome.RUNNING)
        if bar.t_end is not None:
            self._state(lane, bar.t_end, "")

    def _show_resource(self, record: Record) -> None:
        """Resources that never change have no lane."""
        resource = self._resources.get(record.subject)
        if resource is None:
            return
        if record.subject not in self._lanes:
            colours = palette.state_colours(resource.states, resource.initial)
            lane = self._new_lane("resources", resource.name, colours)
            self._state(lane, self._begin or 0.0, record.before or resource.initial)
        self._state(self._lanes[record.subject], record.t, record.after)

    def _new_lane(self, group: str, name: str, colours: Mapping[str, str]) -> str:
        """Lanes are sorted by path, so a number puts them in the order of their first use, as in the paper."""
        number = 1 + sum(lane.startswith(group) for lane in self._lanes.values())
        lane = self._lanes[name] = f"{group}/{number:02}_{name}"
        names = list(colours)
        self._looks[lane] = rr.StateConfiguration(values=names, labels=names, colors=_rgba(colours.values()))
        self._recording.log(lane, self._looks[lane], static=True)
        return lane

    def _state(self, lane: str, t: float, state: str) -> None:
        self._states[lane] = t, str(state)
        self.rows.add_state(lane, t, str(state))

    def restate(self) -> None:
        """Log lanes and their latest states again, and the tree when it comes next: a new file begins."""
        for lane, look in self._looks.items():
            self._recording.log(lane, look, static=True)
        for lane, (t, state) in self._states.items():
            self._state(lane, t, state)
        self._shape = ()

    # --- causes --------------------------------------------------------------------------------------------

    def show_record(self, record: Record, history: History) -> None:
        if self._begin is None:
            self._begin = max(record.t - _LEAD, 0.0)
        if record.kind is RecordKind.RESOURCE:
            self._show_resource(record)
        if record.kind is RecordKind.MISSION and record.before == _WAITING:
            self._outline = Outline()  # the next mission's nodes have the same numbers
        level = _level(record)
        text = f"SWITCH {record.before} -> {record.after}" if is_switch(record) else brief(record)
        causes = [] if level == rr.TextLogLevel.INFO else headlines(history.chain(record.id))[:-1]
        if causes:
            text += "\n" + causes_in_words(causes)
        self._log(record.kind, record.t, text, level)

    def show_mission(self, status: MissionStatus) -> None:
        """Log the reason for which a mission waits before it begins; every later phase has a record."""
        if status.phase == _WAITING and status.text != self._waited_for:
            self._waited_for = status.text
            self._log("mission_status", status.t, f"{status.mission} {status.text}", rr.TextLogLevel.INFO)

    def _log(self, source: str, t: float, text: str, level: rr.TextLogLevel) -> None:
        for line in in_lines(text):
            self.rows.add_line(
                f"log/{source}", round(t, 2), line, level.value
            )  # more digits would not fit their column

    # --- tree ----------------------------------------------------------------------------------------------

    def show_tree(self, snapshot: TreeSnapshot) -> None:
        at(self._recording, snapshot.t)
        nodes = self._outline.shown(snapshot.nodes)
        shape = tuple((node.index, node.parent, node.name) for node in nodes)
        if shape != self._shape:
            self._layout = lay_out(nodes)
            self._shape = shape
            self._log_names(nodes)
        radius = _PILL * self._layout.row
        pills = [((box.left + radius, box.y), (box.right - radius, box.y)) for box in self._layout.boxes]
        fill = _rgba(self._pill_colour(node) for node in nodes)
        self._recording.log("tree/pills", rr.LineStrips2D(pills, colors=fill, radii=radius, draw_order=5.0))

    def _pill_colour(self, node: TreeNode) -> str:
        if node.status == "INVALID" and self._outline.latest(node) == "FAILURE":
            return palette.GAVE_UP
        return palette.TREE_COLOURS.get(node.status, palette.REST)

    def _log_names(self, nodes: tuple[TreeNode, ...]) -> None:
        lines = [list(branch) for branch in self._layout.branches]
        self._recording.log("tree/branches", rr.LineStrips2D(lines, colors=[[110, 118, 130]], radii=0.6, draw_order=0))
        centres = [((box.left + box.right) / 2, box.y - _LABEL_BELOW) for box in self._layout.boxes]
        names = rr.Points2D(
            centres,
            labels=[node.name for node in nodes],
            colors=[[255, 255, 255]],
            radii=0.0,
            show_labels=True,
            draw_order=10.0,
        )
        self._recording.log("tree/names", names)


def causes_in_words(chain: list[str]) -> str:
    """A chain of causes, given root first, abridged and nearest first. Blanks within a cause do not break, so that line
    breaks come between causes."""
    return " ".join(f"<- {cause}".replace(" ", _HARD_BLANK) for cause in reversed(abridge(chain)))


def in_lines(text: str, width: int = _LOG_WIDTH) -> list[str]:
    """A text in lines, with all lines but the first indented."""
    lines: list[str] = []
    for line in text.splitlines():
        indent = _INDENT if lines else ""
        lines += textwrap.wrap(
            line,
            width,
            initial_indent=indent,
            subsequent_indent=_INDENT,
            break_long_words=False,
            break_on_hyphens=False,
        )
    return [line.replace(_HARD_BLANK, " ") for line in lines]


def _bar_colours(skill: Skill) -> dict[str, str]:
    """Every label of this skill's bars, with its colour."""
    colours: dict[str, str] = {GoalOutcome.RUNNING: palette.BLUE, Ending.INTERRUPTED: palette.GREY}
    colours |= {f"S_{result.name}": palette.GREEN if result.success else palette.RED for result in skill.results}
    colours |= {f"N_{result.name}": palette.RED for result in skill.results}
    return colours | dict.fromkeys(_RULES, palette.RED)


def _level(record: Record) -> rr.TextLogLevel:
    """Log level of a record. Steps that the lanes show better have the level for debugging."""
    if record.after.startswith(_BAD):
        return rr.TextLogLevel.ERROR
    if record.kind is RecordKind.FAULT or is_switch(record) or record.after.startswith(_WARNING):
        return rr.TextLogLevel.WARN
    passing = record.kind is RecordKind.GOAL and record.after in _PASSING
    effect = record.kind is RecordKind.RESOURCE and record.goal_id is not None
    return rr.TextLogLevel.DEBUG if passing or effect or record.kind is RecordKind.DATA else rr.TextLogLevel.INFO


def _rgba(colours: Iterable[str]) -> np.ndarray[Any, np.dtype[np.uint32]]:
    return np.array([palette.rgba(colour) for colour in colours], dtype=np.uint32)
