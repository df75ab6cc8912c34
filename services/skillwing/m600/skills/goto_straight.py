"""The manager of `goto_straight`."""

from __future__ import annotations

from msgspec.structs import replace

from skillwing.m600.generated.managers import AbstractGotoStraightManager
from skillwing.m600.generated.types import GotoStraightFeedback, GotoStraightInputs, GotoStraightOutputs
from skillwing.m600.skills.motion import MotionManager, point
from skillwing.onboard.topics.guidance import YawMode
from skillwing.services.managers.skill_manager import Goal


class GotoStraightManager(
    MotionManager[GotoStraightInputs, GotoStraightOutputs, GotoStraightFeedback], AbstractGotoStraightManager
):
    """Flight to a point with the nose, and so the camera, along the track."""

    def validate(self, goal: Goal[GotoStraightInputs]) -> str | None:
        return self.fence.refusal(point(goal.inputs.target))

    def on_dispatch(self, goal: Goal[GotoStraightInputs]) -> None:
        self.fly_to(goal, point(goal.inputs.target), goal.inputs.speed, YawMode.ALONG_TRACK)

    def progress(self, goal: Goal[GotoStraightInputs]) -> GotoStraightFeedback | None:
        remaining = self.guidance.remaining
        return None if remaining is None else GotoStraightFeedback(distance=remaining)

    def arrived(self, goal: Goal[GotoStraightInputs]) -> None:
        self.terminated_ARRIVED(goal.id, GotoStraightOutputs(stopped_at=self.here))

    def blocked(self, goal: Goal[GotoStraightInputs], obstacle_distance: float | None) -> None:
        output = GotoStraightOutputs(stopped_at=self.here)
        if obstacle_distance is not None:
            output = replace(output, obstacle_distance=obstacle_distance)
        self.terminated_BLOCKED(goal.id, output, cause=self.guidance.record, why=self.guidance.why)

    def aborted(self, goal: Goal[GotoStraightInputs]) -> None:
        self.terminated_ABORTED(
            goal.id, GotoStraightOutputs(stopped_at=self.here), cause=self.guidance.record, why=self.guidance.why
        )
