"""Display of the demo in the terminal: actions of the drone, their reasons, and events so far.

On a terminal one panel is kept up to date; in a pipe each event is a line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, JsonLines, read_goals, read_records
from skillwing.services.history.history import GoalOutcome, History, SkillBar, is_switch
from skillwing.services.history.wording import brief, chain_text
from skillwing.services.protocol import GoalStatus, Keys, M, Message, MissionStatus, Record, RecordKind
from skillwing.services.recording.palette import NEUTRAL, OUTCOME_COLOURS, state_colours

REFRESH = 0.25
"""Period of the panel's updates [wall s]."""
PRINTED_KINDS = frozenset({RecordKind.HEALTH, RecordKind.FAULT, RecordKind.MISSION, RecordKind.PROCESS})
"""Kinds of records that get a line. Lines of goals come from their bars; resources follow from both."""
QUIET = frozenset({"rotate_head", "lock_head"})
"""Skills that turn the nose between two legs. They are left out, because their many lines would hide the others."""
TIME_WIDTH = 10
GAP = "   "
LARGEST_PANEL = 40
"""Largest height of the panel [lines]."""


class FlightDeck:
    """Display that follows a flight on the bus. mission: the mission's latest status, None before the first."""

    def __init__(self, bus: Bus, skillset: Skillset, console: Console, title: str) -> None:
        self.mission: MissionStatus | None = None
        self._bus = bus
        self._console = console
        self._title = title
        self._states = {resource.name: resource.initial for resource in skillset.resources}
        self._colours = {each.name: state_colours(each.states, each.initial) for each in skillset.resources}
        self._history = History(skillset)
        self._goals: list[GoalStatus] = []
        self._lines: deque[tuple[float, Text]] = deque(maxlen=LARGEST_PANEL)
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        keys = Keys(skillset.name)
        follow_records(bus, keys, self._on_record, self._on_goal)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
            self._refresh()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.update(self.picture(), refresh=True)
            self._live.stop()

    @property
    def in_air(self) -> bool:
        """True if the drone was in the air by its last message."""
        return self._states["flight_status"] == "IN_AIR"

    def print_line(self, text: str, style: str = "", t: float | None = None) -> None:
        """Add an event of robot time `t`, by default of now. Call it on the bus's thread."""
        t = self._bus.now() if t is None else t
        self._lines.append((t, Text(text, style)))
        if self._live is None:
            self._console.print(Text.assemble((f"{t:7.1f} s  ", "dim"), (text, style)))

    def complete_journal(self, run_dir: Path) -> None:
        """Write the records that the run's recorder missed because it ended early."""
        recorded, goals = read_records(run_dir), read_goals(run_dir)
        _complete(run_dir / TIMELINE_FILE, recorded, self._history.records)
        _complete(run_dir / GOALS_FILE, goals, self._goals)

    # --- input -------------------------------------------------------------------------------------------------------

    def _on_mission(self, status: MissionStatus) -> None:
        self.mission = status

    def _on_record(self, record: Record) -> None:
        if not self._history.add_record(record):
            return
        if record.kind is RecordKind.RESOURCE:
            self._states[record.subject] = record.after
        elif is_switch(record):
            cause = f"  because  {chain}" if (chain := chain_text(self._history.chain(record.cause))) else ""
            self.print_line(f"{record.before} -> {record.after}{cause}", "bold", record.t)
        elif record.kind in PRINTED_KINDS:
            self.print_line(brief(record), t=record.t)

    def _on_goal(self, status: GoalStatus) -> None:
        if not self._history.add_status(status):
            return
        self._goals.append(status)
        if status.terminal is not None and status.skill not in QUIET:
            bar = self._history.bar(status.goal_id)
            self.print_line(f"{bar.skill} {bar.terminal}  {bar.reason}", OUTCOME_COLOURS[bar.outcome], bar.t_end)

    # --- output ------------------------------------------------------------------------------------------------------

    def _refresh(self) -> None:
        assert self._live is not None
        self._live.update(self.picture(), refresh=True)
        self._bus.after(REFRESH, self._refresh, wall=True)

    def picture(self) -> RenderableType:
        """Panel of the flight, at most as high as the screen: lines that have scrolled away cannot be updated."""
        width = self._console.width
        head = [
            Text(self._title, "bold", no_wrap=True, overflow="ellipsis"),
            Text(self._progress(), no_wrap=True, overflow="ellipsis"),
            *_lines_of(
                [self._bar_text(bar) for bar in self._history.bars if bar.outcome is GoalOutcome.RUNNING], width
            ),
            *_lines_of(list(self._states_worth_a_look()), width),
            Text(),
        ]
        room = min(self._console.height, LARGEST_PANEL) - len(head) - 1
        return Group(*head, self._events(width - TIME_WIDTH - 1, room))

    def _progress(self) -> str:
        status, now = self.mission, f"{self._bus.now():.1f} s"
        if status is None:
            return f"{now}{GAP}starting"
        waypoint = f"waypoint {min(status.waypoint + 1, status.waypoints)} of {status.waypoints}"
        return GAP.join([now, status.phase, waypoint] if status.waypoints else [now, status.phase, status.text])

    def _bar_text(self, bar: SkillBar) -> Text:
        seconds = max(0.0, self._bus.now() - bar.t_start)
        return Text.assemble((f"{bar.skill} ", OUTCOME_COLOURS[bar.outcome]), (f"{seconds:.0f} s", "dim"))

    def _states_worth_a_look(self) -> Iterable[Text]:
        """Resources in a state other than neutral."""
        for name, state in self._states.items():
            colour = self._colours.get(name, {}).get(state, "")
            if colour != NEUTRAL:
                yield Text.assemble((f"{name} ", "dim"), (state, colour))

    def _events(self, width: int, room: int) -> RenderableType:
        """Table of the latest events, as many as fit into `room` lines."""
        shown: deque[tuple[float, Text]] = deque()
        for t, text in reversed(self._lines):
            room -= len(text.wrap(self._console, width))
            if room < 0:
                break
            shown.appendleft((t, text))
        table = Table.grid(padding=(0, 1, 0, 0))
        table.add_column(width=TIME_WIDTH - 1, justify="right", style="dim", no_wrap=True)
        table.add_column(width=width)
        for t, text in shown:
            table.add_row(f"{t:.1f} s", text)
        return table


def _lines_of(chips: Sequence[Text], width: int) -> list[Text]:
    """Lines of chips, broken only between chips."""
    lines: list[Text] = []
    for chip in chips:
        if lines and lines[-1].cell_len + len(GAP) + chip.cell_len <= width:
            lines[-1].append(GAP).append_text(chip)
        else:
            lines.append(chip)
    return lines


def _complete(path: Path, recorded: Sequence[M], seen: Iterable[M]) -> None:
    """Append missing messages to a file of the recorder."""
    missing = [message for message in seen if message not in recorded]
    if not missing:
        return
    with JsonLines[Message](path) as file:
        for message in missing:
            file.write(message)
