"""The manager of `land`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractLandManager
from skillwing.m600.generated.types import LandFeedback, LandInputs
from skillwing.m600.latest import Latest
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.headway import Headway
from skillwing.m600.skills.whereabouts import Whereabouts
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal
from skillwing.sim_mujoco.topics import (
    FLIGHT,
    AxisStatus,
    FlightState,
    Land,
    MotionState,
)


class LandManager(AbstractLandManager):
    """Descends where the drone is, until it stands and its rotors are off."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.whereabouts = Whereabouts(self)
        self.flight = Latest(self.bus, FLIGHT, FlightState, self._on_flight, at_rest=True)
        self._descent: Headway | None = None

    def on_dispatch(self, goal: Goal[LandInputs]) -> None:
        self.whereabouts.follow()
        self.flight.follow()
        self.guidance.fly(goal, Land(speed=goal.inputs.speed))

    def progress(self, goal: Goal[LandInputs]) -> LandFeedback:
        return LandFeedback(height=self.guidance.remaining)

    def on_interrupt(self, goal: Goal[LandInputs]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[LandInputs], terminal: Terminal) -> None:
        self._descent = None
        self.whereabouts.rest()
        self.flight.rest()
        self.guidance.release(goal)

    def _on_flight(self, flight: FlightState) -> None:
        if self.current is not None and flight.on_ground and not flight.rotors_on:
            self.terminated_LANDED(self.current.id)

    def _on_guidance(self, goal: Goal[LandInputs], axis: AxisStatus) -> None:
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
            self._descent = Headway(now, depth)
        return self._descent.stalled(now, depth)
