"""What the skills that fly somewhere have in common."""

from __future__ import annotations

from abc import abstractmethod

from skillwing.m600.generated.types import Position
from skillwing.m600.geofence import Geofence
from skillwing.m600.skills.guidance_client import Axis, GuidanceClient
from skillwing.m600.skills.position_tracker import Whereabouts
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import AxisStatus, FlyTo, MotionState, YawMode
from skillwing.services.managers.hooks import F, I, O
from skillwing.services.managers.skill_manager import Goal, SkillHooks
from skillwing.services.protocol import Terminal


class MotionManager(SkillHooks[I, O, F]):
    """Flies to one point after another. A skill says in `on_dispatch` where to, and in the three callbacks what the
    end of a leg means to it; all of them are called with the drone at rest."""

    def setup(self) -> None:
        self.guidance = GuidanceClient(self, Axis.BODY, self._on_guidance)
        self.whereabouts = Whereabouts(self)
        self.fence = Geofence(self.bus)

    def fly_to(self, goal: Goal[I], target: Vector3, speed: float, nose: YawMode) -> None:
        """Fly to a point (ENU, m) at most at `speed` (m/s)."""
        self.whereabouts.follow()
        self.guidance.fly(goal, FlyTo(target=target, speed=speed, nose=nose))

    @property
    def here(self) -> Position:
        """Where the drone is; the origin before the goal's first navigation solution."""
        x, y, z = self.whereabouts.position or (0.0, 0.0, 0.0)
        return Position(x=x, y=y, z=z)

    @abstractmethod
    def arrived(self, goal: Goal[I]) -> None: ...

    @abstractmethod
    def blocked(self, goal: Goal[I], obstacle_distance: float | None) -> None:
        """Something stands on the way, so many metres ahead if it was seen."""

    @abstractmethod
    def aborted(self, goal: Goal[I]) -> None: ...

    def on_interrupt(self, goal: Goal[I]) -> None:
        self.guidance.stop(goal)

    def on_ended(self, goal: Goal[I], terminal: Terminal) -> None:
        self.whereabouts.rest()
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
    """A position of the skillset as the functional layer writes it."""
    return position.x, position.y, position.z
