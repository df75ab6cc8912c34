"""A robot on mocks keeps what its missions need."""

from __future__ import annotations

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.mocking.system import mock_processes, mocked, without_layer
from skillwing.services.names import MOCKED_WORLD
from skillwing.services.robot import Robot


@pytest.mark.parametrize("robot", [without_layer(ROBOT), mocked(ROBOT)], ids=["up --mock", "m600-mocks"])
def test_missions_of_a_mocked_robot_are_checked_as_those_of_the_real_one(robot: Robot) -> None:
    assert robot.rescue_goal == ROBOT.rescue_goal
    assert robot.mission_templates == ROBOT.mission_templates
    assert (robot.clock, robot.judge, robot.functional_layer({})) == ("wall", None, ())


def test_a_world_is_mocked_for_some_skills_on_request() -> None:
    def names(*, world: bool) -> set[str]:
        return {spec.name for spec in mock_processes(ROBOT, skills=["takeoff"], world=world)}

    assert MOCKED_WORLD not in names(world=False)
    assert names(world=True) == names(world=False) | {MOCKED_WORLD}
