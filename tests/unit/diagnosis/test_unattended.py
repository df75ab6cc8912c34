"""A robot is left alone where nobody should leave it, and nobody commands it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.client.connection import Target
from skillwing.services.diagnosis.unattended import unattended_state
from skillwing.services.names import CLIENT, MISSION

M600 = ROBOT.load_skillset()
DRONE = Target("m600", "", ROBOT.skillset, "robot", rescue_goal=ROBOT.rescue_goal)
AT_REST = {resource.name: resource.initial for resource in M600.resources}
HOVERS = AT_REST | {"flight_status": "IN_AIR", "SDK_authority": "AVAILABLE"}


def test_a_drone_that_hovers_without_a_commander_is_to_be_landed() -> None:
    found = unattended_state(DRONE, M600, HOVERS, {"resource_manager"}, ())
    assert found is not None
    assert (found.resource, found.state, found.ends_with) == ("flight_status", "IN_AIR", "land")
    assert found.what == "m600 is in the air, and nobody commands it."
    assert "`skillwing start land`" in found.remedy


def test_a_skill_that_only_looks_commands_nobody() -> None:
    maps = HOVERS | {"slam_status": "RUNNING"}
    assert unattended_state(DRONE, M600, maps, (), ["lidar_mapping"])


@pytest.mark.parametrize(
    ("changed", "alive", "running"),
    [
        ({"flight_status": "ON_GROUND"}, (), ()),
        ({"axes_authority": "USED"}, (), ["goto"]),
        ({"axes_authority": "USED", "heading_authority": "USED"}, (), ["land"]),
        # The safety pilot has it.
        ({"SDK_authority": "UNAVAILABLE"}, (), ()),
        ({}, [MISSION], ()),
        ({}, [f"{CLIENT}script-1"], ()),
    ],
)
def test_somebody_has_hold_of_it_or_it_may_stay_there(
    changed: dict[str, str], alive: list[str], running: list[str]
) -> None:
    assert unattended_state(DRONE, M600, HOVERS | changed, alive, running) is None


def test_of_a_manager_with_another_skillset_nothing_is_said() -> None:
    assert unattended_state(DRONE, M600, {"flight_status": "IN_AIR"}, (), ()) is None


def test_a_robot_without_a_rescue_goal_may_be_left_anywhere() -> None:
    assert unattended_state(replace(DRONE, rescue_goal=None), M600, HOVERS, (), ()) is None
