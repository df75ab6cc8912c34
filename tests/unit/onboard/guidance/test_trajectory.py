"""Speed profiles: continuous, within their limits, and ending where they should."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import Vector, add, cross, dot, norm, scale, subtract
from skillwing.onboard.guidance.arc import MAX_CENTRIPETAL
from skillwing.onboard.guidance.trajectory import (
    ACCELERATION,
    BRAKING,
    JOINING_SPEED,
    WIDEST_TURN,
    Blend,
    Segment,
    braking,
    continued,
    joined,
    onward,
    straight,
    trapezoid,
)

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


shares = st.floats(0.0, 1.0)
turns = st.floats(-math.pi, math.pi)
MAX_ACCELERATION = math.hypot(BRAKING, MAX_CENTRIPETAL)
"""Acceleration in the early stop of an orbit [m/s2]."""
CUT = 0.25
"""Largest distance of a blend from the way over its corner [m]."""


@st.composite
def blends(draw: st.DrawFn) -> Blend:
    """A braking drone whose next leg begins at the time 5.0, at any angle up to the widest."""
    (heading, climb), roll = draw(st.tuples(turns, st.floats(-1.5, 1.5))), draw(turns)
    ahead = (math.cos(heading) * math.cos(climb), math.sin(heading) * math.cos(climb), math.sin(climb))
    level = (-math.sin(heading), math.cos(heading), 0.0)
    aside = add(scale(math.cos(roll), level), scale(math.sin(roll), cross(ahead, level)))
    angle = draw(st.floats(0.0, WIDEST_TURN - 1e-4))
    way = add(scale(math.cos(angle), ahead), scale(math.sin(angle), aside))
    before = Segment(draw(points), ahead, braking(draw(st.floats(0.1, JOINING_SPEED - 1e-6))), 5.0)
    leg = straight(before.end, add(before.end, scale(draw(st.floats(1.3, 80.0)), way)), draw(speeds), 5.0)
    blend = joined(before, leg)
    assert blend is not None
    return blend


def times_of(blend: Blend, count: int = 30) -> list[float]:
    """Times up to the end of a blend, most of them before its two legs are one."""
    corner = 5.0 + blend.braking.profile.duration
    last = max(corner, blend.began + blend.profile.duration)
    return [*np.linspace(5.0, corner, count).tolist(), *np.linspace(corner, last, 10).tolist()]


def from_line(place: Vector, a: Vector, b: Vector) -> float:
    """Distance of a place from the line between two others."""
    way, off = subtract(b, a), subtract(place, a)
    share = min(max(dot(off, way) / max(dot(way, way), 1e-12), 0.0), 1.0)
    return norm(subtract(off, scale(share, way)))


@given(blends(), shares)
def test_a_blend_has_no_jump_and_keeps_the_limits(blend: Blend, share: float) -> None:
    (p0, v0, _), (p1, v1, _) = blend.braking.at(5.0), blend.at(5.0)
    assert norm(subtract(p0, p1)) < 1e-9
    assert v0 == v1
    top = max(norm(v0), *(norm(blend.onward.at(t)[1]) for t in times_of(blend)))
    for t in [*times_of(blend), 5.0 + share]:
        (p0, v0, a), (p1, v1, _) = blend.at(t), blend.at(t + STEP)
        assert norm(a) <= MAX_ACCELERATION + 1e-9
        assert norm(v0) <= top + 1e-9
        assert norm(subtract(v1, v0)) <= MAX_ACCELERATION * STEP + 1e-9
        mean = scale(0.5 * STEP, add(v0, v1))
        assert norm(subtract(subtract(p1, p0), mean)) <= 2.0 * MAX_ACCELERATION * STEP**2
    assert norm(subtract(blend.at(1e5)[0], blend.onward.end)) < 1e-6
    assert blend.is_over(max(times_of(blend)) + 1e-6)


@given(blends())
def test_a_blend_stays_inside_the_triangle_of_its_legs_and_near_the_corner(blend: Blend) -> None:
    corner, before, after = blend.braking.end, blend.braking.direction, blend.onward.direction
    back, length = blend.braking.profile.distance, blend.onward.profile.distance
    for t in times_of(blend):
        place = blend.at(t)[0]
        left = back - blend.braking.profile.at(t - 5.0)[0]
        flown = blend.onward.profile.at(t - 5.0)[0]
        # Barycentric: both coordinates along the legs are positive, and their sum is 1 at most.
        assert norm(subtract(place, add(corner, subtract(scale(flown, after), scale(left, before))))) < 1e-6
        assert -1e-9 <= left <= back + 1e-9
        assert -1e-9 <= flown <= length + 1e-6
        on_way = min(from_line(place, blend.braking.start, corner), from_line(place, corner, blend.end))
        assert on_way <= CUT


@given(blends())
def test_a_blend_keeps_half_of_its_speed(blend: Blend) -> None:
    first = norm(blend.at(5.0)[1])
    reached = ACCELERATION / BRAKING * first
    top = max(v for _, v, _ in (blend.onward.profile.at(t - 5.0) for t in times_of(blend)))
    assume(top >= reached - 1e-9)
    corner = 5.0 + blend.braking.profile.duration
    assert min(norm(blend.at(float(t))[1]) for t in np.linspace(5.0, corner, 60)) >= 0.499 * first


@given(blends(), shares, shares)
def test_a_stop_in_a_blend_ends_on_the_next_leg_within_its_stopping_distance(
    blend: Blend, share: float, later: float
) -> None:
    t = 5.0 + share * blend.braking.profile.duration
    stop = blend.broken_off(t)
    (p0, v0, _), (p1, v1, _) = blend.at(t), stop.at(t)
    assert norm(subtract(p0, p1)) < 1e-9
    assert norm(subtract(v0, v1)) < 1e-9
    again = stop.broken_off(t + later)
    assert norm(subtract(stop.end, again.end)) < 1e-6
    duration = blend.stopping_speed(t) / BRAKING
    flown, place = 0.0, p0
    for step in np.linspace(t, t + duration, 100):
        here, velocity, acceleration = stop.at(float(step))
        flown, place = flown + norm(subtract(here, place)), here
        assert norm(acceleration) <= BRAKING + 1e-9
        assert norm(velocity) <= blend.stopping_speed(t) + 1e-9
        on_way = min(
            from_line(here, blend.braking.start, blend.braking.end), from_line(here, blend.braking.end, stop.end)
        )
        assert on_way <= CUT
    assert flown <= blend.stopping_speed(t) ** 2 / (2.0 * BRAKING) + 1e-6
    assert norm(stop.at(t + duration + 1e-6)[1]) < 1e-6
    assert stop.is_over(t + duration + 1e-6)
    assert from_line(stop.end, blend.braking.end, add(blend.braking.end, scale(99.0, blend.onward.direction))) < 1e-6


def test_legs_are_not_joined_at_speed_or_for_a_way_back_or_a_short_one() -> None:
    for speed, target, joins in [
        (JOINING_SPEED, (1.0, 9.0, 0.0), True),
        (JOINING_SPEED + 0.01, (1.0, 9.0, 0.0), False),
        (JOINING_SPEED, (1.0, 1.0, 0.0), False),
        (1.0, (-9.0, 1.0, 0.0), False),
        (1.0, (-9.0, 0.0, 0.0), False),
    ]:
        path = Segment((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), braking(speed), 0.0)
        assert (joined(path, straight(path.end, target, 2.0, 0.0)) is not None) is joins, (speed, target)
