"""The fence in guidance: no setpoint lies outside it or within its margin, for any command, wind or pilot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pytest
from flight_rig import Rig
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from skillwing.onboard.commands.service import CommandRefusedError
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.guidance.core import GuidanceCore
from skillwing.onboard.guidance.limits import HIGHEST, LOWEST, GuidanceLimits
from skillwing.onboard.topics.flight import FlightState
from skillwing.onboard.topics.guidance import (
    FlyTo,
    GuidanceCommand,
    HoldPosition,
    Land,
    Motion,
    MotionState,
    Orbit,
    Stop,
    TakeOff,
    Turn,
    YawMode,
)
from skillwing.onboard.topics.navigation import Navigation
from skillwing.sim_mujoco.autopilot.autopilot import FailsafeLimits

FENCE = Box((-10.0, -10.0, -1.0), (10.0, 10.0, 12.0))
PERIOD = 0.02
LAG = 0.4
"""Time constant with which the drone follows its setpoint [s]."""


@dataclass(frozen=True)
class Blow:
    """The air moves the drone, on top of what it does itself."""

    velocity: Vector


@dataclass(frozen=True)
class Pilot:
    """The safety pilot takes the authority, flies somewhere and gives it back there."""

    place: Vector


Event = Motion | Blow | Pilot
anywhere = st.floats(-14.0, 14.0)
places = st.tuples(anywhere, anywhere, st.floats(-2.0, 16.0))
speeds = st.floats(0.2, 6.0)
events = st.one_of(
    st.builds(FlyTo, target=places, speed=speeds, nose=st.sampled_from(YawMode)),
    st.builds(
        Orbit, center=places, radius=st.floats(1.0, 8.0), height=st.floats(0.0, 14.0), laps=st.just(1.0), speed=speeds
    ),
    st.builds(Turn, heading=st.floats(-3.0, 3.0), lock=st.booleans()),
    st.builds(Land, speed=st.floats(0.2, 2.0)),
    st.just(HoldPosition()),
    st.just(Stop()),
    st.builds(Blow, velocity=st.tuples(*[st.floats(-2.0, 2.0)] * 3)),
    st.builds(Pilot, place=st.tuples(anywhere, anywhere, st.floats(1.0, 16.0))),
)


class Drone:
    """Follows setpoints with a lag, is blown about, and checks each setpoint that it gets."""

    def __init__(self) -> None:
        self.core = GuidanceCore(FENCE)
        self.position: Vector = (0.0, 0.0, 0.1)
        self.wind: Vector = (0.0, 0.0, 0.0)
        self.t = 0.0
        self.landing = False
        self.authority = True
        self.on_ground = True
        self.checked = 0
        self._velocity: Vector = (0.0, 0.0, 0.0)
        self._heading = 0.0
        self._token = 0

    def take_off(self) -> None:
        self.let_pass(0.5)
        self.command(TakeOff(height=5.0, speed=2.0))
        self.on_ground = False
        self.let_pass(5.0)

    def let_pass(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD)):
            self._tick()

    def meet(self, event: Event) -> None:
        match event:
            case Blow(velocity):
                self.wind = velocity
            case Pilot(place):
                self.authority = False
                self.let_pass(0.1)
                self.position = place
                self.let_pass(0.1)
                self.authority = True
            case _:
                self.command(event)

    def command(self, motion: Motion) -> None:
        goal = f"goal-{self._token}"
        if not isinstance(motion, Stop):
            self._token += 1
            goal = f"goal-{self._token}"
        try:
            self.core.command(GuidanceCommand(goal_id=goal, token=self._token, motion=motion), self.t)
        except CommandRefusedError:
            return
        if not isinstance(motion, Turn | Stop):
            self.landing = isinstance(motion, Land)

    def _tick(self) -> None:
        self.t += PERIOD
        state = FlightState(
            t=self.t, on_ground=self.on_ground, rotors_on=True, home_valid=True, authority=self.authority
        )
        half = 0.5 * self._heading
        self.core.navigation(
            Navigation(
                t=self.t,
                position=self.position,
                velocity=self._velocity,
                quaternion=(math.cos(half), 0.0, 0.0, math.sin(half)),
                angular_velocity=(0.0, 0.0, 0.0),
                heading=self._heading,
            )
        )
        self.core.flight(state)
        wanted = self.core.tick(self.t)
        if wanted is None:
            return
        self._check(wanted.position)
        pull = [(a - b) / LAG + w for a, b, w in zip(wanted.position, self.position, self.wind, strict=True)]
        self._velocity = (pull[0], pull[1], pull[2])
        x, y, z = (place + v * PERIOD for place, v in zip(self.position, self._velocity, strict=True))
        self.position, self._heading = (x, y, max(z, 0.1)), wanted.heading

    def _check(self, setpoint: Vector) -> None:
        self.checked += 1
        low, high = self.core.targets.low, self.core.targets.high
        assert low[0] <= setpoint[0] <= high[0]
        assert low[1] <= setpoint[1] <= high[1]
        assert setpoint[2] <= high[2]
        assert self.landing or setpoint[2] >= FENCE.low[2]


@given(st.lists(st.tuples(events, st.floats(0.1, 2.0)), min_size=3, max_size=6))
@settings(max_examples=20, deadline=None)
def test_no_setpoint_lies_outside_the_fence_or_too_near_to_it(story: list[tuple[Event, float]]) -> None:
    drone = Drone()
    drone.take_off()
    for event, seconds in story:
        drone.meet(event)
        drone.let_pass(seconds)
    assert drone.checked > 100


def test_a_drone_that_the_pilot_leaves_outside_is_brought_back_inside() -> None:
    drone = Drone()
    drone.take_off()
    drone.meet(Pilot((13.0, 0.0, 5.0)))
    drone.let_pass(3.0)
    assert FENCE.contains(drone.position, 0.1)


def test_targets_keep_a_margin_from_the_fence_and_not_from_the_ground() -> None:
    assert GuidanceLimits(FENCE).targets == Box((-9.5, -9.5, LOWEST), (9.5, 9.5, 11.5))
    above_a_wood = Box((-10.0, -10.0, 4.0), (10.0, 10.0, 200.0))
    assert GuidanceLimits(above_a_wood).targets == Box((-9.5, -9.5, 4.5), (9.5, 9.5, HIGHEST))


@pytest.mark.parametrize(
    ("corner", "speed", "air"),
    [
        ((-1.0, 0.0, 0.0), 0.15, {}),
        ((-1.0, -1.0, 0.0), 6.0, {"wind": (-4.0, -3.0, 0.0), "turbulence": 8.0}),
        ((0.0, 0.0, 1.0), 2.0, {"wind": (4.0, 3.0, 0.0), "turbulence": 8.0}),
    ],
)
def test_what_is_accepted_is_reached_inside_the_fence_and_the_autopilot_lets_it(
    corner: Vector, speed: float, air: dict[str, Any]
) -> None:
    """Guidance's margin against the autopilot's guard, at the extreme targets."""
    fence = Box((-4.0, -4.0, -1.0), (10.0, 10.0, 10.0))
    rig = Rig(limits=FailsafeLimits(fence=fence), **air)
    rig.core = GuidanceCore(fence)
    rig.take_off()
    targets = rig.core.targets
    x, y, z = (
        {-1.0: low, 0.0: here, 1.0: high}[side]
        for side, low, here, high in zip(corner, targets.low, (0.0, 0.0, 4.0), targets.high, strict=True)
    )
    rig.command("edge", FlyTo(target=(x, y, z), speed=speed, nose=YawMode.FREE))
    rig.fly_until(MotionState.DONE)
    assert not rig.fly(10.0, lambda: not (rig.sim.autopilot.follows and fence.contains(rig.sim.motion.position)))


def test_an_orbit_of_which_a_part_lies_outside_is_refused() -> None:
    drone = Drone()
    drone.take_off()
    inside = Orbit(center=(4.0, 0.0, 0.0), radius=5.0, height=6.0, laps=1.0, speed=1.0)
    drone.command(inside)
    assert drone.core.status(drone.t).body.goal_id == "goal-2"
    for part_outside in (
        structs.replace(inside, center=(6.0, 0.0, 0.0)),
        structs.replace(inside, center=(0.0, -6.0, 0.0)),
        structs.replace(inside, height=13.0),
        structs.replace(inside, height=0.5),
        structs.replace(inside, radius=1.0),
        structs.replace(inside, laps=0.0),
        structs.replace(inside, speed=9.0),
    ):
        drone.command(part_outside)
        assert drone.core.status(drone.t).body.goal_id == "goal-2"
