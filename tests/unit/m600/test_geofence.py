"""Skills check targets against the fence that guidance publishes and enforces."""

from __future__ import annotations

import math

import pytest
from m600_layer import FENCE

from skillwing.bt_missions.missions.mapping import MappingMissionOptions
from skillwing.m600.geofence import GeofenceChecker
from skillwing.onboard.guidance.node import make_guidance
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import GEOFENCE
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import encode


@pytest.fixture
def fence() -> GeofenceChecker:
    """Fence of a manager that starts after guidance."""
    network = InProcessNetwork()
    network.bus("guidance").advertise(GEOFENCE, events=True).put(encode(FENCE))
    fence = GeofenceChecker(network.bus("manager"))
    network.run_for(0.1)
    return fence


def test_guidance_tells_the_fence_that_it_was_given_without_the_ground_and_its_margin() -> None:
    network = InProcessNetwork()
    network.attach(make_guidance({"geofence": {"low": [-5, -6, -1], "high": [50, 60, 25]}}))
    fence = GeofenceChecker(network.bus("manager"))
    network.run_for(0.1)
    assert fence.ceiling == 24.5
    assert fence.refusal((49.5, 59.5, 1.0)) is None
    assert "Stay between (-4.5, -5.5, 1) and (49.5, 59.5, 24.5)" in (fence.refusal((49.6, 59.5, 1.0)) or "")


def test_detours_of_the_mapping_mission_stay_inside() -> None:
    area = MappingMissionOptions().area
    assert area is not None
    west, south, east, north = area
    assert FENCE.low[0] < west < east < FENCE.high[0]
    assert FENCE.low[1] < south < north < FENCE.high[1]


@pytest.mark.parametrize("target", [FENCE.low, FENCE.high, (0.0, 0.0, 5.0)])
def test_what_lies_inside_is_not_refused(fence: GeofenceChecker, target: Vector3) -> None:
    assert fence.refusal(target) is None
    assert fence.nearest_inside(target) == target


@pytest.mark.parametrize("target", [(300.0, 0.0, 4.0), (0.0, -12.1, 4.0), (0.0, 0.0, 0.5), (math.nan, 0.0, 4.0)])
def test_what_lies_outside_is_refused_with_a_sentence(fence: GeofenceChecker, target: Vector3) -> None:
    assert "lies outside the geofence. Stay between" in (fence.refusal(target) or "")


def test_the_nearest_place_inside_is_not_refused(fence: GeofenceChecker) -> None:
    assert fence.nearest_inside((300.0, -13.0, 0.5)) == (42.0, -12.0, 1.0)


def test_before_guidance_has_spoken_everything_is_left_to_it() -> None:
    fence = GeofenceChecker(InProcessNetwork().bus("manager"))
    assert fence.refusal((300.0, 0.0, 4.0)) is None
    assert fence.nearest_inside((300.0, 0.0, 4.0)) == (300.0, 0.0, 4.0)
