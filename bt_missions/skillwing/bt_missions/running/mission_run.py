"""One run of a mission's trees, from waiting for the robot to the mission's last word.

It goes through its stages in this order: WAITING until the robot is ready, FLYING the tree, LOOKING where the drone is
once that has ended, RESCUING it if the tree could not go on or has ended in the air, SETTLING until every goal of the
mission is over, OVER.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import SETTLE_TIME, MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.takeoff_and_landing import FLIGHT_STATUS, IN_AIR
from skillwing.bt_missions.mission.mission import Mission, MissionTrees
from skillwing.bt_missions.running.airborne_check import AirborneCheck
from skillwing.bt_missions.running.clock_watchdog import CLOCK_TIMEOUT, ClockWatchdog
from skillwing.bt_missions.running.pause_state import PauseControl, PauseState
from skillwing.bt_missions.running.phase import Phase
from skillwing.bt_missions.running.publisher import MissionPublisher
from skillwing.services.bus import Bus, Handle

SETTLED_TICK = 0.01
"""A tick that changed something is followed by another one, after so many seconds of robot time."""
SETTLE_TIMEOUT = 15.0
"""How long to wait at the end for goals that do not stop, in seconds of wall time."""


class RunStage(StrEnum):
    WAITING = "waiting"
    FLYING = "flying"
    LOOKING = "looking"
    RESCUING = "rescuing"
    SETTLING = "settling"
    OVER = "over"


class MissionRun:
    """Flies `trees` for `mission`. Has to be ticked whenever something may have changed, and asks for it with `wake`
    where it has changed something itself."""

    def __init__(
        self,
        bus: Bus,
        mission: Mission,
        trees: MissionTrees,
        context: MissionContext,
        publisher: MissionPublisher,
        wake: Callable[[], None],
    ) -> None:
        self._bus = bus
        self._mission = mission
        self._trees = trees
        self._context = context
        self._interface = context.interface
        self._publisher = publisher
        self._wake = wake
        self._airborne = AirborneCheck(context.interface, context.skillset)
        self._stage = RunStage.WAITING
        self._outcome = Phase.IDLE, ""
        self._abort_reason: str | None = None
        self._knows_time = False
        self._has_flown = False
        self._system_is_there = True
        self._ended_at = 0.0
        self._until_over: list[Handle] = []
        self._show(trees.root)

    @property
    def tree_shows_end(self) -> bool:
        """Whether the tree shows why the mission ended: it was flown, and the robot was there to its end."""
        return self._has_flown and self._system_is_there

    def cancel_at_end(self, *handles: Handle) -> None:
        """Cancel these when the run is over."""
        self._until_over += handles

    def time_is_known(self) -> None:
        """Robot time is known from now on."""
        self._knows_time = True
        self._wake()

    def tick(self) -> None:
        match self._stage:
            case RunStage.WAITING:
                self._take_off_when_ready()
            case RunStage.FLYING:
                self._fly()
            case RunStage.LOOKING:
                self._look()
            case RunStage.RESCUING:
                self._rescue()
            case RunStage.SETTLING | RunStage.OVER:
                pass
        if self._stage is RunStage.SETTLING and not self._context.reaper.unfinished:
            self._finish()
        if self._stage in (RunStage.FLYING, RunStage.RESCUING) and self._publisher.publish_tree():
            self._tell_progress()
            # What one tick changed (the end of a round, say) the next one may go on from.
            self._bus.after(SETTLED_TICK, self._wake)

    # --- what an operator wants

    def abort(self, reason: str) -> None:
        """Interrupt everything, land, and end as ABORTED. Repeating it, or calling it at the end, changes nothing."""
        if self._stage not in (RunStage.WAITING, RunStage.FLYING):
            return
        self._abort_reason = reason
        self._end(Phase.ABORTED, reason, rescue=self._stage is RunStage.FLYING)
        # At once: whoever asked is answered with it.
        if self._stage is RunStage.RESCUING:
            self._publisher.publish(Phase.RUNNING, self._rescue_text)
        else:
            self._publisher.publish(Phase.IDLE, self._outcome[1])
        self._wake()

    def pause(self, reason: str) -> str | None:
        """Stop the motion and hold the place until `resume`. Returns a sentence that says what is against it.

        Guards go on guarding: they may bring the drone home, or down, all the same.
        """
        if self._stage is not RunStage.FLYING:
            return f"The mission is {self._stage}; only a flight can be paused."
        against = self._pause.pause(reason)
        if against is None:
            self._publish_pause_state()
            self._wake()
        return against

    def resume(self, reason: str) -> str | None:
        """Go on where the flight was paused. Returns a sentence that says what is against it."""
        against = self._pause.resume()
        if against is None:
            self._publish_pause_state(reason)
            self._wake()
        return against

    # --- waiting for the robot

    def _take_off_when_ready(self) -> None:
        missing = self._missing()
        if not missing:
            self._stage = RunStage.FLYING
            self._has_flown = True
            self._airborne.begin()
            self._publisher.enter(Phase.RUNNING, "the robot is ready")
            self._until_over.append(ClockWatchdog(self._bus, self._give_up_for_clock))
            self._fly()
        elif self._publisher.status.text != missing:
            self._publisher.publish(Phase.IDLE, missing)

    def _missing(self) -> str:
        """What the robot still lacks for this mission, or an empty text."""
        if not self._interface.ready:
            return "waiting for the resource manager"
        if not self._knows_time:
            return "waiting for the robot's clock"
        states = self._interface.states
        lacks = [
            f"{resource} is {states.get(resource, 'not known')} instead of {' or '.join(wanted)}"
            for resource, wanted in self._mission.needs.items()
            if states.get(resource) not in wanted
        ]
        return "waiting: " + "; ".join(lacks) if lacks else ""

    def give_up_waiting(self, waited: float) -> None:
        """The robot has had so many seconds to get ready."""
        if self._stage is RunStage.WAITING:
            self.give_up(f"The robot did not get ready within {waited:g} s ({self._missing()}).")

    def give_up_in_air(self) -> None:
        """Nobody brings down a drone that nobody flies, so there is nothing to wait for."""
        wanted = self._mission.needs.get(FLIGHT_STATUS, (IN_AIR,))
        if self._stage is RunStage.WAITING and IN_AIR not in wanted and self._airborne.nobody_flies:
            self.give_up("The drone is in the air already, and nobody flies it. Land it with `skillwing start land`.")

    # --- flying

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
            self._end(phase, _joined(text, landed), rescue=False)

    def _tick_tree(self, tree: Behaviour) -> Status:
        """Tick once. If a leaf of the mission raises, the drone is brought down by the other tree."""
        try:
            tree.tick_once()
        except Exception as error:  # noqa: BLE001 - whatever a leaf raises, the drone is still in the air
            text = f"the tree raised {type(error).__name__}: {error}"
            if self._stage is RunStage.RESCUING:
                phase, reason = self._outcome
                self._end(phase, _joined(reason, f"while landing {text}"), rescue=False)
            else:
                self._end(Phase.FAILED, text, rescue=True)
            return Status.INVALID
        return tree.status

    def _why(self) -> str:
        """What made the mission fail: why the tree went over to its last branch, and what failed after that."""
        reasons = [switch.reason for switch in self._context.switches if switch.subject == "mission"]
        if self._context.failure is not None:
            reasons.append(self._context.failure.text)
        first, *later = dict.fromkeys(reasons) or ["the tree failed"]
        return _joined(first, *(f"then {reason}" for reason in later))

    def _show(self, tree: Behaviour) -> None:
        """This tree is flown from now on: the mission's own, or the one that brings the drone to safety."""
        self._tree = tree
        self._pause = PauseControl(tree, self._interface)
        self._publisher.show(tree, self._trees.progress)

    def _tell_progress(self) -> None:
        running = [leaf.name for leaf in self._tree.iterate() if _is_flying(leaf)]
        phase, text = Phase.RUNNING, ", ".join(running) or "deciding"
        if self._stage is RunStage.RESCUING:
            text = self._rescue_text
        else:
            phase, reason, _ = self._publish_pause_state()
            text = reason or text
        self._publisher.publish_news(phase, text)

    def _publish_pause_state(self, reason: str = "") -> PauseState:
        """Tell when the flight is held or goes on; what is done next is done for that."""
        standing = self._pause.state
        if standing.phase != self._publisher.status.phase:
            told = reason or standing.reason or self._context.last_observation
            self._context.observe(told, self._publisher.enter(standing.phase, told, standing.cause))
        return standing

    @property
    def _rescue_text(self) -> str:
        return _joined(self._outcome[1], "landing")

    # --- the end

    def give_up(self, text: str) -> None:
        """End as FAILED, and land nothing."""
        self._end(Phase.FAILED, text, rescue=False)
        self._wake()

    def _give_up_for_clock(self) -> None:
        if self._stage in (RunStage.FLYING, RunStage.LOOKING, RunStage.RESCUING):
            text = f"robot time stands still for {CLOCK_TIMEOUT:g} s"
            self.give_up(_joined(self._why(), f"then {text}") if self._context.failure else text)

    def stop(self) -> None:
        """Interrupt what still runs and say that the mission is over; nobody will wait for the answers."""
        if self._stage is not RunStage.OVER:
            self._end(Phase.ABORTED, self._abort_reason or "the mission's process was stopped", rescue=False)
            self._finish()

    def leave(self) -> None:
        """End at once: the system was stopped, and nobody is there to stop or to land anything."""
        if self._stage is RunStage.OVER:
            return
        phase, before = self._outcome
        where = ", with the drone in the air" if self._airborne.is_in_air else ""
        after = f"; before that: {before}" if before else ""
        self._system_is_there = False
        self._stop_tree(
            Phase.ABORTED if phase is Phase.IDLE else phase, f"the system was stopped under it{where}{after}"
        )
        self._conclude(*self._outcome)

    def _end(self, phase: Phase, text: str, *, rescue: bool) -> None:
        """Halt the tree. Then bring the drone down with `rescue`, or wait for the goals to stop."""
        self._stop_tree(phase, text)
        self._begin_rescue() if rescue else self._settle()

    def _land(self, phase: Phase, text: str) -> None:
        """The tree has come to its end; whoever ended it in the air does not leave the drone there."""
        self._stop_tree(phase, text)
        self._stage = RunStage.LOOKING
        self._ended_at = self._bus.now()
        self._look()

    def _look(self) -> None:
        """The landing's end may be known before the landing gear tells of it; an end in the air stays one."""
        if not self._airborne.leaves_drone_in_air:
            self._settle()
        elif self._bus.now() - self._ended_at >= SETTLE_TIME:
            phase, text = self._outcome
            self._outcome = phase, _joined(text, "it ended in the air")
            self._begin_rescue()

    def _stop_tree(self, phase: Phase, text: str) -> None:
        self._outcome = phase, text
        self._publisher.publish_tree()  # the last picture of it, before halting wipes its statuses
        self._halt()

    def _halt(self) -> None:
        try:
            self._tree.stop(Status.INVALID)
        except Exception as error:  # noqa: BLE001 - the goals have to be interrupted all the same
            phase, text = self._outcome
            self._outcome = phase, _joined(text, f"halting the tree raised {type(error).__name__}: {error}")
        self._context.cancel_all()

    def _begin_rescue(self) -> None:
        self._stage = RunStage.RESCUING
        self._show(self._trees.rescue)

    def _settle(self) -> None:
        self._stage = RunStage.SETTLING
        self._until_over.append(self._bus.after(SETTLE_TIMEOUT, self._finish, wall=True))

    def _finish(self) -> None:
        """Everything has stopped, or had time enough to."""
        if self._stage is RunStage.OVER:
            return
        phase, text = self._outcome
        running = self._context.reaper.unfinished
        if running:
            text = _joined(text, "these did not stop: " + ", ".join(sorted({goal.skill for goal in running})))
        self._conclude(phase, text)

    def _conclude(self, phase: Phase, text: str) -> None:
        self._stage = RunStage.OVER
        failure = self._context.failure if phase is Phase.FAILED else None
        self._publisher.enter(phase, text, failure.record if failure else None)
        for handle in self._until_over:
            handle.cancel()


def _is_flying(leaf: Behaviour) -> bool:
    return isinstance(leaf, SkillAction) and leaf.status is Status.RUNNING


def _joined(*clauses: str) -> str:
    """One sentence of several: a full stop stands only at its end, if the last one has it."""
    *first, last = clauses
    return "; ".join([*(clause.removesuffix(".") for clause in first), last])
