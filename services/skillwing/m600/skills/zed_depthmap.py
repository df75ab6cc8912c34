"""The manager of `zed_depthmap`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractZedDepthmapManager
from skillwing.m600.generated.types import ZedDepthmapFeedback, ZedDepthmapInputs
from skillwing.m600.skills.depthmap import NO_DATA, DepthmapManager
from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.services.managers.skill_manager import Goal


class ZedDepthmapManager(DepthmapManager[ZedDepthmapInputs, None, ZedDepthmapFeedback], AbstractZedDepthmapManager):
    """Depth map from the front camera."""

    source = ObstacleSource.ZED

    def progress(self, goal: Goal[ZedDepthmapInputs]) -> ZedDepthmapFeedback | None:
        distance = self.obstacle_distance
        return None if distance is None else ZedDepthmapFeedback(obstacle_distance=distance)

    def no_data(self, goal: Goal[ZedDepthmapInputs]) -> None:
        self.terminated_NO_DATA(goal.id, why=NO_DATA)
