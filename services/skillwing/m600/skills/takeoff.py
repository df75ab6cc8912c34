"""The manager of `takeoff`."""

from __future__ import annotations

import math

from skillwing.m600.generated.managers import AbstractTakeoffManager
from skillwing.m600.generated.types import TakeoffFeedback, TakeoffInputs
from skillwing.m600.geofence import HOME, refusal
from skillwing.m600.latest import Latest
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.headway import Headway
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal
from skillwing.sim_mujoco.topics import NAVIGATION, AxisStatus, MotionState, Navigation, TakeOff

MAX_DRIFT = 2.0
"""Horizontally, from where the climb began [m]."""
TOLERANCE = 0.5
"""Largest error of the height reached [m]."""


class TakeoffManager(AbstractTakeoffManager):
    """Climbs to a height over the home point, and judges by the navigation solution whether it really does."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.navigation = Latest(self.bus, NAVIGATION, Navigation)

    def validate(self, goal: Goal[TakeoffInputs]) -> str | None:
        if self.navigation.value is None:
            return "There is no navigation solution yet. Wait until the drone knows where it is."
        return refusal((*HOME, goal.inputs.height))

    def on_dispatch(self, goal: Goal[TakeoffInputs]) -> None:
        assert self.navigation.value is not None, "validated"
        self._start = self.navigation.value.position
        self._climb = Headway(self.bus.now(), self._start[2])
        self.guidance.fly(goal, TakeOff(height=goal.inputs.height, speed=goal.inputs.speed))

    def progress(self, goal: Goal[TakeoffInputs]) -> TakeoffFeedback | None:
        navigation = self.navigation.value
        return None if navigation is None else TakeoffFeedback(height=navigation.position[2])

    def on_interrupt(self, goal: Goal[TakeoffInputs]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[TakeoffInputs], terminal: Terminal) -> None:
        self.guidance.release(goal)

    def _on_guidance(self, goal: Goal[TakeoffInputs], axis: AxisStatus) -> None:
        navigation = self.navigation.value
        if navigation is None:
            return
        x, y, z = navigation.position
        drift = math.hypot(x - self._start[0], y - self._start[1])
        reached = abs(z - goal.inputs.height) <= TOLERANCE
        if axis.state is MotionState.DONE and reached:
            self.terminated_AT_ALTITUDE(goal.id)
        elif axis.state is MotionState.ABORTED or drift > MAX_DRIFT:
            self.terminated_ABORTED(goal.id)
        elif axis.state is MotionState.BLOCKED or self._climb.stalled(self.bus.now(), z):
            self.terminated_BLOCKED(goal.id)
