"""The manager of `inspect`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractInspectManager
from skillwing.m600.generated.types import InspectFeedback, InspectInputs
from skillwing.m600.skills.motion import MotionManager, point
from skillwing.onboard.topics.guidance import Orbit
from skillwing.services.managers.skill_manager import Goal


class InspectManager(MotionManager[InspectInputs, None, InspectFeedback], AbstractInspectManager):
    """Flight to the circle and around it, with the nose, and so the camera, to its centre.

    With a depth map from the LiDAR the way is monitored: the LiDAR's ring looks along the circle's tangent.
    """

    def validate(self, goal: Goal[InspectInputs]) -> str | None:
        x, y, _ = point(goal.inputs.center)
        radius, height = goal.inputs.radius, goal.inputs.height
        corners = ((x + i * radius, y + j * radius, height) for i in (-1, 1) for j in (-1, 1))
        return next((refusal for refusal in map(self.fence.refusal, corners) if refusal is not None), None)

    def on_dispatch(self, goal: Goal[InspectInputs]) -> None:
        wanted = goal.inputs
        orbit = Orbit(
            center=point(wanted.center),
            radius=wanted.radius,
            height=wanted.height,
            laps=wanted.laps,
            speed=wanted.speed,
        )
        self.guidance.fly(goal, orbit)

    def progress(self, goal: Goal[InspectInputs]) -> InspectFeedback | None:
        laps_done = self.guidance.laps_done
        return None if laps_done is None else InspectFeedback(laps_done=laps_done)

    def arrived(self, goal: Goal[InspectInputs]) -> None:
        self.terminated_COMPLETED(goal.id)

    def blocked(self, goal: Goal[InspectInputs], obstacle_distance: float | None) -> None:
        self.terminated_BLOCKED(goal.id, cause=self.guidance.record, why=self.guidance.why)

    def aborted(self, goal: Goal[InspectInputs]) -> None:
        self.terminated_ABORTED(goal.id, cause=self.guidance.record, why=self.guidance.why)
