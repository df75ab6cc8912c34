"""The manager of `goto_straight`."""

from __future__ import annotations

from typing import Any

from drone import Drone
from goto_cases import TARGET, GotoCases

from skillwing.m600.skills.goto_straight import GotoStraightManager
from skillwing.m600.skills.guidance_client import CAUSE_PATIENCE
from skillwing.m600.skills.zed_depthmap import ZedDepthmapManager
from skillwing.onboard.topics.guidance import MotionState, YawMode
from skillwing.onboard.topics.sensors import SensorStatus
from skillwing.services.testing.goal import GoalUnderTest


class TestGotoStraight(GotoCases):
    manager = GotoStraightManager
    nose = YawMode.ALONG_TRACK

    def test_blocked_for_want_of_a_view_it_says_so(self, drone: Drone) -> None:
        drone.layer.blocked_at, drone.layer.body.text = 4.0, "no view of the way ahead for 3 s"
        reason = "The skill ended with BLOCKED: no view of the way ahead for 3 s."
        drone.start(target=TARGET).assert_ended("S_BLOCKED", reason=reason)
        drone.layer.body.text = ""
        drone.start(target=TARGET).assert_ended("S_BLOCKED", reason="The skill ended with BLOCKED.")

    def test_blocked_for_want_of_a_view_it_names_the_camera_that_failed(self) -> None:
        goal = blocked_after_a_blackout(no_view=True)
        assert goal.causes[:3] == ["zed FAILED", "zed_status FAILED", "zed_depthmap.zed_ok VIOLATED"]
        assert goal.causes[3:] == ["depthmap_source NONE", "guidance BLOCKED", "goto_straight S_BLOCKED"]

    def test_the_camera_is_named_also_if_its_failure_comes_after_the_report(self) -> None:
        drone = with_depth_map()
        drone.start_skill("zed_depthmap")
        drone.layer.blocked_at, drone.layer.body.no_view = 4.0, True
        goal = drone.start(target=TARGET)
        drone.run_until(lambda: drone.layer.body.state is MotionState.BLOCKED)
        drone.run(CAUSE_PATIENCE / 2)
        assert not goal.done
        drone.layer.report_health("zed", SensorStatus.FAILED, "zed-failed")
        goal.assert_ended("S_BLOCKED")
        assert goal.causes[:2] == ["zed FAILED", "zed_status FAILED"]

    def test_blocked_by_an_obstacle_it_does_not_name_the_camera(self) -> None:
        assert blocked_after_a_blackout(no_view=False).causes == ["guidance BLOCKED", "goto_straight S_BLOCKED"]

    def test_blocked_for_want_of_a_view_without_a_known_loss_it_names_none(self) -> None:
        """The depth map has ended before the goal, which has nothing to do with it."""
        drone = with_depth_map()
        drone.start_skill("zed_depthmap").interrupt().assert_ended("IT")
        drone.layer.blocked_at, drone.layer.body.no_view = 4.0, True
        goal = drone.start(target=TARGET)
        goal.assert_ended("S_BLOCKED")
        assert goal.causes == ["guidance BLOCKED", "goto_straight S_BLOCKED"]


def with_depth_map() -> Drone[Any, Any, Any]:
    return Drone(GotoStraightManager, [ZedDepthmapManager], height=5.0)


def blocked_after_a_blackout(*, no_view: bool) -> GoalUnderTest[Any, Any]:
    drone = with_depth_map()
    depth_map = drone.start_skill("zed_depthmap")
    drone.layer.blocked_at, drone.layer.body.no_view = 4.0, no_view
    goal = drone.start(target=TARGET)
    drone.run(1.0)
    drone.layer.report_health("zed", SensorStatus.FAILED, "zed-failed")
    depth_map.assert_ended("RI")
    goal.assert_ended("S_BLOCKED")
    return goal
