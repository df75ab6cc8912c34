"""The fence guard: it steps in while there is room to brake, and never for a drone that stays clear."""

from __future__ import annotations

import math

import pytest
from flight_rig import WORLD
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.frames.extent import Box
from skillwing.sim_mujoco.autopilot.autopilot import FailsafeLimits, Mode, Setpoint
from skillwing.sim_mujoco.autopilot.fence_guard import LEVEL_BRAKING, MARGIN, REACTION, FenceGuard
from skillwing.sim_mujoco.simulator.simulator import Simulator

FENCE = Box((-20.0, -10.0, -1.0), (30.0, 40.0, 25.0))
GUARD = FenceGuard(FENCE)
places = st.tuples(st.floats(-20.0, 30.0), st.floats(-10.0, 40.0), st.floats(0.0, 25.0))
speeds = st.floats(0.0, 6.0)


@given(places, st.floats(0.0, 2.0 * math.pi), speeds)
def test_an_unstopped_drone_can_still_brake_inside(
    place: tuple[float, float, float], course: float, speed: float
) -> None:
    velocity = (speed * math.cos(course), speed * math.sin(course), 0.0)
    if GUARD.threatened(place, velocity) is None:
        for axis in (0, 1):
            v = velocity[axis]
            rest = place[axis] + v * REACTION + v * abs(v) / (2.0 * LEVEL_BRAKING)
            assert FENCE.low[axis] <= rest <= FENCE.high[axis]


@given(places)
def test_a_drone_at_rest_inside_is_left_alone_and_one_outside_is_not(place: tuple[float, float, float]) -> None:
    assert GUARD.threatened(place, (0.0, 0.0, 0.0)) is None
    assert GUARD.threatened((place[0], place[1], 25.5), (0.0, 0.0, 0.0)) == "upper"


@given(st.tuples(*[st.floats(-100.0, 100.0)] * 3))
def test_it_leads_inside_and_leaves_the_way_down_free(place: tuple[float, float, float]) -> None:
    x, y, z = GUARD.inside(place)
    assert FENCE.low[0] + MARGIN <= x <= FENCE.high[0] - MARGIN
    assert FENCE.low[1] + MARGIN <= y <= FENCE.high[1] - MARGIN
    assert z == min(place[2], FENCE.high[2] - MARGIN)


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.1])
def test_who_is_moved_a_little_where_the_guard_has_stopped_him_is_left_alone(speed: float) -> None:
    assert GUARD.threatened((30.0 - MARGIN, 0.0, 10.0), (speed, 0.0, 0.0)) is None


@pytest.mark.parametrize(
    ("start", "velocity", "wall"),
    [
        ((5.0, 5.0, 15.0), (6.0, 0.0, 0.0), "east"),
        ((5.0, 5.0, 15.0), (0.0, -6.0, 0.0), "south"),
        ((5.0, 5.0, 15.0), (0.0, 0.0, 2.0), "upper"),
        ((-9.3, 5.0, 15.0), (-0.15, 0.0, 0.0), "west"),
        ((5.0, 24.3, 15.0), (0.0, 0.15, 0.0), "north"),
        ((5.0, 5.0, 21.3), (0.0, 0.0, 0.15), "upper"),
    ],
)
def test_setpoints_that_lead_out_are_not_followed(
    start: tuple[float, float, float], velocity: tuple[float, float, float], wall: str
) -> None:
    fence = Box((-10.0, -10.0, -1.0), (25.0, 25.0, 22.0))
    simulator = Simulator(WORLD, sensors=(), limits=FailsafeLimits(fence=fence))
    simulator.place(start)
    stopped = False
    for k in range(400):
        ahead = tuple(p + v * 0.02 * k for p, v in zip(start, velocity, strict=True))
        simulator.command(Setpoint((ahead[0], ahead[1], ahead[2]), velocity, 0.0))
        simulator.advance(simulator.t + 0.02)
        assert fence.contains(simulator.motion.position)
        stopped = stopped or simulator.autopilot.mode is Mode.FENCE
    assert stopped
    assert simulator.autopilot.failsafe == f"{wall} fence ahead: holding position"
    assert not simulator.autopilot.follows
    simulator.command(Setpoint(start, (0.0, 0.0, 0.0), 0.0))
    simulator.advance(simulator.t + 0.1)
    assert simulator.autopilot.mode is Mode.FOLLOW
