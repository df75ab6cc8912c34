"""The process that flies one mission: it ticks the tree when something changes, and tells what the tree does.

A run goes through its stages in this order: WAITING until the robot is ready, FLYING the tree, LOOKING where the drone
is once that has ended, RESCUING it if the tree could not go on or has ended in the air, SETTLING until every goal of
the mission is over, OVER.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import CALM, MissionContext
from skillwing.bt_missions.leaves.flying import FLIGHT_STATUS, IN_AIR
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.running.landing_gear import LandingGear
from skillwing.bt_missions.running.library import find_mission
from skillwing.bt_missions.running.mission import Mission, MissionOptions
from skillwing.bt_missions.running.orders import serve_orders
from skillwing.bt_missions.running.phase import Phase
from skillwing.bt_missions.running.rehearsal import drafted
from skillwing.bt_missions.running.standing import Holders, Standing
from skillwing.bt_missions.running.still_clock import STILL_CLOCK_TIMEOUT, StillClock
from skillwing.bt_missions.running.tree_text import TreePortrait
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle, Publisher
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidOptionError
from skillwing.services.options import required
from skillwing.services.protocol import (
    AbortMission,
    Keys,
    MissionStatus,
    PauseMission,
    RecordKind,
    ResumeMission,
    TreeSnapshot,
    encode,
)
from skillwing.services.timeline import Timeline

TICK_PERIOD = 0.2
"""Longest time between two ticks, in seconds of robot time; changes tick at once."""
SETTLED_TICK = 0.01
"""A tick that changed something is followed by another one, after so many seconds of robot time."""
READY_TIMEOUT = 30.0
"""How long to wait for the robot to get ready, in seconds of wall time."""
LANDING_TIMEOUT = 3.0
"""How long to wait for a drone in the air that nobody flies, which may just have landed, in seconds of wall time."""
SETTLE_TIMEOUT = 15.0
"""How long to wait at the end for goals that do not stop, in seconds of wall time."""


class Stage(StrEnum):
    WAITING = "waiting"
    FLYING = "flying"
    LOOKING = "looking"
    RESCUING = "rescuing"
    SETTLING = "settling"
    OVER = "over"


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

    `status` is the latest MissionStatus; `over` tells that it is the last one and every goal has ended. on_status:
    called with each of them.
    """

    name = "mission"
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
        self.status = MissionStatus(mission=mission.name, phase=Phase.IDLE, t=0.0, text="not started")
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._options = options
        self._ready_timeout = ready_timeout
        self._on_status = on_status
        self._stage = Stage.WAITING
        self._outcome = Phase.IDLE, ""
        self._abort_reason: str | None = None
        self._knows_time = False
        self._awake = False
        self._has_flown = False
        self._system_is_there = True
        self._ended_at = 0.0
        self._handles: list[Handle] = []
        self._clock_watch: StillClock | None = None

    @property
    def over(self) -> bool:
        return self._stage is Stage.OVER

    @property
    def tree_tells(self) -> bool:
        """Whether the tree shows why the mission ended: it was flown, and the robot was there to its end."""
        return self._has_flown and self._system_is_there

    @property
    def snapshot(self) -> TreeSnapshot:
        """The tree as it was told last; at the end, as it was before it was halted."""
        return TreeSnapshot(mission=self.mission.name, t=self._bus.now(), nodes=self._portrait.nodes)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._timeline = Timeline(bus, self._keys)
        self._interface = SkillsetInterface(bus, self._skillset, client=self.name, owns_goals=True)
        self._context = MissionContext(self._interface, self._skillset, bus.now, self._write_record)
        self._landing_gear = LandingGear(self._interface, self._skillset)
        self._trees, misfits = drafted(self.mission, self._context, self._options)
        self._show(self._trees.root)
        self._status_out: Publisher = bus.advertise(self._keys.mission_status, events=True)
        self._tree_out: Publisher = bus.advertise(self._keys.mission_tree, events=True)
        self._handles = [
            # A timer of robot time: it runs once that is known.
            bus.after(0.0, self._learn_time),
            *serve_orders(bus, self._keys, self),
            self._interface.on_change(self._wake),
            bus.every(TICK_PERIOD, self._wake),
            bus.after(LANDING_TIMEOUT, self._give_up_in_air, wall=True),
            bus.after(self._ready_timeout, self._give_up_waiting, wall=True),
            bus.declare_alive(self._keys.alive(self.name)),
        ]
        if misfits:
            told = "".join(f"\n  {misfit}" for misfit in misfits)
            self._end(Phase.FAILED, f"The mission does not fit this robot:{told}", rescue=False)
        self._wake()

    def detach(self) -> None:
        """Interrupt what still runs and say that the mission is over; nobody will wait for the answers."""
        if not self.over:
            self._end(Phase.ABORTED, self._abort_reason or "the mission's process was stopped", rescue=False)
            self._finish()

    def abort(self, reason: str = AbortMission().reason) -> str | None:
        """Interrupt everything, land, and end as ABORTED. Repeating it, or calling it at the end, changes nothing."""
        if self._stage in (Stage.WAITING, Stage.FLYING):
            self._abort_reason = reason
            self._end(Phase.ABORTED, reason, rescue=self._stage is Stage.FLYING)
            self._tell_abort()
            self._wake()
        return None

    def pause(self, reason: str = PauseMission().reason) -> str | None:
        """Stop the motion and hold the place until `resume`. Returns a sentence that says what is against it.

        Guards go on guarding: they may bring the drone home, or down, all the same.
        """
        if self._stage is not Stage.FLYING:
            return f"The mission is {self._stage}; only a flight can be paused."
        against = self._holders.pause(reason)
        if against is None:
            self._tell_standing()
            self._wake()
        return against

    def resume(self, reason: str = ResumeMission().reason) -> str | None:
        """Go on where the flight was paused. Returns a sentence that says what is against it."""
        against = self._holders.resume()
        if against is None:
            self._tell_standing(reason)
            self._wake()
        return against

    def leave(self) -> None:
        """End at once: the system was stopped, and nobody is there to stop or to land anything."""
        if self.over:
            return
        phase, before = self._outcome
        where = ", with the drone in the air" if self._landing_gear.is_in_air else ""
        after = f"; before that: {before}" if before else ""
        self._system_is_there = False
        self._stop_tree(
            Phase.ABORTED if phase is Phase.IDLE else phase, f"the system was stopped under it{where}{after}"
        )
        self._conclude(*self._outcome)

    # --- ticking ---------------------------------------------------------------------------------------------------

    def _wake(self) -> None:
        """Tick soon; any number of changes that arrive together are one tick."""
        if not self._awake and not self.over:
            self._awake = True
            self._bus.post(self._tick)

    def _learn_time(self) -> None:
        self._knows_time = True
        self._wake()

    def _tick(self) -> None:
        self._awake = False
        match self._stage:
            case Stage.WAITING:
                self._take_off_when_ready()
            case Stage.FLYING:
                self._fly()
            case Stage.LOOKING:
                self._look()
            case Stage.RESCUING:
                self._rescue()
            case Stage.SETTLING | Stage.OVER:
                pass
        if self._stage is Stage.SETTLING and not self._context.reaper.unfinished:
            self._finish()
        if self._stage in (Stage.FLYING, Stage.RESCUING) and self._publish_tree():
            self._publish_progress()
            # What one tick changed (the end of a round, say) the next one may go on from.
            self._bus.after(SETTLED_TICK, self._wake)

    def _take_off_when_ready(self) -> None:
        missing = self._missing()
        if not missing:
            self._stage = Stage.FLYING
            self._has_flown = True
            self._landing_gear.begin()
            self._enter(Phase.RUNNING, "the robot is ready")
            self._clock_watch = StillClock(self._bus, self._give_up_for_clock)
            self._fly()
        elif self.status.text != missing:
            self._publish_status(Phase.IDLE, missing)

    def _missing(self) -> str:
        """What the robot still lacks for this mission, or an empty text."""
        if not self._interface.ready:
            return "waiting for the resource manager"
        if not self._knows_time:
            return "waiting for the robot's clock"
        states = self._interface.states
        lacks = [
            f"{resource} is {states.get(resource, 'not known')} instead of {' or '.join(wanted)}"
            for resource, wanted in self.mission.needs.items()
            if states.get(resource) not in wanted
        ]
        return "waiting: " + "; ".join(lacks) if lacks else ""

    def _give_up_in_air(self) -> None:
        """Nobody brings down a drone that nobody flies, so there is nothing to wait for."""
        wanted = self.mission.needs.get(FLIGHT_STATUS, (IN_AIR,))
        if self._stage is Stage.WAITING and IN_AIR not in wanted and self._landing_gear.nobody_flies:
            text = "The drone is in the air already, and nobody flies it. Land it with `skillwing start land`."
            self._end(Phase.FAILED, text, rescue=False)
            self._wake()

    def _give_up_waiting(self) -> None:
        if self._stage is Stage.WAITING:
            text = f"The robot did not get ready within {self._ready_timeout:g} s ({self._missing()})."
            self._end(Phase.FAILED, text, rescue=False)
            self._wake()

    def _fly(self) -> None:
        status = self._tick_tree(self._trees.root)
        if status is Status.SUCCESS:
            self._land(Phase.SUCCEEDED, self._trees.progress().text or "done")
        elif status is Status.FAILURE:
            self._land(Phase.FAILED, self._why())

    def _rescue(self) -> None:
        status = self._tick_tree(self._trees.rescue)
        if status in (Status.SUCCESS, Status.FAILURE):
            phase, text = self._outcome
            landed = "the drone is on the ground" if status is Status.SUCCESS else f"no landing: {self._why()}"
            self._end(phase, f"{text}; {landed}", rescue=False)

    def _tick_tree(self, tree: Behaviour) -> Status:
        """Tick once. If a leaf of the mission raises, the drone is brought down by the other tree."""
        try:
            tree.tick_once()
        except Exception as error:  # noqa: BLE001 - whatever a leaf raises, the drone is still in the air
            text = f"the tree raised {type(error).__name__}: {error}"
            if self._stage is Stage.RESCUING:
                phase, reason = self._outcome
                self._end(phase, f"{reason}; while landing {text}", rescue=False)
            else:
                self._end(Phase.FAILED, text, rescue=True)
            return Status.INVALID
        return tree.status

    def _why(self) -> str:
        """What made the mission fail: why the tree went over to its last branch, and what failed after that."""
        reasons = [switch.reason for switch in self._context.switches if switch.subject == "mission"]
        if self._context.failure is not None:
            reasons.append(self._context.failure.text)
        return "; then ".join(dict.fromkeys(reasons)) or "the tree failed"

    # --- the end ---------------------------------------------------------------------------------------------------

    def _end(self, phase: Phase, text: str, *, rescue: bool) -> None:
        """Halt the tree. Then bring the drone down with `rescue`, or wait for the goals to stop."""
        self._stop_tree(phase, text)
        self._begin_rescue() if rescue else self._settle()

    def _land(self, phase: Phase, text: str) -> None:
        """The tree has come to its end; whoever ended it in the air does not leave the drone there."""
        self._stop_tree(phase, text)
        self._stage = Stage.LOOKING
        self._ended_at = self._bus.now()
        self._look()

    def _look(self) -> None:
        """The landing's end may be known before the landing gear tells of it; an end in the air stays one."""
        if not self._landing_gear.leaves_drone_in_air:
            self._settle()
        elif self._bus.now() - self._ended_at >= CALM:
            phase, text = self._outcome
            self._outcome = phase, f"{text}; it ended in the air"
            self._begin_rescue()

    def _stop_tree(self, phase: Phase, text: str) -> None:
        self._outcome = phase, text
        self._publish_tree()  # the last picture of it, before halting wipes its statuses
        self._halt()

    def _begin_rescue(self) -> None:
        self._stage = Stage.RESCUING
        self._show(self._trees.rescue)

    def _settle(self) -> None:
        self._stage = Stage.SETTLING
        self._handles.append(self._bus.after(SETTLE_TIMEOUT, self._finish, wall=True))

    def _halt(self) -> None:
        try:
            self._tree.stop(Status.INVALID)
        except Exception as error:  # noqa: BLE001 - the goals have to be interrupted all the same
            phase, text = self._outcome
            self._outcome = phase, f"{text}; halting the tree raised {type(error).__name__}: {error}"
        self._context.cancel_everything()

    def _finish(self) -> None:
        """Everything has stopped, or had time enough to."""
        if self.over:
            return
        phase, text = self._outcome
        running = self._context.reaper.unfinished
        if running:
            text = f"{text}; these did not stop: " + ", ".join(sorted({goal.skill for goal in running}))
        self._conclude(phase, text)

    def _conclude(self, phase: Phase, text: str) -> None:
        self._stage = Stage.OVER
        self._enter(phase, text)
        for handle in (*self._handles, self._clock_watch):
            if handle is not None:
                handle.cancel()

    def _give_up_for_clock(self) -> None:
        if self._stage in (Stage.FLYING, Stage.LOOKING, Stage.RESCUING):
            before = f"{self._why()}; then " if self._context.failure else ""
            self._end(Phase.FAILED, f"{before}robot time stands still for {STILL_CLOCK_TIMEOUT:g} s", rescue=False)
            self._wake()

    # --- telling ---------------------------------------------------------------------------------------------------

    def _tell_standing(self, reason: str = "") -> Standing:
        """Tell when the flight is held or goes on; what is done next is done for that."""
        standing = self._holders.standing
        if standing.phase != self.status.phase:
            told = reason or standing.reason or self._context.last_news
            self._context.learn(told, self._enter(standing.phase, told, standing.cause))
        return standing

    def _enter(self, phase: Phase, text: str, cause: str | None = None) -> str:
        if phase is Phase.FAILED and self._context.failure is not None:
            cause = self._context.failure.record
        record = self._write_record(self.mission.name, self.status.phase, phase, text, cause)
        self._publish_status(phase, text)
        return record

    def _write_record(self, subject: str, before: str | None, after: str, text: str, cause: str | None) -> str:
        return self._timeline.record(RecordKind.MISSION, subject, before, after, text=text, cause=cause)

    def _tell_abort(self) -> None:
        """At once: whoever asked is answered with it."""
        if self._stage is Stage.RESCUING:
            self._publish_status(Phase.RUNNING, self._rescue_text)
        else:
            self._publish_status(Phase.IDLE, self._outcome[1])

    @property
    def _rescue_text(self) -> str:
        return f"{self._outcome[1]}; landing"

    def _publish_progress(self) -> None:
        running = [leaf.name for leaf in self._tree.iterate() if _is_flying(leaf)]
        text = ", ".join(running) or "deciding"
        if self._stage is Stage.RESCUING:
            text = self._rescue_text
        progress = self._trees.progress()
        phase = Phase.RUNNING
        if self._stage is Stage.FLYING:
            phase, reason, _ = self._tell_standing()
            text = reason or text
        if (text, progress.waypoint, progress.goal) != (self.status.text, self.status.waypoint, self.status.goal):
            self._publish_status(phase, text)

    def _publish_status(self, phase: Phase, text: str) -> None:
        progress = self._trees.progress()
        self.status = MissionStatus(
            mission=self.mission.name,
            phase=phase,
            t=self._bus.now(),
            text=text,
            waypoint=progress.waypoint,
            waypoints=progress.waypoints,
            goal=progress.goal,
        )
        self._status_out.put(encode(self.status))
        self._on_status(self.status)

    def _show(self, tree: Behaviour) -> None:
        """This tree is flown from now on: the mission's own, or the one that brings the drone to safety."""
        self._tree = tree
        self._portrait = TreePortrait(tree)
        self._holders = Holders(tree, self._interface)

    def _publish_tree(self) -> bool:
        """Publish the tree if it has changed; tells whether it has."""
        if not self._portrait.update():
            return False
        self._tree_out.put(encode(self.snapshot))
        return True


def _is_flying(leaf: Behaviour) -> bool:
    return isinstance(leaf, SkillAction) and leaf.status is Status.RUNNING
