# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Typed access to the skills of `m600`."""

from __future__ import annotations

from skillwing.services.client.interface import GoalHandle, SkillsetInterface

from .types import Position


class M600Skills:
    """Starts skills through an interface; each method returns the goal at once, still to be answered.

    goal_id: the interface chooses one unless given. cause: the timeline record that leads here.
    Raises InvalidInputError for a value of a wrong type.
    """

    def __init__(self, interface: SkillsetInterface) -> None:
        self._interface = interface

    def takeoff(
        self,
        *,
        height: float = 5.0,
        speed: float = 1.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `takeoff`. height: [m] in 1.0..50.0; speed: [m/s] in 0.1..3.0."""
        inputs = {"height": height, "speed": speed}
        return self._interface.start("takeoff", inputs, goal_id=goal_id, cause=cause)

    def land(
        self,
        *,
        speed: float = 0.7,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `land`. speed: [m/s] in 0.1..2.0."""
        inputs = {"speed": speed}
        return self._interface.start("land", inputs, goal_id=goal_id, cause=cause)

    def hover(
        self,
        *,
        duration: float = 5.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `hover`. duration: [s] in 0.0..3600.0."""
        inputs = {"duration": duration}
        return self._interface.start("hover", inputs, goal_id=goal_id, cause=cause)

    def goto(
        self,
        *,
        target: Position,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `goto`. speed: [m/s] in 0.1..5.0."""
        inputs = {"target": target, "speed": speed}
        return self._interface.start("goto", inputs, goal_id=goal_id, cause=cause)

    def goto_straight(
        self,
        *,
        target: Position,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `goto_straight`. speed: [m/s] in 0.1..5.0."""
        inputs = {"target": target, "speed": speed}
        return self._interface.start("goto_straight", inputs, goal_id=goal_id, cause=cause)

    def return_home(
        self,
        *,
        height: float = 5.0,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `return_home`. height: [m] in 1.0..50.0; speed: [m/s] in 0.1..5.0."""
        inputs = {"height": height, "speed": speed}
        return self._interface.start("return_home", inputs, goal_id=goal_id, cause=cause)

    def rotate_head(
        self,
        *,
        heading: float,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `rotate_head`. heading: [rad] in -6.3..6.3."""
        inputs = {"heading": heading}
        return self._interface.start("rotate_head", inputs, goal_id=goal_id, cause=cause)

    def lock_head(
        self,
        *,
        heading: float,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `lock_head`. heading: [rad] in -6.3..6.3."""
        inputs = {"heading": heading}
        return self._interface.start("lock_head", inputs, goal_id=goal_id, cause=cause)

    def zed_depthmap(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `zed_depthmap`."""
        return self._interface.start("zed_depthmap", {}, goal_id=goal_id, cause=cause)

    def lidar_depthmap(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `lidar_depthmap`."""
        return self._interface.start("lidar_depthmap", {}, goal_id=goal_id, cause=cause)

    def lidar_mapping(
        self,
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `lidar_mapping`."""
        return self._interface.start("lidar_mapping", {}, goal_id=goal_id, cause=cause)

    def inspect(
        self,
        *,
        center: Position,
        radius: float,
        height: float,
        laps: float = 1.0,
        speed: float = 2.0,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `inspect`.

        radius: [m] in 2.0..100.0.
        height: [m] in 1.0..50.0.
        laps: in 0.1..20.0.
        speed: [m/s] in 0.1..5.0.
        """
        inputs = {"center": center, "radius": radius, "height": height, "laps": laps, "speed": speed}
        return self._interface.start("inspect", inputs, goal_id=goal_id, cause=cause)

    def stream(
        self,
        *,
        min_fps: float = 10.0,
        min_quality: float = 0.7,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> GoalHandle:
        """Start `stream`. min_fps: [1/s] in 1.0..60.0; min_quality: in 0.0..1.0."""
        inputs = {"min_fps": min_fps, "min_quality": min_quality}
        return self._interface.start("stream", inputs, goal_id=goal_id, cause=cause)
