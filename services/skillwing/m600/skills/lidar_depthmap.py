"""The manager of `lidar_depthmap`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractLidarDepthmapManager
from skillwing.m600.generated.types import LidarDepthmapFeedback, LidarDepthmapInputs
from skillwing.m600.skills.depthmap import NO_DATA, DepthmapManager
from skillwing.onboard.topics.obstacles import ObstacleSource
from skillwing.services.managers.skill_manager import Goal


class LidarDepthmapManager(
    DepthmapManager[LidarDepthmapInputs, None, LidarDepthmapFeedback], AbstractLidarDepthmapManager
):
    """Depth map from the LiDAR, whose ring sees only sideways."""

    source = ObstacleSource.LIDAR

    def progress(self, goal: Goal[LidarDepthmapInputs]) -> LidarDepthmapFeedback | None:
        distance = self.obstacle_distance
        return None if distance is None else LidarDepthmapFeedback(obstacle_distance=distance)

    def no_data(self, goal: Goal[LidarDepthmapInputs]) -> None:
        self.terminated_NO_DATA(goal.id, why=NO_DATA)
