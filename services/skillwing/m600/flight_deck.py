"""The demo in the terminal: what the drone does, why, and what has happened so far.

On a terminal one panel is kept up to date; in a pipe each event is a line.
"""

from __future__ import annotations

from collections import deque
from types import TracebackType
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.protocol import GoalStatus, Keys, MissionStatus, Record, RecordKind
from skillwing.services.telemetry.history import History, Outcome, SkillBar, is_switch
from skillwing.services.telemetry.palette import OUTCOME_COLOURS
from skillwing.services.telemetry.reading import message_reader
from skillwing.services.telemetry.wording import brief, in_words

REFRESH = 0.25
"""Wall seconds between two pictures of the panel."""
LINES = 8
TOLD = frozenset({RecordKind.HEALTH, RecordKind.FAULT, RecordKind.MISSION, RecordKind.PROCESS})
"""Records worth a line of their own; goals are told from their bars, and resources follow from both."""
QUIET = frozenset({"rotate_head", "lock_head"})
"""Skills that turn the nose between two legs: they are in the timeline, and would bury everything else here."""


class FlightDeck:
    """Follows a flight on the bus and shows it. `mission` is the mission's latest word, None before the first."""

    def __init__(self, bus: Bus, skillset: Skillset, console: Console, title: str) -> None:
        self.mission: MissionStatus | None = None
        self._bus = bus
        self._console = console
        self._title = title
        self._history = History({resource.name: resource.initial for resource in skillset.resources})
        self._told: deque[Text] = deque(maxlen=LINES)
        self._live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None
        keys = Keys(skillset.name)
        bus.subscribe(keys.timeline, message_reader(Record, self._on_record), events=True)
        bus.subscribe(keys.status("*"), message_reader(GoalStatus, self._on_goal), events=True)
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
            self._live.stop()

    def tell(self, text: str, style: str = "") -> None:
        """Add an event. Call it on the bus's thread."""
        line = Text.assemble((f"{self._bus.now():7.1f} s  ", "dim"), (text, style))
        self._told.append(line)
        if self._live is None:
            self._console.print(line)

    # --- what comes in -----------------------------------------------------------------------------------------------

    def _on_mission(self, status: MissionStatus) -> None:
        self.mission = status

    def _on_record(self, record: Record) -> None:
        if not self._history.add_record(record):
            return
        if is_switch(record):
            self.tell(
                f"{record.before} -> {record.after}  because  {in_words(self._history.chain(record.cause))}", "bold"
            )
        elif record.kind in TOLD:
            self.tell(brief(record))

    def _on_goal(self, status: GoalStatus) -> None:
        if not self._history.add_status(status) or status.terminal is None or status.skill in QUIET:
            return
        bar = self._history.bar(status.goal_id)
        self.tell(f"{bar.skill} {bar.terminal}  {bar.reason}", OUTCOME_COLOURS[bar.outcome])

    # --- what is shown -----------------------------------------------------------------------------------------------

    def _refresh(self) -> None:
        assert self._live is not None
        self._live.update(self._panel(), refresh=True)
        self._bus.after(REFRESH, self._refresh, wall=True)

    def _panel(self) -> RenderableType:
        status = self.mission
        head = Text.assemble((self._title, "bold"), f"   {self._bus.now():.1f} s   ")
        if status is None:
            head.append("starting")
        else:
            head.append(f"waypoint {min(status.waypoint + 1, status.waypoints)} of {status.waypoints}   {status.text}")
        table = Table.grid(padding=(0, 3))
        table.add_row(*(self._bar_text(bar) for bar in self._history.bars if bar.outcome is Outcome.RUNNING))
        return Group(head, table, *self._told)

    def _bar_text(self, bar: SkillBar) -> Text:
        seconds = max(0.0, self._bus.now() - bar.t_start)
        return Text.assemble((f"{bar.skill} ", OUTCOME_COLOURS[bar.outcome]), (f"{seconds:.0f} s", "dim"))
