"""The manager of `takeoff`."""

from __future__ import annotations

import math

from skillwing.m600.generated.managers import AbstractTakeoffManager
from skillwing.m600.generated.types import TakeoffFeedback, TakeoffInputs
from skillwing.m600.geofence import GeofenceChecker
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.position_tracker import PositionTracker
from skillwing.m600.skills.timers import StallDetector
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import AxisStatus, MotionState, TakeOff
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal

MAX_DRIFT = 2.0
"""Horizontal distance from the start of the climb [m]."""
TOLERANCE = 0.5
"""Largest error of the height reached [m]."""


class TakeoffManager(AbstractTakeoffManager):
    """Climb to a height over the home point, checked against the navigation solution."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.tracker = PositionTracker(self)
        self.fence = GeofenceChecker(self.bus)

    def validate(self, goal: Goal[TakeoffInputs]) -> str | None:
        return self.fence.refusal((*self.fence.home, goal.inputs.height))

    def on_dispatch(self, goal: Goal[TakeoffInputs]) -> None:
        self.tracker.locate(goal, lambda position: self._climb_from(goal, position))

    def progress(self, goal: Goal[TakeoffInputs]) -> TakeoffFeedback | None:
        position = self.tracker.position
        return None if position is None else TakeoffFeedback(height=position[2])

    def on_interrupt(self, goal: Goal[TakeoffInputs]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[TakeoffInputs], terminal: Terminal) -> None:
        self.tracker.rest()
        self.guidance.release(goal)

    def _climb_from(self, goal: Goal[TakeoffInputs], position: Vector3) -> None:
        self._start = position
        self._climb = StallDetector(self.bus.now(), position[2])
        self.guidance.fly(goal, TakeOff(height=goal.inputs.height, speed=goal.inputs.speed))

    def _on_guidance(self, goal: Goal[TakeoffInputs], axis: AxisStatus) -> None:
        position = self.tracker.position
        if position is None:
            return
        x, y, z = position
        drift = math.hypot(x - self._start[0], y - self._start[1])
        reached = abs(z - goal.inputs.height) <= TOLERANCE
        if axis.state is MotionState.DONE and reached:
            self.terminated_AT_ALTITUDE(goal.id)
        elif axis.state is MotionState.ABORTED:
            self.terminated_ABORTED(goal.id, cause=self.guidance.record, why=self.guidance.why)
        elif drift > MAX_DRIFT:
            why = f"the drone has drifted {drift:.1f} m from the start of its climb"
            self.terminated_ABORTED(goal.id, cause=self.guidance.record, why=why)
        elif axis.state is MotionState.BLOCKED:
            self.terminated_BLOCKED(goal.id, cause=self.guidance.record, why=self.guidance.why)
        elif self._climb.stalled(self.bus.now(), z):
            self.terminated_BLOCKED(goal.id, why=f"the drone no longer climbs, at {z:.1f} m")
