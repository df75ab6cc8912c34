"""The manager of `land`."""

from __future__ import annotations

from enum import Enum, auto

from skillwing.m600.generated.managers import AbstractLandManager
from skillwing.m600.generated.types import LandFeedback, LandInputs
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.headway import Headway
from skillwing.m600.skills.position_tracker import Whereabouts
from skillwing.onboard.topics.common import Empty, Vector3
from skillwing.onboard.topics.flight import FLIGHT, FlightState
from skillwing.onboard.topics.guidance import AxisStatus, FlyTo, Land, MotionState, YawMode
from skillwing.onboard.topics.obstacles import LANDING_PLACE, LandingPlace
from skillwing.services.bus import Answer, Answered
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import ProtocolError, RecordKind, Terminal, decode, encode
from skillwing.services.timeline import Timeline

PATIENCE = 1.0
"""So long a landing waits to hear of a better place [s]."""
ASIDE = 1.0
"""Speed at which the drone flies there [m/s]."""
ASIDES = 2
"""So often it flies aside at most: underway more is seen of the ground than was known before."""
HANGS_AFTER = 10.0
"""A drone that has come no lower for so long hangs [s]. The autopilot takes up to 8 s to notice that it stands, if the
range-finder says that the ground is lower."""
SUBJECT = "landing place"
"""Of the record in the timeline that says what is known to stand below."""
AT_AN_END = frozenset({MotionState.DONE, MotionState.BLOCKED, MotionState.ABORTED})
"""The way aside is flown, or as much of it as can be."""


class Stage(Enum):
    """Of a landing."""

    ASKING = auto()
    """Where to."""
    GOING_ASIDE = auto()
    DESCENDING = auto()
    STOPPING = auto()


class LandManager(AbstractLandManager):
    """Descends until the drone stands and its rotors are off: where it is, or beside what is known to stand below.

    Where it has flown aside it asks again, for it may have been stopped on the way, or see by now what stands there.
    It asks a last time where it goes aside no more: should something stand there, too, the timeline has to tell.

    Whoever does not answer where to land, or refuses to fly there, does not keep the drone from landing where it is,
    nor does what stands below where no better place is known: the battery may not wait. Whether something is known to
    stand below, the timeline tells.
    """

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.whereabouts = Whereabouts(self)
        self.flight = Latest(self.bus, FLIGHT, FlightState, self._on_flight, at_rest=True)
        self._timeline = Timeline(self.bus, KEYS)
        self._stage = Stage.ASKING
        self._asides = 0
        self._descent: Headway | None = None

    def on_dispatch(self, goal: Goal[LandInputs]) -> None:
        self._asides, self._descent = 0, None
        self.whereabouts.follow()
        self.flight.follow()
        self._ask(goal)

    def progress(self, goal: Goal[LandInputs]) -> LandFeedback | None:
        return LandFeedback(height=self.guidance.remaining) if self._stage is Stage.DESCENDING else None

    def on_interrupt(self, goal: Goal[LandInputs]) -> None:
        self._stage = Stage.STOPPING
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[LandInputs], terminal: Terminal) -> None:
        self.whereabouts.rest()
        self.flight.rest()
        self.guidance.release(goal)

    def _ask(self, goal: Goal[LandInputs]) -> None:
        self._stage = Stage.ASKING
        self.bus.ask(LANDING_PLACE, encode(Empty()), lambda answer: self._told(goal, answer), timeout=PATIENCE)

    def _told(self, goal: Goal[LandInputs], answer: Answer) -> None:
        if self.current is None or self.current.id != goal.id or self._stage is not Stage.ASKING:
            return
        told = _read(answer)
        place, text = told.place, told.text
        if place is not None and self._asides == ASIDES:
            place, text = None, f"{text}, but the drone goes aside no more"
        if told.taken:
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
        """Guidance does not fly there, and would not the next time."""
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
                pass  # There is no motion, or it was that of the way aside.
            case Stage.GOING_ASIDE:
                if axis.state in AT_AN_END:
                    self._ask(goal)
            case Stage.DESCENDING | Stage.STOPPING:
                self._watch_descent(goal, axis)

    def _watch_descent(self, goal: Goal[LandInputs], axis: AxisStatus) -> None:
        if axis.state is MotionState.ABORTED:
            self.failed(goal.id, f"Guidance gave up the landing: {axis.text}.")
        elif axis.state is MotionState.BLOCKED or self._hangs():
            self.terminated_BLOCKED(goal.id)

    def _hangs(self) -> bool:
        """The drone no longer comes down."""
        position, now = self.whereabouts.position, self.bus.now()
        if position is None:
            return False
        depth = -position[2]
        if self._descent is None:
            self._descent = Headway(now, depth, patience=HANGS_AFTER)
        return self._descent.stalled(now, depth)


def _read(answer: Answer) -> LandingPlace:
    """What was answered; where it is, if nobody knows better."""
    try:
        return decode(answer.payload, LandingPlace) if isinstance(answer, Answered) else LandingPlace(place=None)
    except ProtocolError:
        return LandingPlace(place=None)
