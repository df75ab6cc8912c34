"""A robot is left alone where nobody should leave it, and nobody commands it."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.dsl import load
from skillwing.m600.robot import ROBOT
from skillwing.services.client.connection import Target
from skillwing.services.diagnosis.unattended import unattended_states
from skillwing.services.names import CLIENT, MISSION

M600 = ROBOT.load_skillset()
DRONE = Target("m600", "", ROBOT.skillset, "robot", not_to_be_left=ROBOT.not_to_be_left)
AT_REST = {resource.name: resource.initial for resource in M600.resources}
HOVERS = AT_REST | {"flight_status": "IN_AIR", "SDK_authority": "AVAILABLE"}


def test_a_drone_that_hovers_without_a_commander_is_to_be_landed() -> None:
    (found,) = unattended_states(DRONE, M600, HOVERS, {"resource_manager"}, ())
    assert (found.resource, found.state, found.ends_with) == ("flight_status", "IN_AIR", ("land",))
    assert found.what == "m600 is in the air, and nobody commands it."
    assert "`skillwing start land`" in found.remedy


def test_a_skill_that_only_looks_commands_nobody() -> None:
    maps = HOVERS | {"slam_status": "RUNNING"}
    assert unattended_states(DRONE, M600, maps, (), ["lidar_mapping"])


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
    assert unattended_states(DRONE, M600, HOVERS | changed, alive, running) == ()


def test_of_a_manager_with_another_skillset_nothing_is_said() -> None:
    assert unattended_states(DRONE, M600, {"flight_status": "IN_AIR"}, (), ()) == ()


def test_where_no_skill_is_known_to_end_it_any_goal_is_a_commander(tmp_path: Path) -> None:
    file = tmp_path / "kite.skillset"
    file.write_text(
        "skillset kite { resource place { initial DOWN  extern DOWN -> UP  extern UP -> DOWN }"
        " skill reel { result { success DONE } } }"
    )
    kite = Target("kite", "", file, "wall", not_to_be_left={"place": {"UP": "up there"}})
    (found,) = unattended_states(kite, load(file), {"place": "UP"}, (), ())
    assert (found.what, found.ends_with) == ("kite is up there, and nobody commands it.", ())
    assert unattended_states(kite, load(file), {"place": "UP"}, (), ["reel"]) == ()
