"""What Rerun shows of any mission: skills and resources as lanes, the tree as pills, causes as a log.

Nothing here knows the robot; its scene is a `Scene` that the recorder is given by name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from skillwing.dsl.model import Skill, Skillset
from skillwing.services.bus import Bus
from skillwing.services.protocol import Ending, MissionStatus, Record, RecordKind, State, TreeNode, TreeSnapshot
from skillwing.services.telemetry import palette
from skillwing.services.telemetry.history import History, Outcome, SkillBar, is_switch
from skillwing.services.telemetry.tree_layout import ROW, TreeLayout, lay_out
from skillwing.services.telemetry.wording import headline, in_words, sentence

TIMELINE = "mission_time"
"""Name of the one timeline: robot time as a duration."""
_WINDOW = 90.0
"""Seconds of the lanes that are in view while time runs."""
_PASSING = frozenset({State.VALIDATING, State.DISPATCHING, State.INTERRUPTING})
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

    def close(self) -> None: ...


def at(recording: rr.RecordingStream, t: float) -> None:
    """What is logged next happened at robot time `t`."""
    recording.set_time(TIMELINE, duration=t)


def trailing(seconds: float, ahead: float = 0.0) -> rrb.TimeAxis:
    """A time axis that shows the last `seconds` before the cursor and `ahead` after it."""
    start = rr.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    end = rr.TimeRangeBoundary.cursor_relative(seconds=ahead)
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


class MissionView:
    """Logs one robot's mission into `recording`. Lanes stand in the order in which the skillset declares them."""

    def __init__(self, recording: rr.RecordingStream, skillset: Skillset) -> None:
        self._recording = recording
        self._skills = {skill.name: skill for skill in skillset.skills}
        self._order = {skill.name: number for number, skill in enumerate(skillset.skills, start=1)}
        self._lanes: set[str] = set()
        self._drawn: dict[str, SkillBar] = {}
        self._shape: tuple[tuple[int, int | None, str], ...] = ()
        self._layout = TreeLayout((), ())
        self._phase = ""
        self._resources: dict[str, str] = {}
        for number, resource in enumerate(skillset.resources, start=1):
            lane = self._resources[resource.name] = f"resources/{number:02}_{resource.name}"
            colours = palette.state_colours(resource.states, resource.initial)
            self._configure(lane, list(colours), list(colours.values()))
            self._state(lane, 0.0, resource.initial)

    @staticmethod
    def panels() -> MissionPanels:
        return MissionPanels(
            skills=rrb.StateTimelineView(origin="/skills", name="Skills", time_view=trailing(_WINDOW, 3.0)),
            resources=rrb.StateTimelineView(origin="/resources", name="Resources", time_view=trailing(_WINDOW, 3.0)),
            tree=rrb.Spatial2DView(origin="/tree", name="Behaviour tree", background=_colour(palette.PAPER)),
            log=rrb.TextLogView(
                origin="/log",
                name="Why things happened",
                columns=rrb.TextLogColumns(timeline_columns=[], text_log_columns=["LogLevel", "Body"]),
            ),
        )

    # --- skills and resources ------------------------------------------------------------------------------

    def show_goal(self, bar: SkillBar) -> None:
        """Draw or recolour the bar of one goal. A goal that never ran has no bar: the log tells of it."""
        if bar.skill not in self._skills or not bar.ran or bar == self._drawn.get(bar.goal_id):
            return
        lane = f"skills/{self._order[bar.skill]:02}_{bar.skill}"
        if bar.skill not in self._lanes:
            self._lanes.add(bar.skill)
            values, colours = zip(*_bar_colours(self._skills[bar.skill]), strict=True)
            self._configure(lane, values, colours)
        self._drawn[bar.goal_id] = bar
        # Logging again at the start recolours the whole bar; the empty state ends it.
        self._state(lane, bar.t_start, bar.terminal or Outcome.RUNNING)
        if bar.t_end is not None:
            self._state(lane, bar.t_end, "")

    def _configure(self, lane: str, values: Iterable[str], colours: Iterable[str]) -> None:
        names = list(values)
        rgba = np.array([palette.rgba(colour) for colour in colours], dtype=np.uint32)
        self._recording.log(lane, rr.StateConfiguration(values=names, labels=names, colors=rgba), static=True)

    def _state(self, lane: str, t: float, state: str) -> None:
        at(self._recording, t)
        self._recording.log(lane, rr.StateChange(state=str(state)))

    # --- causes --------------------------------------------------------------------------------------------

    def show_record(self, record: Record, history: History) -> None:
        if record.kind is RecordKind.RESOURCE and (lane := self._resources.get(record.subject)):
            self._state(lane, record.t, record.after)
        if record.kind is RecordKind.GOAL and record.after in _PASSING:
            return
        chain = history.chain(record.id)
        text = sentence(record)
        if is_switch(record):
            text = f"SWITCH to {record.after}, because {in_words(chain[:-1])}"
        elif len(chain) > 1:
            text += f"  <-  {headline(chain[-2])}"
        at(self._recording, record.t)
        self._recording.log(f"log/{record.kind}", rr.TextLog(text, level=_level(record)))

    def show_mission(self, status: MissionStatus) -> None:
        line = f"{status.mission}: {status.phase}, {status.text}"
        if line != self._phase:
            self._phase = line
            at(self._recording, status.t)
            self._recording.log("log/status", rr.TextLog(line, level=rr.TextLogLevel.INFO))

    # --- tree ----------------------------------------------------------------------------------------------

    def show_tree(self, snapshot: TreeSnapshot) -> None:
        at(self._recording, snapshot.t)
        shape = tuple((node.index, node.parent, node.name) for node in snapshot.nodes)
        if shape != self._shape:
            self._shape = shape
            self._layout = lay_out(snapshot.nodes)
            self._log_branches(snapshot.nodes)
        pills = [
            ((place.x - place.half_width + ROW * 0.4, place.y), (place.x + place.half_width - ROW * 0.4, place.y))
            for place in self._layout.places
        ]
        fill = [palette.TREE_COLOURS.get(node.status, palette.REST) for node in snapshot.nodes]
        self._recording.log("tree/pills", rr.LineStrips2D(pills, colors=_rgba(fill), radii=ROW * 0.4, draw_order=5.0))

    def _log_branches(self, nodes: tuple[TreeNode, ...]) -> None:
        lines = [list(branch) for branch in self._layout.branches]
        self._recording.log("tree/branches", rr.LineStrips2D(lines, colors=[[150, 158, 168]], radii=0.8, draw_order=0))
        centres = [(place.x, place.y) for place in self._layout.places]
        names = [node.name for node in nodes]
        labels = rr.Points2D(
            centres, labels=names, colors=[[255, 255, 255]], radii=0.0, show_labels=True, draw_order=10.0
        )
        self._recording.log("tree/names", labels)


def _bar_colours(skill: Skill) -> list[tuple[str, str]]:
    """Every label that can stand on a bar of this skill, with its colour."""
    pairs: list[tuple[str, str]] = [(Outcome.RUNNING, palette.BLUE), (Ending.INTERRUPTED, palette.GREY)]
    pairs += [(f"S_{result.name}", palette.GREEN if result.success else palette.RED) for result in skill.results]
    pairs += [(f"N_{result.name}", palette.RED) for result in skill.results]
    return pairs + [(label, palette.RED) for label in _RULES]


def _level(record: Record) -> rr.TextLogLevel:
    bad = ("FAILED", "RI", "ERROR", "LOST", "N_", "CRITICAL", "DIVERGED", "ABORTED", "died")
    if record.after.startswith(bad):
        return rr.TextLogLevel.ERROR
    doubtful = record.kind is RecordKind.FAULT or is_switch(record) or record.after.startswith(("NR", "NV", "BUSY"))
    return rr.TextLogLevel.WARN if doubtful else rr.TextLogLevel.INFO


def _rgba(colours: Iterable[str]) -> np.ndarray[Any, np.dtype[np.uint32]]:
    return np.array([palette.rgba(colour) for colour in colours], dtype=np.uint32)


def _colour(colour: str) -> list[int]:
    return list(bytes.fromhex(colour.lstrip("#")))
