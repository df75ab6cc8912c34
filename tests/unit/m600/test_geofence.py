"""The fence that skills check against is the one that guidance enforces and missions plan in."""

from __future__ import annotations

import math

import pytest

from skillwing.bt_missions.missions.mapping import MappingOptions
from skillwing.m600.geofence import HIGH, LOW, nearest_inside, refusal
from skillwing.sim_mujoco.geofence import COURTYARD_FENCE
from skillwing.sim_mujoco.guidance.core import HIGHEST, LOWEST
from skillwing.sim_mujoco.topics import Vector3


def test_it_is_the_box_that_guidance_enforces() -> None:
    fence = COURTYARD_FENCE
    assert (*fence.low[:2], max(fence.low[2], LOWEST)) == LOW
    assert (*fence.high[:2], min(fence.high[2], HIGHEST)) == HIGH


def test_detours_of_the_mapping_mission_stay_inside() -> None:
    area = MappingOptions().area
    assert area is not None
    west, south, east, north = area
    assert LOW[0] < west < east < HIGH[0]
    assert LOW[1] < south < north < HIGH[1]


@pytest.mark.parametrize("target", [LOW, HIGH, (0.0, 0.0, 5.0)])
def test_what_lies_inside_is_not_refused(target: Vector3) -> None:
    assert refusal(target) is None
    assert nearest_inside(target) == target


@pytest.mark.parametrize("target", [(300.0, 0.0, 4.0), (0.0, -12.1, 4.0), (0.0, 0.0, 0.5), (math.nan, 0.0, 4.0)])
def test_what_lies_outside_is_refused_with_a_sentence(target: Vector3) -> None:
    assert "lies outside the geofence. Stay between" in (refusal(target) or "")


def test_the_nearest_place_inside_is_not_refused() -> None:
    assert nearest_inside((300.0, -13.0, 0.5)) == (42.0, -12.0, 1.0)
