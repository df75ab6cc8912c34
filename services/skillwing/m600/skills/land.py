"""The manager of `land`."""

from __future__ import annotations

from enum import Enum, auto

from skillwing.m600.generated.managers import AbstractLandManager
from skillwing.m600.generated.types import LandFeedback, LandInputs
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.position_tracker import PositionTracker
from skillwing.m600.skills.timers import StallDetector
from skillwing.onboard.topics.common import Empty, Vector3
from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.guidance import AxisStatus, FlyTo, Land, MotionState, YawMode
from skillwing.onboard.topics.obstacles import LANDING_PLACE, LandingPlace
from skillwing.services.bus import Answer, Answered
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import ProtocolError, RecordKind, Terminal, decode, encode
from skillwing.services.timeline import Timeline

PATIENCE = 1.0
"""Longest wait for the reply with a landing place [s]."""
ASIDE = 1.0
"""Speed of the flight to a better place [m/s]."""
ASIDES = 2
"""Most flights to a better place: on the way the sensors see more of the ground than was known before."""
STALLED_AFTER = 10.0
"""Time without descent after which the landing is blocked [s]. The autopilot takes up to 8 s to detect the touchdown if
the range-finder reports a lower ground."""
SUBJECT = "landing place"
"""Subject of the timeline record about an obstacle below the drone."""
AT_AN_END = frozenset({MotionState.DONE, MotionState.BLOCKED, MotionState.ABORTED})
"""States at the end of a flight to a better place, complete or not."""


class Stage(Enum):
    """Stage of a landing."""

    ASKING = auto()
    GOING_ASIDE = auto()
    DESCENDING = auto()
    STOPPING = auto()


class LandManager(AbstractLandManager):
    """Descent until the drone stands and its rotors are off: straight down, or beside a known obstacle below.

    After a flight aside the manager asks again: the drone may have stopped on the way, or has seen an obstacle there.
    After the last flight aside it asks once more, so that the timeline records an obstacle at that place too.

    The drone lands where it is if there is no reply, if guidance refuses the flight aside, or if no better place is
    known: the battery may not last. The timeline records a known obstacle below.
    """

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.tracker = PositionTracker(self)
        self.flight = Latest(self.bus, FLIGHT, FlightState, self._on_flight, at_rest=True)
        self._timeline = Timeline(self.bus, KEYS)
        self._stage = Stage.ASKING
        self._asides = 0
        self._descent: StallDetector | None = None

    def on_dispatch(self, goal: Goal[LandInputs]) -> None:
        self._asides, self._descent = 0, None
        self.tracker.follow()
        self.flight.follow()
        self._ask(goal)

    def progress(self, goal: Goal[LandInputs]) -> LandFeedback | None:
        height = self.guidance.remaining if self._stage is Stage.DESCENDING else None
        return None if height is None else LandFeedback(height=height)

    def on_interrupt(self, goal: Goal[LandInputs]) -> None:
        self._stage = Stage.STOPPING
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[LandInputs], terminal: Terminal) -> None:
        self.tracker.rest()
        self.flight.rest()
        self.guidance.release(goal)

    def _ask(self, goal: Goal[LandInputs]) -> None:
        self._stage = Stage.ASKING
        self.bus.ask(LANDING_PLACE, encode(Empty()), lambda answer: self._on_place(goal, answer), timeout=PATIENCE)

    def _on_place(self, goal: Goal[LandInputs], answer: Answer) -> None:
        if self.current is None or self.current.id != goal.id or self._stage is not Stage.ASKING:
            return
        reply = _read(answer)
        place, text = reply.place, reply.text
        if place is not None and self._asides == ASIDES:
            place, text = None, f"{text}, but the drone goes aside no more"
        if reply.taken:
            self._timeline.record(RecordKind.HEALTH, SUBJECT, None, "TAKEN", text=text, goal_id=goal.id)
        if place is None:
            self._descend(goal)
        else:
            self._go_aside(goal, place)

    def _go_aside(self, goal: Goal[LandInputs], place: Vector3) -> None:
        self._stage = Stage.GOING_ASIDE
        self._asides += 1
        aside = FlyTo(target=place, speed=ASIDE, nose=YawMode.FREE)
        self.guidance.fly(goal, aside, on_refused=lambda _: self._stay(goal))

    def _stay(self, goal: Goal[LandInputs]) -> None:
        """Guidance refused the flight aside, and would refuse the next one."""
        self._asides = ASIDES
        self._ask(goal)

    def _descend(self, goal: Goal[LandInputs]) -> None:
        self._stage = Stage.DESCENDING
        self.guidance.fly(goal, Land(speed=goal.inputs.speed))

    def _on_flight(self, flight: FlightState) -> None:
        if self.current is not None and flight.on_ground and not flight.rotors_on:
            self.terminated_LANDED(self.current.id)

    def _on_guidance(self, goal: Goal[LandInputs], axis: AxisStatus) -> None:
        match self._stage:
            case Stage.ASKING:
                pass  # No motion yet, or the report is about the flight aside.
            case Stage.GOING_ASIDE:
                if axis.state in AT_AN_END:
                    self._ask(goal)
            case Stage.DESCENDING | Stage.STOPPING:
                self._watch_descent(goal, axis)

    def _watch_descent(self, goal: Goal[LandInputs], axis: AxisStatus) -> None:
        if axis.state is MotionState.ABORTED:
            self.failed(goal.id, f"Guidance gave up the landing: {axis.text}.", cause=self.guidance.record)
        elif axis.state is MotionState.BLOCKED:
            self.terminated_BLOCKED(goal.id, cause=self.guidance.record, why=self.guidance.why)
        elif self._has_stalled():
            self.terminated_BLOCKED(goal.id, why=f"the drone has not descended for {STALLED_AFTER:g} s")

    def _has_stalled(self) -> bool:
        """Test for a drone that no longer descends."""
        position, now = self.tracker.position, self.bus.now()
        if position is None:
            return False
        depth = -position[2]
        if self._descent is None:
            self._descent = StallDetector(now, depth, patience=STALLED_AFTER)
        return self._descent.stalled(now, depth)


def _read(answer: Answer) -> LandingPlace:
    """The place in the reply; straight down without a valid reply."""
    try:
        return decode(answer.payload, LandingPlace) if isinstance(answer, Answered) else LandingPlace(place=None)
    except ProtocolError:
        return LandingPlace(place=None)
