"""Common cases of `goto` and `goto_straight`, which differ in the heading only."""

from __future__ import annotations

from typing import Any, ClassVar

import msgspec
import pytest
from drone import Drone

from skillwing.onboard.topics.guidance import GUIDANCE_COMMAND, FlyTo, GuidanceCommand, YawMode
from skillwing.services.core.refusal import RefusedError
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.protocol import ErrorCode

TARGET = {"x": 10.0, "y": 0.0, "z": 5.0}


class GotoCases:
    """Cases for subclasses, which set the manager's class and its yaw mode."""

    manager: ClassVar[type[SkillHooks[Any, Any, Any]]]
    nose: ClassVar[YawMode]

    @pytest.fixture
    def drone(self) -> Drone:
        return Drone(self.manager, height=5.0)

    def test_arrives_and_says_where(self, drone: Drone) -> None:
        goal = drone.start(target=TARGET, speed=2.0)
        drone.run(2.0)
        assert 5.0 < goal.progress.distance < 9.0
        goal.assert_ended("S_ARRIVED")
        assert msgspec.to_builtins(goal.output.stopped_at) == pytest.approx(TARGET, abs=0.2)

    def test_the_nose_goes_where_it_should(self, drone: Drone) -> None:
        drone.start(target=TARGET, speed=5.0).assert_ended("S_ARRIVED")
        motion = drone.layer.commands[0].motion
        assert isinstance(motion, FlyTo)
        assert motion.nose is self.nose

    def test_blocked_it_says_where_it_stands_and_how_far_the_obstacle_is(self, drone: Drone) -> None:
        drone.layer.blocked_at, drone.layer.free_distance = 4.0, 2.2
        drone.layer.body.text = "an obstacle stands on the way"
        goal = drone.start(target=TARGET)
        goal.assert_ended("S_BLOCKED", success=False, reason="an obstacle stands on the way")
        assert goal.output.stopped_at.x == pytest.approx(6.0, abs=0.2)
        assert goal.output.obstacle_distance == pytest.approx(2.2)

    def test_blocked_by_something_unseen_it_invents_no_distance(self, drone: Drone) -> None:
        drone.layer.blocked_at = 4.0
        drone.start(target=TARGET).assert_ended("S_BLOCKED", output={"obstacle_distance": 1000.0})

    def test_is_aborted_when_guidance_gives_up(self, drone: Drone) -> None:
        drone.layer.aborts, drone.layer.body.text = True, "the drone has left the geofence"
        goal = drone.start(target=TARGET)
        goal.assert_ended("S_ABORTED", reason="The skill ended with ABORTED: the drone has left the geofence.")
        assert goal.causes == ["guidance ABORTED", f"{goal.handle.skill} S_ABORTED"]

    def test_the_pilot_ends_it_by_an_invariant_whichever_report_comes_first(self, drone: Drone) -> None:
        for guidance_first, apart in ((True, 0.0), (True, 0.9), (False, 0.0), (False, 0.9)):
            goal = drone.start(target=TARGET)
            drone.run(1.0)
            for step in (guidance_first, not guidance_first):
                if step:
                    drone.layer.hears_of_pilot = True
                else:
                    drone.layer.authority = False
                drone.run(apart)
            goal.assert_ended("RI")
            assert goal.causes[:2] == ["safety pilot UNAVAILABLE", "SDK_authority UNAVAILABLE"]
            drone.layer.hears_of_pilot, drone.layer.authority = False, True
            drone.run(0.5)

    def test_the_pilot_ends_it_also_if_only_guidance_hears_of_him(self, drone: Drone) -> None:
        goal = drone.start(target=TARGET)
        drone.run(1.0)
        drone.layer.hears_of_pilot = True
        drone.run(0.9)
        goal.assert_running()
        goal.assert_ended("S_ABORTED", within=0.5)
        assert goal.causes == ["guidance ABORTED", f"{goal.handle.skill} S_ABORTED"]
        [told] = [record for record in drone.history.records if record.subject == "guidance"]
        assert told.text == "the safety pilot has taken over"

    def test_a_target_outside_the_geofence_is_not_valid(self, drone: Drone) -> None:
        sentence = "The target (300, 0, 4) lies outside the geofence. Stay between (-12, -12, 1)"
        drone.start(target={"x": 300.0, "y": 0.0, "z": 4.0}).assert_ended("NV", reason=sentence)
        assert drone.layer.commands == []

    def test_what_guidance_refuses_ends_with_its_sentences(self, drone: Drone) -> None:
        def refuse(command: GuidanceCommand) -> GuidanceCommand:
            raise RefusedError(ErrorCode.NOT_ALLOWED, "the target lies outside the geofence", help="stay inside")

        drone.layer.answer(GUIDANCE_COMMAND, GuidanceCommand, refuse)
        sentences = "The target lies outside the geofence. Stay inside."
        drone.start(target=TARGET).assert_ended("ERROR", reason=sentences)

    def test_a_critical_battery_ends_it_and_stops_the_drone(self, drone: Drone) -> None:
        goal = drone.start(target=TARGET, speed=0.5)
        drone.layer.percent = 10.0
        goal.assert_ended("RI", within=5.0, invariant="charged")
        assert drone.layer.motions[-1] == "Stop"
