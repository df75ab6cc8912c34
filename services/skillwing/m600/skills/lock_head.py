"""The manager of `lock_head`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractLockHeadManager
from skillwing.m600.generated.types import LockHeadFeedback, LockHeadInputs
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.onboard.topics.guidance import AxisStatus, MotionState, Turn
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import Terminal


class LockHeadManager(AbstractLockHeadManager):
    """Turn to a heading, which is held until an interruption."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.HEADING, self._on_guidance)

    def on_dispatch(self, goal: Goal[LockHeadInputs]) -> None:
        self.guidance.fly(goal, Turn(heading=goal.inputs.heading, lock=True))

    def progress(self, goal: Goal[LockHeadInputs]) -> LockHeadFeedback | None:
        remaining = self.guidance.remaining
        return None if remaining is None else LockHeadFeedback(error=remaining)

    def on_interrupt(self, goal: Goal[LockHeadInputs]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[LockHeadInputs], terminal: Terminal) -> None:
        self.guidance.release(goal)

    def _on_guidance(self, goal: Goal[LockHeadInputs], axis: AxisStatus) -> None:
        if axis.state is MotionState.ABORTED:
            self.failed(goal.id, f"Guidance gave up the heading: {axis.text}.", cause=self.guidance.record)
