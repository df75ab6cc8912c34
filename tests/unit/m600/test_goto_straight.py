"""The manager of `goto_straight`."""

from __future__ import annotations

from drone import Drone
from goto_cases import TARGET, GotoCases

from skillwing.m600.skills.goto_straight import GotoStraightManager
from skillwing.onboard.topics.guidance import YawMode


class TestGotoStraight(GotoCases):
    manager = GotoStraightManager
    nose = YawMode.ALONG_TRACK

    def test_blocked_for_want_of_a_view_it_says_so(self, drone: Drone) -> None:
        drone.layer.blocked_at, drone.layer.body.text = 4.0, "no view of the way ahead for 3 s"
        reason = "The skill ended with BLOCKED: no view of the way ahead for 3 s."
        drone.start(target=TARGET).assert_ended("S_BLOCKED", reason=reason)
        drone.layer.body.text = ""
        drone.start(target=TARGET).assert_ended("S_BLOCKED", reason="The skill ended with BLOCKED.")
