"""The manager of `rotate_head`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractRotateHeadManager
from skillwing.m600.generated.types import RotateHeadFeedback, RotateHeadInputs
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.onboard.topics.guidance import AxisStatus, MotionState, Turn
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal


class RotateHeadManager(AbstractRotateHeadManager):
    """Turn to a heading, while another skill may move the body."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.HEADING, self._on_guidance)

    def on_dispatch(self, goal: Goal[RotateHeadInputs]) -> None:
        self.guidance.fly(goal, Turn(heading=goal.inputs.heading, lock=False))

    def progress(self, goal: Goal[RotateHeadInputs]) -> RotateHeadFeedback | None:
        remaining = self.guidance.remaining
        return None if remaining is None else RotateHeadFeedback(error=remaining)

    def on_interrupt(self, goal: Goal[RotateHeadInputs]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[RotateHeadInputs], terminal: Terminal) -> None:
        self.guidance.release(goal)

    def _on_guidance(self, goal: Goal[RotateHeadInputs], axis: AxisStatus) -> None:
        if axis.state is MotionState.DONE:
            self.terminated_ALIGNED(goal.id)
        elif axis.state is MotionState.ABORTED:
            self.failed(goal.id, f"Guidance gave up turning: {axis.text}.", cause=self.guidance.record)
