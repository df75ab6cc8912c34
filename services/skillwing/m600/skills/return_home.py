"""The manager of `return_home`."""

from __future__ import annotations

from math import hypot

from skillwing.m600.generated.managers import AbstractReturnHomeManager
from skillwing.m600.generated.types import ReturnHomeFeedback, ReturnHomeInputs
from skillwing.m600.geofence import HOME, nearest_inside, refusal
from skillwing.m600.skills.motion import MotionManager
from skillwing.services.managers.skill_manager import Goal
from skillwing.sim_mujoco.topics import Nose

OVER_HOME = 2.0
"""Within this distance the drone counts as being over the home point [m]."""


class ReturnHomeManager(MotionManager[ReturnHomeInputs, None, ReturnHomeFeedback], AbstractReturnHomeManager):
    """Climbs to a height, unless the drone is higher already, and flies back over the home point.

    A drone that is over the home point already has nothing to climb for, and only centres itself.
    """

    def validate(self, goal: Goal[ReturnHomeInputs]) -> str | None:
        return refusal((*HOME, goal.inputs.height))

    def on_dispatch(self, goal: Goal[ReturnHomeInputs]) -> None:
        here = self.here
        self._climbing = self._distance() > OVER_HOME
        self._height = max(here.z, goal.inputs.height) if self._climbing else here.z
        above = (here.x, here.y) if self._climbing else HOME
        self.fly_to(goal, nearest_inside((*above, self._height)), goal.inputs.speed, Nose.FREE)

    def progress(self, goal: Goal[ReturnHomeInputs]) -> ReturnHomeFeedback:
        return ReturnHomeFeedback(distance=self._distance())

    def arrived(self, goal: Goal[ReturnHomeInputs]) -> None:
        if self._climbing:
            self._climbing = False
            self.fly_to(goal, nearest_inside((*HOME, self._height)), goal.inputs.speed, Nose.ALONG_TRACK)
        else:
            self.terminated_ARRIVED(goal.id)

    def blocked(self, goal: Goal[ReturnHomeInputs], obstacle_distance: float | None) -> None:
        self.terminated_ABORTED(goal.id)

    def aborted(self, goal: Goal[ReturnHomeInputs]) -> None:
        self.terminated_ABORTED(goal.id)

    def _distance(self) -> float:
        """From the drone to the home point, over the ground [m]."""
        return hypot(self.here.x - HOME[0], self.here.y - HOME[1])
