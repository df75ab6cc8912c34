"""Base of the managers of skills that fly to points."""

from __future__ import annotations

from abc import abstractmethod

from skillwing.m600.generated.types import Position
from skillwing.m600.geofence import GeofenceChecker
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.position_tracker import PositionTracker
from skillwing.m600.skills.view_loss import ViewLoss
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import AxisStatus, FlyTo, MotionState, YawMode
from skillwing.services.managers.hooks import F, I, O
from skillwing.services.managers.skill_manager import Goal, SkillHooks
from skillwing.services.protocol import Terminal


class MotionManager(SkillHooks[I, O, F]):
    """Flight to one point after another. A skill gives the points in `on_dispatch`, and handles the end of a leg in
    `arrived`, `blocked` or `aborted`, with the drone at rest."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance, ViewLoss(self.bus))
        self.tracker = PositionTracker(self)
        self.fence = GeofenceChecker(self.bus)

    def fly_to(self, goal: Goal[I], target: Vector3, speed: float, yaw: YawMode) -> None:
        """Fly to a point (ENU, m) at most at `speed` (m/s)."""
        self.tracker.follow()
        self.guidance.fly(goal, FlyTo(target=target, speed=speed, nose=yaw))

    @property
    def here(self) -> Position:
        """The drone's position; the origin before the goal's first navigation solution."""
        x, y, z = self.tracker.position or (0.0, 0.0, 0.0)
        return Position(x=x, y=y, z=z)

    @abstractmethod
    def arrived(self, goal: Goal[I]) -> None: ...

    @abstractmethod
    def blocked(self, goal: Goal[I], obstacle_distance: float | None) -> None:
        """An obstacle is on the way, `obstacle_distance` metres ahead if a sensor saw it."""

    @abstractmethod
    def aborted(self, goal: Goal[I]) -> None: ...

    def on_interrupt(self, goal: Goal[I]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[I], terminal: Terminal) -> None:
        self.tracker.rest()
        self.guidance.release(goal)

    def _on_guidance(self, goal: Goal[I], axis: AxisStatus) -> None:
        match axis.state:
            case MotionState.DONE:
                self.arrived(goal)
            case MotionState.BLOCKED:
                self.blocked(goal, self.guidance.free_distance)
            case MotionState.ABORTED:
                self.aborted(goal)
            case _:
                pass


def point(position: Position) -> Vector3:
    """A position of the skillset in the functional layer's form."""
    return position.x, position.y, position.z
