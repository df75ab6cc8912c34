"""The manager of `return_home`."""

from __future__ import annotations

from math import dist

from skillwing.m600.generated.managers import AbstractReturnHomeManager
from skillwing.m600.generated.types import ReturnHomeFeedback, ReturnHomeInputs
from skillwing.m600.skills.motion import MotionManager
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import YawMode
from skillwing.services.managers.skill_manager import Goal

CLIMB = 3.0
"""Height of each further climb over an obstacle on the way [m]."""
OVER_HOME = 2.0
"""Distance within which the drone counts as over the home point [m]."""


class ReturnHomeManager(MotionManager[ReturnHomeInputs, None, ReturnHomeFeedback], AbstractReturnHomeManager):
    """Climb to a height, unless the drone is higher already, and flight back over the home point.

    The drone turns the depth map's sensor, if there is one, along the way home. If an obstacle is on the way, the drone
    climbs until it can fly over it, up to the ceiling of the geofence. A drone that is over the home point already does
    not climb; it only centres itself.
    """

    def validate(self, goal: Goal[ReturnHomeInputs]) -> str | None:
        return self.fence.refusal((*self.fence.home, goal.inputs.height))

    def on_dispatch(self, goal: Goal[ReturnHomeInputs]) -> None:
        self.tracker.locate(goal, lambda position: self._depart(goal, position))

    def progress(self, goal: Goal[ReturnHomeInputs]) -> ReturnHomeFeedback | None:
        position = self.tracker.position
        return None if position is None else ReturnHomeFeedback(distance=self._from_home(position))

    def arrived(self, goal: Goal[ReturnHomeInputs]) -> None:
        if self._climbing:
            self._climbing = False
            self.fly_to(
                goal, self.fence.nearest_inside((*self.fence.home, self._height)), goal.inputs.speed, YawMode.IN_VIEW
            )
        else:
            self.terminated_ARRIVED(goal.id)

    def blocked(self, goal: Goal[ReturnHomeInputs], obstacle_distance: float | None) -> None:
        ceiling = self.fence.ceiling
        if self._climbing or self._height >= ceiling:
            self.terminated_ABORTED(goal.id, cause=self.guidance.record, why=self.guidance.why)
            return
        position = self.tracker.position or (*self.fence.home, self._height)
        self._climb(goal, position, min(ceiling, self._height + CLIMB))

    def aborted(self, goal: Goal[ReturnHomeInputs]) -> None:
        self.terminated_ABORTED(goal.id, cause=self.guidance.record, why=self.guidance.why)

    def _depart(self, goal: Goal[ReturnHomeInputs], position: Vector3) -> None:
        if self._from_home(position) > OVER_HOME:
            self._climb(goal, position, max(position[2], goal.inputs.height))
        else:
            self._climbing, self._height = False, position[2]
            self.fly_to(
                goal, self.fence.nearest_inside((*self.fence.home, self._height)), goal.inputs.speed, YawMode.FREE
            )

    def _climb(self, goal: Goal[ReturnHomeInputs], position: Vector3, height: float) -> None:
        self._climbing, self._height = True, height
        self.fly_to(
            goal, self.fence.nearest_inside((position[0], position[1], height)), goal.inputs.speed, YawMode.FREE
        )

    def _from_home(self, position: Vector3) -> float:
        """Distance from the home point over the ground [m]."""
        return dist(position[:2], self.fence.home)
