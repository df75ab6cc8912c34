"""Speed profiles: continuous, within their limits, and ending where they should."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import norm, subtract
from skillwing.onboard.guidance.trajectory import ACCELERATION, BRAKING, continued, onward, straight, trapezoid

distances = st.floats(0.0, 200.0)
speeds = st.floats(0.05, 6.0)
coordinates = st.floats(-50.0, 50.0)
points = st.tuples(coordinates, coordinates, coordinates)
STEP = 0.01


@given(distances, speeds)
def test_a_trapezoid_ends_at_rest_at_its_distance_and_keeps_its_limits(distance: float, speed: float) -> None:
    profile = trapezoid(distance, speed)
    s, v, a = profile.at(profile.duration + 1.0)
    assert s == pytest.approx(distance, abs=1e-6)
    assert v == a == 0.0
    for t in np.linspace(0.0, profile.duration, 50):
        s, v, a = profile.at(float(t))
        assert -1e-9 <= s <= distance + 1e-6
        assert -1e-6 <= v <= speed + 1e-9
        assert abs(a) <= ACCELERATION + 1e-9


@given(distances, speeds, st.floats(0.0, 1.0))
def test_position_and_speed_are_continuous(distance: float, speed: float, share: float) -> None:
    profile = trapezoid(distance, speed)
    t = share * profile.duration
    (s0, v0, _), (s1, v1, _) = profile.at(t), profile.at(t + STEP)
    assert abs(v1 - v0) <= ACCELERATION * STEP + 1e-6
    assert s1 - s0 == pytest.approx(0.5 * (v0 + v1) * STEP, abs=ACCELERATION * STEP**2)


@given(points, points, speeds, st.floats(0.0, 1.0))
def test_breaking_off_continues_smoothly_and_stops_on_the_way(
    start: tuple[float, float, float], target: tuple[float, float, float], speed: float, share: float
) -> None:
    segment = straight(start, target, speed, t=10.0)
    t = 10.0 + share * segment.profile.duration
    broken = segment.broken_off(t)
    (p0, v0, _), (p1, v1, _) = segment.at(t), broken.at(t)
    assert norm(subtract(p0, p1)) < 1e-9
    assert norm(subtract(v0, v1)) < 1e-6
    assert broken.profile.distance == pytest.approx(norm(v0) ** 2 / (2 * BRAKING), abs=1e-6)
    assert norm(subtract(broken.end, start)) <= norm(subtract(target, start)) + 1e-6


@given(points, points, speeds)
def test_a_segment_ends_at_its_target(
    start: tuple[float, float, float], target: tuple[float, float, float], speed: float
) -> None:
    segment = straight(start, target, speed, t=0.0)
    assert math.dist(segment.end, target) < 1e-6
    assert segment.is_over(segment.profile.duration)


@given(distances, speeds, speeds)
def test_going_on_keeps_the_limits_and_ends_at_rest(distance: float, initial: float, speed: float) -> None:
    profile = onward(initial, distance, speed)
    assert (profile is None) == (distance < initial**2 / (2 * ACCELERATION))
    if profile is None:
        return
    assert profile.at(0.0)[:2] == (0.0, initial)
    assert profile.distance == pytest.approx(distance, abs=1e-6)
    for t in np.linspace(0.0, profile.duration, 50):
        _, v, a = profile.at(float(t))
        assert -1e-6 <= v <= max(initial, speed) + 1e-9
        assert -BRAKING - 1e-9 <= a <= ACCELERATION + 1e-9


@given(points, points, speeds, speeds, st.floats(0.0, 0.9), st.floats(0.3, 3.0))
def test_a_new_target_straight_ahead_is_flown_to_without_a_jump(
    start: tuple[float, float, float],
    target: tuple[float, float, float],
    speed: float,
    new_speed: float,
    share: float,
    stretch: float,
) -> None:
    segment = straight(start, target, speed, t=10.0)
    t = 10.0 + share * segment.profile.duration
    x, y, z = (a + stretch * (b - a) for a, b in zip(start, target, strict=True))
    further = continued(segment, (x, y, z), new_speed, t)
    if further is None:
        return
    (p0, v0, _), (p1, v1, _) = segment.at(t), further.at(t)
    assert norm(subtract(p0, p1)) < 1e-9
    assert norm(subtract(v0, v1)) < 1e-3 * max(1.0, norm(v0))
    assert norm(subtract(further.end, (x, y, z))) < 1e-5


def test_no_other_target_is_flown_to_without_a_stop() -> None:
    segment = straight((0.0, 0.0, 0.0), (20.0, 0.0, 0.0), 2.0, t=0.0)
    assert continued(segment, (12.0, 0.0, 0.0), 2.0, 4.0) is not None
    for target in ((12.0, 1.0, 0.0), (12.0, 0.0, 1.0), (0.0, 0.0, 0.0), (6.0, 0.0, 0.0)):
        assert continued(segment, target, 2.0, 4.0) is None, target
