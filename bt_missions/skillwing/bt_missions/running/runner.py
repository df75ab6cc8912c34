"""Process of one mission: `MissionNode` ticks the run after each change, and serves the operator's requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from skillwing.bt_missions.checking.mission_check import draft_and_check
from skillwing.bt_missions.leaves.context import MissionContext, MissionNotes
from skillwing.bt_missions.leaves.robot_group import RobotGroup
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import Mission, MissionOptions
from skillwing.bt_missions.mission.robots import RobotModel, occupied
from skillwing.bt_missions.running.link_wait import LinkWait
from skillwing.bt_missions.running.mission_run import MissionRun
from skillwing.bt_missions.running.operator_requests import serve_operator_requests
from skillwing.bt_missions.running.publisher import MissionPublisher
from skillwing.bt_missions.running.robot_presence import RobotPresence
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.names import MISSION
from skillwing.services.options import required
from skillwing.services.protocol import AbortMission, Keys, MissionStatus, PauseMission, ResumeMission, TreeSnapshot
from skillwing.services.rescue_goal import RescueGoal

TICK_PERIOD = 0.2
"""Longest time between two ticks, in seconds of robot time; after a change a tick follows at once."""
_OF_THE_PROCESS = ("mission", "skillset", "rescue_goal", "ready_timeout")
"""Options of the process; all others are the mission's."""
READY_TIMEOUT = 30.0
"""Longest wait for the robot to get ready, in seconds of wall time."""
AWAY_TIMEOUT = 3.0
"""Wait before giving up for a robot away from its rescue goal that nobody commands, in seconds of wall time. It may be
about to get there."""


def make_mission(options: dict[str, Any]) -> MissionNode:
    """A node that runs one mission.

    options: "mission" (name or file), "skillset" (path of the file), optionally "rescue_goal" (of the robot, as a
    mapping) and "ready_timeout" (seconds of wall time). All others are options of the mission.
    Raises UnknownNameError, InvalidOptionError or SkillsetError.
    """
    mission = find_mission(required(options, "mission"))
    skillset = load(Path(required(options, "skillset")))
    own = {name: value for name, value in options.items() if name not in _OF_THE_PROCESS}
    timeout = options.get("ready_timeout", READY_TIMEOUT)
    if not isinstance(timeout, (int, float)):
        raise InvalidOptionError("ready_timeout", f"`ready_timeout` is {timeout!r}; give a number of seconds.")
    goal = msgspec.convert(options.get("rescue_goal"), RescueGoal | None)
    return MissionNode(mission, skillset, mission.read_options(own), rescue_goal=goal, ready_timeout=timeout)


class MissionNode:
    """Runs `mission` on the robot with this `skillset` and this rescue goal, or on several robots: `on_robots`.

    `status` is the latest MissionStatus, which also goes to `on_status`. It is the final one when `over` is True.
    Then every goal has ended, or had its time to end, unless the system was stopped.

    owner_grace: wall time in seconds for which the mission's goals run on without its link to the robot. ends_process:
    the bus is closed at the end. request_id: of the request for a mission on board.
    """

    name = MISSION
    owns_clock = False

    def __init__(
        self,
        mission: Mission,
        skillset: Skillset,
        options: MissionOptions,
        *,
        rescue_goal: RescueGoal | None = None,
        ready_timeout: float = READY_TIMEOUT,
        owner_grace: float = 0.0,
        ends_process: bool = False,
        on_status: Callable[[MissionStatus], None] = lambda status: None,
        request_id: str = "",
    ) -> None:
        robots = {"": RobotModel(skillset, rescue_goal)}
        self._set_up(mission, robots, options, ready_timeout, owner_grace, ends_process, on_status, request_id)

    @classmethod
    def on_robots(
        cls,
        mission: Mission,
        robots: Mapping[str, RobotModel],
        options: MissionOptions,
        *,
        ready_timeout: float = READY_TIMEOUT,
        owner_grace: float = 0.0,
        on_status: Callable[[MissionStatus], None] = lambda status: None,
        request_id: str = "",
    ) -> MissionNode:
        """A node for a mission on several robots, by name. It is attached by `attach_to`."""
        node = cls.__new__(cls)
        node._set_up(mission, robots, options, ready_timeout, owner_grace, False, on_status, request_id)
        return node

    def _set_up(
        self,
        mission: Mission,
        robots: Mapping[str, RobotModel],
        options: MissionOptions,
        ready_timeout: float,
        owner_grace: float,
        ends_process: bool,
        on_status: Callable[[MissionStatus], None],
        request_id: str,
    ) -> None:
        self.mission = mission
        self._robots = dict(robots)
        self._keys = {name: Keys(model.skillset.name) for name, model in robots.items()}
        self._options = options
        self._ready_timeout = ready_timeout
        self._owner_grace = owner_grace
        self._ends_process = ends_process
        self._on_status = on_status
        self._occupied = occupied(robots)
        self._publisher = MissionPublisher(mission.name, self._keys, self._occupied, self._take_status, request_id)
        self._awake = False

    @property
    def status(self) -> MissionStatus:
        return self._publisher.status

    @property
    def over(self) -> bool:
        return self.status.phase.over

    @property
    def tree_shows_end(self) -> bool:
        """True if the tree shows why the mission ended."""
        return self._run.tree_shows_end

    @property
    def rescue_action(self) -> str | None:
        """Noun for what an abort does after it has interrupted the goals, such as `lowering`; None for nothing."""
        return self._run.rescue_action

    @property
    def snapshot(self) -> TreeSnapshot:
        """The latest tree that was published; at the end, the tree before its halt."""
        return self._publisher.snapshot

    def attach(self, bus: Bus) -> None:
        self.attach_to({"": bus})

    def attach_to(self, buses: Mapping[str, Bus]) -> None:
        """Attach the node to each of its robots. All buses have one thread: that of the first one."""
        self._buses = dict(buses)
        self._bus = next(iter(buses.values()))
        self._publisher.attach(buses)
        grace = self._owner_grace
        interfaces = {
            name: SkillsetInterface(
                *(bus, self._robots[name].skillset), client=self.name, owns_goals=True, owner_grace=grace
            )
            for name, bus in buses.items()
        }
        context = self._context(interfaces)
        trees, problems = draft_and_check(self.mission, context, self._options)
        link = LinkWait(self._bus, self._owner_grace, self._is_connected)
        self._run = MissionRun(tuple(buses.values()), self.mission, trees, context, self._publisher, self._wake, link)
        for name, bus in buses.items():
            self._run.cancel_at_end(*self._declared(name, bus, interfaces[name], context.robots[name]))
        self._run.cancel_at_end(
            self._bus.after(AWAY_TIMEOUT, self._run.give_up_away, wall=True),
            self._bus.after(self._ready_timeout, lambda: self._run.give_up_waiting(self._ready_timeout), wall=True),
        )
        if problems:
            listed = "".join(f"\n  {problem}" for problem in problems)
            self._run.give_up(f"The mission does not fit this robot:{listed}")
        self._wake()

    def _is_connected(self) -> bool:
        """False while none of the robots can be heard, as without the router that they share."""
        return any(bus.connected for bus in self._buses.values())

    def _context(self, interfaces: Mapping[str, SkillsetInterface]) -> MissionContext:
        notes = MissionNotes()
        contexts = {
            name: MissionContext(
                interfaces[name],
                model.skillset,
                self._buses[name].now,
                self._publisher.writer(name),
                model.rescue_goal,
                robot=name,
                notes=notes,
            )
            for name, model in self._robots.items()
        }
        return contexts.get("") or RobotGroup(contexts, notes, self._publisher.records)

    def _declared(
        self, name: str, bus: Bus, interface: SkillsetInterface, context: MissionContext
    ) -> tuple[Handle, ...]:
        """Declarations and timers at one robot, until the end of the run."""
        presence = (RobotPresence(bus, self._keys[name], context, self._wake, self._is_connected),) if name else ()
        return (
            # A timer in robot time fires only once that time is known.
            bus.after(0.0, lambda: self._run.time_is_known(name)),
            interface.on_change(self._wake),
            bus.every(TICK_PERIOD, self._wake),
            *(self._declared_as_its_mission(name, bus) if name in self._occupied else ()),
            *presence,
        )

    def _declared_as_its_mission(self, name: str, bus: Bus) -> tuple[Handle, ...]:
        requests = serve_operator_requests(bus, self._keys[name], self)
        return (*requests, bus.declare_alive(self._keys[name].alive(self.name)))

    def detach(self) -> None:
        """Interrupt what still runs and publish the end of the mission, without waiting for replies."""
        self._run.stop()

    def abort(self, reason: str = AbortMission().reason) -> str | None:
        """Interrupt everything, rescue the robot, and end as ABORTED. A second call has no effect."""
        self._run.abort(reason)
        return None

    def pause(self, reason: str = PauseMission().reason) -> str | None:
        """Hold the mission until `resume`. Returns a sentence if that is not possible."""
        return self._run.pause(reason)

    def resume(self, reason: str = ResumeMission().reason) -> str | None:
        """Continue where the mission was paused. Returns a sentence if that is not possible."""
        return self._run.resume(reason)

    def system_stopped(self) -> None:
        """End at once: the system was stopped, so that nothing can be interrupted."""
        self._run.system_stopped()

    def _take_status(self, status: MissionStatus) -> None:
        self._on_status(status)
        if status.phase.over and self._ends_process:
            self._bus.post(self._bus.close)

    def _wake(self) -> None:
        """Tick soon, once for all changes that arrive together."""
        if not self._awake and not self.over:
            self._awake = True
            self._bus.post(self._tick)

    def _tick(self) -> None:
        self._awake = False
        self._run.tick()
