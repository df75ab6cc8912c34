"""Active work, which the end of a system cuts short: a mission, goals, and a robot away from its rescue goal."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.names import MISSION
from skillwing.services.protocol import GoalStatus, Keys, MissionPhase, MissionStatus, Record
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.terminal.live_state import LiveState

SIMULATED = "It was simulated, and is gone with its simulator."
REAL = "Nobody commands it any more."


class ActiveWork:
    """Follows goals and missions on the bus. `text` may be read on any thread.

    robot: its name. rescue_goal: as in its table. simulated: the robot ends with its processes.
    """

    def __init__(self, robot: str, skillset: Skillset, rescue_goal: RescueGoal | None, *, simulated: bool) -> None:
        self._robot = robot
        self._skillset = skillset
        self._rescue_goal = rescue_goal
        self._fate = SIMULATED if simulated else REAL
        self._live_state = LiveState()
        self._mission: str | None = None
        self._last_text = ""
        self._on_change: Callable[[], None] = lambda: None

    def attach(self, bus: Bus, on_change: Callable[[], None]) -> None:
        """on_change: called by the bus after each change of `text`."""
        self._on_change = on_change
        keys = Keys(self._skillset.name)
        follow_records(bus, keys, self._on_record, self._on_status)
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_mission), events=True)
        bus.watch_alive(keys.alive(MISSION), self._on_alive)

    @property
    def text(self) -> str:
        """`Cut short: mission patrol, goto. crane was under load. ...`; empty without active work."""
        live = self._live_state
        running = [skill.name for skill in self._skillset.skills if live.skill(skill.name).goal_id is not None]
        cut_short = [*([] if self._mission is None else [f"mission {self._mission}"]), *running]
        warnings = [f"{self._robot} was {self._where}."] if self._where else []
        sentences = [f"Cut short: {', '.join(cut_short)}."] if cut_short else []
        return " ".join([*sentences, *warnings, *([self._fate] if warnings else [])])

    @property
    def _where(self) -> str:
        """Words for the place of a robot that is away from its rescue goal; empty at the goal."""
        goal = self._rescue_goal
        return "" if goal is None else goal.away.get(self._live_state.changed_to(goal.resource) or "", "")

    def _on_record(self, record: Record) -> None:
        self._live_state.add_record(record)
        self._notify()

    def _on_status(self, status: GoalStatus) -> None:
        self._live_state.add_status(status)
        self._notify()

    def _on_mission(self, status: MissionStatus) -> None:
        self._mission = None if status.phase.over or status.phase is MissionPhase.IDLE else status.mission
        self._notify()

    def _on_alive(self, _key: str, alive: bool) -> None:
        if not alive:
            self._mission = None
            self._notify()

    def _notify(self) -> None:
        if self.text != self._last_text:
            self._last_text = self.text
            self._on_change()
