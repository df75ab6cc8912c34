"""The manager of `hover`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractHoverManager
from skillwing.m600.generated.types import HoverFeedback, HoverInputs
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.onboard.topics.guidance import AxisStatus, HoldPosition, MotionState
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal


class HoverManager(AbstractHoverManager):
    """Holding of the position for a duration of robot time."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self._timer: Handle | None = None
        self._until = 0.0

    def on_dispatch(self, goal: Goal[HoverInputs]) -> None:
        self.guidance.fly(goal, HoldPosition())
        self._until = self.bus.now() + goal.inputs.duration
        self._timer = self.bus.after(goal.inputs.duration, lambda: self.terminated_DONE(goal.id))

    def progress(self, goal: Goal[HoverInputs]) -> HoverFeedback:
        return HoverFeedback(remaining=max(0.0, self._until - self.bus.now()))

    def on_interrupt(self, goal: Goal[HoverInputs]) -> None:
        self._cancel_timer()
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[HoverInputs], terminal: Terminal) -> None:
        self._cancel_timer()
        self.guidance.release(goal)

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _on_guidance(self, goal: Goal[HoverInputs], axis: AxisStatus) -> None:
        if axis.state in (MotionState.ABORTED, MotionState.BLOCKED):
            self.failed(goal.id, f"Guidance no longer holds the position: {axis.text}.", cause=self.guidance.record)
