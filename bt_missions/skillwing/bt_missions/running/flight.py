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

from skillwing.bt_missions.leaves.context import CALM, MissionContext
from skillwing.bt_missions.leaves.flying import FLIGHT_STATUS, IN_AIR
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.running.announcer import Announcer
from skillwing.bt_missions.running.landing_gear import LandingGear
from skillwing.bt_missions.running.mission import Mission, MissionTrees
from skillwing.bt_missions.running.standing import Holders, Standing
from skillwing.bt_missions.running.still_clock import STILL_CLOCK_TIMEOUT, StillClock
from skillwing.services.bus import Bus, Handle
from skillwing.services.protocol import MissionPhase

SETTLED_TICK = 0.01
"""A tick that changed something is followed by another one, after so many seconds of robot time."""
SETTLE_TIMEOUT = 15.0
"""How long to wait at the end for goals that do not stop, in seconds of wall time."""


class Stage(StrEnum):
    WAITING = "waiting"
    FLYING = "flying"
    LOOKING = "looking"
    RESCUING = "rescuing"
    SETTLING = "settling"
    OVER = "over"


class Flight:
    """Flies `trees` for `mission`. Has to be ticked whenever something may have changed, and asks for it with `wake`
    where it has changed something itself."""

    def __init__(
        self,
        bus: Bus,
        mission: Mission,
        trees: MissionTrees,
        context: MissionContext,
        announcer: Announcer,
        wake: Callable[[], None],
    ) -> None:
        self._bus = bus
        self._mission = mission
        self._trees = trees
        self._context = context
        self._interface = context.interface
        self._announcer = announcer
        self._wake = wake
        self._landing_gear = LandingGear(context.interface, context.skillset)
        self._stage = Stage.WAITING
        self._outcome = MissionPhase.IDLE, ""
        self._abort_reason: str | None = None
        self._knows_time = False
        self._has_flown = False
        self._system_is_there = True
        self._ended_at = 0.0
        self._until_over: list[Handle] = []
        self._show(trees.root)

    @property
    def tree_tells(self) -> bool:
        """Whether the tree shows why the mission ended: it was flown, and the robot was there to its end."""
        return self._has_flown and self._system_is_there

    def until_over(self, *handles: Handle) -> None:
        """Cancel these when the run is over."""
        self._until_over += handles

    def learn_time(self) -> None:
        """Robot time is known from now on."""
        self._knows_time = True
        self._wake()

    def tick(self) -> None:
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
        if self._stage in (Stage.FLYING, Stage.RESCUING) and self._announcer.publish_tree():
            self._tell_progress()
            # What one tick changed (the end of a round, say) the next one may go on from.
            self._bus.after(SETTLED_TICK, self._wake)

    # --- what an operator wants

    def abort(self, reason: str) -> None:
        """Interrupt everything, land, and end as ABORTED. Repeating it, or calling it at the end, changes nothing."""
        if self._stage not in (Stage.WAITING, Stage.FLYING):
            return
        self._abort_reason = reason
        self._end(MissionPhase.ABORTED, reason, rescue=self._stage is Stage.FLYING)
        # At once: whoever asked is answered with it.
        if self._stage is Stage.RESCUING:
            self._announcer.publish(MissionPhase.RUNNING, self._rescue_text)
        else:
            self._announcer.publish(MissionPhase.IDLE, self._outcome[1])
        self._wake()

    def pause(self, reason: str) -> str | None:
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

    def resume(self, reason: str) -> str | None:
        """Go on where the flight was paused. Returns a sentence that says what is against it."""
        against = self._holders.resume()
        if against is None:
            self._tell_standing(reason)
            self._wake()
        return against

    # --- waiting for the robot

    def _take_off_when_ready(self) -> None:
        missing = self._missing()
        if not missing:
            self._stage = Stage.FLYING
            self._has_flown = True
            self._landing_gear.begin()
            self._announcer.enter(MissionPhase.RUNNING, "the robot is ready")
            self._until_over.append(StillClock(self._bus, self._give_up_for_clock))
            self._fly()
        elif self._announcer.status.text != missing:
            self._announcer.publish(MissionPhase.IDLE, missing)

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
        if self._stage is Stage.WAITING:
            self.give_up(f"The robot did not get ready within {waited:g} s ({self._missing()}).")

    def give_up_in_air(self) -> None:
        """Nobody brings down a drone that nobody flies, so there is nothing to wait for."""
        wanted = self._mission.needs.get(FLIGHT_STATUS, (IN_AIR,))
        if self._stage is Stage.WAITING and IN_AIR not in wanted and self._landing_gear.nobody_flies:
            self.give_up("The drone is in the air already, and nobody flies it. Land it with `skillwing start land`.")

    # --- flying

    def _fly(self) -> None:
        status = self._tick_tree(self._trees.root)
        if status is Status.SUCCESS:
            self._land(MissionPhase.SUCCEEDED, self._trees.progress().text or "done")
        elif status is Status.FAILURE:
            self._land(MissionPhase.FAILED, self._why())

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
            if self._stage is Stage.RESCUING:
                phase, reason = self._outcome
                self._end(phase, _joined(reason, f"while landing {text}"), rescue=False)
            else:
                self._end(MissionPhase.FAILED, text, rescue=True)
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
        self._holders = Holders(tree, self._interface)
        self._announcer.show(tree, self._trees.progress)

    def _tell_progress(self) -> None:
        running = [leaf.name for leaf in self._tree.iterate() if _is_flying(leaf)]
        phase, text = MissionPhase.RUNNING, ", ".join(running) or "deciding"
        if self._stage is Stage.RESCUING:
            text = self._rescue_text
        else:
            phase, reason, _ = self._tell_standing()
            text = reason or text
        self._announcer.publish_news(phase, text)

    def _tell_standing(self, reason: str = "") -> Standing:
        """Tell when the flight is held or goes on; what is done next is done for that."""
        standing = self._holders.standing
        if standing.phase != self._announcer.status.phase:
            told = reason or standing.reason or self._context.last_news
            self._context.learn(told, self._announcer.enter(standing.phase, told, standing.cause))
        return standing

    @property
    def _rescue_text(self) -> str:
        return _joined(self._outcome[1], "landing")

    # --- the end

    def give_up(self, text: str) -> None:
        """End as FAILED, and land nothing."""
        self._end(MissionPhase.FAILED, text, rescue=False)
        self._wake()

    def _give_up_for_clock(self) -> None:
        if self._stage in (Stage.FLYING, Stage.LOOKING, Stage.RESCUING):
            text = f"robot time stands still for {STILL_CLOCK_TIMEOUT:g} s"
            self.give_up(_joined(self._why(), f"then {text}") if self._context.failure else text)

    def stop(self) -> None:
        """Interrupt what still runs and say that the mission is over; nobody will wait for the answers."""
        if self._stage is not Stage.OVER:
            self._end(MissionPhase.ABORTED, self._abort_reason or "the mission's process was stopped", rescue=False)
            self._finish()

    def leave(self) -> None:
        """End at once: the system was stopped, and nobody is there to stop or to land anything."""
        if self._stage is Stage.OVER:
            return
        phase, before = self._outcome
        where = ", with the drone in the air" if self._landing_gear.is_in_air else ""
        after = f"; before that: {before}" if before else ""
        self._system_is_there = False
        self._stop_tree(
            MissionPhase.ABORTED if phase is MissionPhase.IDLE else phase,
            f"the system was stopped under it{where}{after}",
        )
        self._conclude(*self._outcome)

    def _end(self, phase: MissionPhase, text: str, *, rescue: bool) -> None:
        """Halt the tree. Then bring the drone down with `rescue`, or wait for the goals to stop."""
        self._stop_tree(phase, text)
        self._begin_rescue() if rescue else self._settle()

    def _land(self, phase: MissionPhase, text: str) -> None:
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
            self._outcome = phase, _joined(text, "it ended in the air")
            self._begin_rescue()

    def _stop_tree(self, phase: MissionPhase, text: str) -> None:
        self._outcome = phase, text
        self._announcer.publish_tree()  # the last picture of it, before halting wipes its statuses
        self._halt()

    def _halt(self) -> None:
        try:
            self._tree.stop(Status.INVALID)
        except Exception as error:  # noqa: BLE001 - the goals have to be interrupted all the same
            phase, text = self._outcome
            self._outcome = phase, _joined(text, f"halting the tree raised {type(error).__name__}: {error}")
        self._context.cancel_everything()

    def _begin_rescue(self) -> None:
        self._stage = Stage.RESCUING
        self._show(self._trees.rescue)

    def _settle(self) -> None:
        self._stage = Stage.SETTLING
        self._until_over.append(self._bus.after(SETTLE_TIMEOUT, self._finish, wall=True))

    def _finish(self) -> None:
        """Everything has stopped, or had time enough to."""
        if self._stage is Stage.OVER:
            return
        phase, text = self._outcome
        running = self._context.reaper.unfinished
        if running:
            text = _joined(text, "these did not stop: " + ", ".join(sorted({goal.skill for goal in running})))
        self._conclude(phase, text)

    def _conclude(self, phase: MissionPhase, text: str) -> None:
        self._stage = Stage.OVER
        failure = self._context.failure if phase is MissionPhase.FAILED else None
        self._announcer.enter(phase, text, failure.record if failure else None)
        for handle in self._until_over:
            handle.cancel()


def _is_flying(leaf: Behaviour) -> bool:
    return isinstance(leaf, SkillAction) and leaf.status is Status.RUNNING


def _joined(*clauses: str) -> str:
    """One sentence of several: a full stop stands only at its end, if the last one has it."""
    *first, last = clauses
    return "; ".join([*(clause.removesuffix(".") for clause in first), last])
