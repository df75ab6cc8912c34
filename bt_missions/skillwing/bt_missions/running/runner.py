"""The process that flies one mission: it ticks the flight when something changes, and takes orders for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from skillwing.bt_missions.checking.rehearsal import drafted
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.running.announcer import Announcer
from skillwing.bt_missions.running.flight import Flight
from skillwing.bt_missions.running.library import find_mission
from skillwing.bt_missions.running.mission import Mission, MissionOptions
from skillwing.bt_missions.running.orders import serve_orders
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.names import MISSION
from skillwing.services.options import required
from skillwing.services.protocol import AbortMission, Keys, MissionStatus, PauseMission, ResumeMission, TreeSnapshot

TICK_PERIOD = 0.2
"""Longest time between two ticks, in seconds of robot time; changes tick at once."""
READY_TIMEOUT = 30.0
"""How long to wait for the robot to get ready, in seconds of wall time."""
LANDING_TIMEOUT = 3.0
"""How long to wait for a drone in the air that nobody flies, which may just have landed, in seconds of wall time."""


def make_mission(options: dict[str, Any]) -> MissionNode:
    """A node that flies one mission of the library.

    options: "mission" (its name), "skillset" (path of the file), optionally "ready_timeout" (wall seconds); all others
    are the mission's own. Raises UnknownNameError, InvalidOptionError or SkillsetError.
    """
    mission = find_mission(required(options, "mission"))
    skillset = load(Path(required(options, "skillset")))
    own = {name: value for name, value in options.items() if name not in ("mission", "skillset", "ready_timeout")}
    timeout = options.get("ready_timeout", READY_TIMEOUT)
    if not isinstance(timeout, (int, float)):
        raise InvalidOptionError("ready_timeout", f"`ready_timeout` is {timeout!r}; give a number of seconds.")
    return MissionNode(mission, skillset, mission.read_options(own), ready_timeout=timeout)


class MissionNode:
    """Flies `mission` on the robot whose managers speak `skillset`.

    `status` is the latest MissionStatus; `over` tells that it is the last one. Then every goal has ended, or had its
    time to, unless the system was stopped. on_status: called with each of them.
    """

    name = MISSION
    owns_clock = False

    def __init__(
        self,
        mission: Mission,
        skillset: Skillset,
        options: MissionOptions,
        *,
        ready_timeout: float = READY_TIMEOUT,
        on_status: Callable[[MissionStatus], None] = lambda status: None,
    ) -> None:
        self.mission = mission
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._options = options
        self._ready_timeout = ready_timeout
        self._announcer = Announcer(mission.name, self._keys, on_status)
        self._awake = False

    @property
    def status(self) -> MissionStatus:
        return self._announcer.status

    @property
    def over(self) -> bool:
        return self.status.phase.over

    @property
    def tree_tells(self) -> bool:
        """Whether the tree shows why the mission ended."""
        return self._flight.tree_tells

    @property
    def snapshot(self) -> TreeSnapshot:
        """The tree as it was told last; at the end, as it was before it was halted."""
        return self._announcer.snapshot

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._announcer.attach(bus)
        interface = SkillsetInterface(bus, self._skillset, client=self.name, owns_goals=True)
        context = MissionContext(interface, self._skillset, bus.now, self._announcer.record)
        trees, misfits = drafted(self.mission, context, self._options)
        self._flight = Flight(bus, self.mission, trees, context, self._announcer, self._wake)
        self._flight.until_over(
            # A timer of robot time: it runs once that is known.
            bus.after(0.0, self._flight.learn_time),
            *serve_orders(bus, self._keys, self),
            interface.on_change(self._wake),
            bus.every(TICK_PERIOD, self._wake),
            bus.after(LANDING_TIMEOUT, self._flight.give_up_in_air, wall=True),
            bus.after(self._ready_timeout, lambda: self._flight.give_up_waiting(self._ready_timeout), wall=True),
            bus.declare_alive(self._keys.alive(self.name)),
        )
        if misfits:
            told = "".join(f"\n  {misfit}" for misfit in misfits)
            self._flight.give_up(f"The mission does not fit this robot:{told}")
        self._wake()

    def detach(self) -> None:
        """Interrupt what still runs and say that the mission is over; nobody will wait for the answers."""
        self._flight.stop()

    def abort(self, reason: str = AbortMission().reason) -> str | None:
        """Interrupt everything, land, and end as ABORTED. Repeating it, or calling it at the end, changes nothing."""
        self._flight.abort(reason)
        return None

    def pause(self, reason: str = PauseMission().reason) -> str | None:
        """Stop the motion and hold the place until `resume`. Returns a sentence that says what is against it."""
        return self._flight.pause(reason)

    def resume(self, reason: str = ResumeMission().reason) -> str | None:
        """Go on where the flight was paused. Returns a sentence that says what is against it."""
        return self._flight.resume(reason)

    def leave(self) -> None:
        """End at once: the system was stopped, and nobody is there to stop or to land anything."""
        self._flight.leave()

    def _wake(self) -> None:
        """Tick soon; any number of changes that arrive together are one tick."""
        if not self._awake and not self.over:
            self._awake = True
            self._bus.post(self._tick)

    def _tick(self) -> None:
        self._awake = False
        self._flight.tick()
