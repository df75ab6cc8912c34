"""Orbits: on the circle, smooth, within their limits, and as many laps as were asked for."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import norm, subtract
from skillwing.onboard.guidance.arc import MAX_CENTRIPETAL, Round, fastest_around, rim
from skillwing.onboard.guidance.heading_control import TURN_RATE
from skillwing.onboard.guidance.trajectory import ACCELERATION, BRAKING
from skillwing.onboard.topics.guidance import Orbit

STEP = 0.02
rounds = st.builds(
    Round,
    center=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    radius=st.floats(2.0, 30.0),
    laps=st.floats(0.1, 3.0),
    speed=st.floats(0.1, 5.0),
)
bearings = st.floats(-math.pi, math.pi)


def start_of(left: Round, bearing: float) -> tuple[float, float, float]:
    return left.entry((left.center[0] + math.cos(bearing), left.center[1] + math.sin(bearing), 0.0), 5.0)


@given(rounds, bearings, st.floats(0.0, 1.0))
def test_it_stays_on_the_circle_smoothly_and_within_the_limits(left: Round, bearing: float, share: float) -> None:
    arc = left.arc(start_of(left, bearing), math.inf, t=10.0)
    t = 10.0 + share * arc.profile.duration
    (p0, v0, a), (p1, v1, _) = arc.at(t), arc.at(t + STEP)
    assert math.dist(p0[:2], left.center) == pytest.approx(left.radius)
    assert p0[2] == 5.0
    assert norm(v0) <= min(left.speed, fastest_around(left.radius)) + 1e-9
    assert norm(a) <= math.hypot(ACCELERATION, MAX_CENTRIPETAL) + 1e-9
    assert norm(v0) / left.radius < TURN_RATE
    assert norm(subtract(p1, p0)) <= norm(v0) * STEP + ACCELERATION * STEP**2
    assert norm(subtract(v1, v0)) <= math.hypot(ACCELERATION, MAX_CENTRIPETAL) * STEP + 1e-6
    outwards = subtract(p0, (*left.center, 5.0))
    assert outwards[0] * v0[1] - outwards[1] * v0[0] >= -1e-9, "counter-clockwise"


@given(rounds, bearings)
def test_it_ends_where_its_laps_do(left: Round, bearing: float) -> None:
    arc = left.arc(start_of(left, bearing), math.inf, t=0.0)
    wanted = bearing + 2.0 * math.pi * left.laps
    x, y = left.center[0] + left.radius * math.cos(wanted), left.center[1] + left.radius * math.sin(wanted)
    assert math.dist(arc.end, (x, y, 5.0)) < 1e-6
    assert left.after(arc.flown(arc.profile.duration)).laps == pytest.approx(0.0, abs=1e-9)


@given(rounds, bearings, st.floats(0.0, 1.0))
def test_broken_off_it_brakes_along_the_circle_and_what_is_left_is_known(
    left: Round, bearing: float, share: float
) -> None:
    arc = left.arc(start_of(left, bearing), math.inf, t=0.0)
    t = share * arc.profile.duration
    broken = arc.broken_off(t)
    (p0, v0, _), (p1, v1, _) = arc.at(t), broken.at(t)
    assert norm(subtract(p0, p1)) < 1e-6
    assert norm(subtract(v0, v1)) < 1e-6
    assert broken.profile.distance == pytest.approx(norm(v0) ** 2 / (2 * BRAKING), abs=1e-6)
    assert math.dist(broken.end[:2], left.center) == pytest.approx(left.radius)
    rest = left.after(arc.flown(t) + broken.profile.distance)
    again = rest.arc(broken.end, math.inf, t=0.0)
    assert math.dist(again.end, arc.end) < 1e-6


@given(rounds, bearings, st.floats(0.5, 20.0))
def test_the_way_ahead_lies_on_the_circle_and_is_no_longer_than_asked(
    left: Round, bearing: float, reach: float
) -> None:
    start = start_of(left, bearing)
    corners = (start, *left.ahead(start, reach))
    assert all(math.dist(corner[:2], left.center) == pytest.approx(left.radius) for corner in corners)
    chords = [math.dist(a, b) for a, b in pairwise(corners)]
    assert max(chords) <= 1.0 + 1e-9
    assert sum(chords) <= min(reach, left.length) + 1e-6


@given(rounds, bearings)
def test_the_rim_bounds_the_circle(left: Round, bearing: float) -> None:
    orbit = Orbit(center=(*left.center, 0.0), radius=left.radius, height=5.0, laps=1.0, speed=1.0)
    x, y, _ = start_of(left, bearing)
    assert min(p[0] for p in rim(orbit)) - 1e-9 <= x <= max(p[0] for p in rim(orbit)) + 1e-9
    assert min(p[1] for p in rim(orbit)) - 1e-9 <= y <= max(p[1] for p in rim(orbit)) + 1e-9
