"""The manager of `goto`."""

from __future__ import annotations

from msgspec.structs import replace

from skillwing.m600.generated.managers import AbstractGotoManager
from skillwing.m600.generated.types import GotoFeedback, GotoInputs, GotoOutputs
from skillwing.m600.skills.motion import MotionManager, point
from skillwing.onboard.topics.guidance import YawMode
from skillwing.services.managers.skill_manager import Goal


class GotoManager(MotionManager[GotoInputs, GotoOutputs, GotoFeedback], AbstractGotoManager):
    """Flight to a point; another skill may command the heading."""

    def validate(self, goal: Goal[GotoInputs]) -> str | None:
        return self.fence.refusal(point(goal.inputs.target))

    def on_dispatch(self, goal: Goal[GotoInputs]) -> None:
        self.fly_to(goal, point(goal.inputs.target), goal.inputs.speed, YawMode.FREE)

    def on_modify(self, goal: Goal[GotoInputs]) -> None:
        self.on_dispatch(goal)

    def progress(self, goal: Goal[GotoInputs]) -> GotoFeedback | None:
        remaining = self.guidance.remaining
        return None if remaining is None else GotoFeedback(distance=remaining)

    def arrived(self, goal: Goal[GotoInputs]) -> None:
        self.terminated_ARRIVED(goal.id, GotoOutputs(stopped_at=self.here))

    def blocked(self, goal: Goal[GotoInputs], obstacle_distance: float | None) -> None:
        output = GotoOutputs(stopped_at=self.here)
        if obstacle_distance is not None:
            output = replace(output, obstacle_distance=obstacle_distance)
        self.terminated_BLOCKED(goal.id, output, cause=self.guidance.record, why=self.guidance.why)

    def aborted(self, goal: Goal[GotoInputs]) -> None:
        self.terminated_ABORTED(
            goal.id, GotoOutputs(stopped_at=self.here), cause=self.guidance.record, why=self.guidance.why
        )
