"""Collisions with the ground depend on the speed before the contact, not after it."""

from __future__ import annotations

import math
from copy import deepcopy

from hypothesis import example, given, settings
from hypothesis import strategies as st

from skillwing.sim_mujoco.physics.hexacopter import GEAR_HEIGHT, ROTORS
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.world.world import make_world

ON_PAD = Physics(make_world(1))
FASTEST = 1.5
"""Speed above which a touchdown is a collision [m/s]."""
OFF = [0.0] * ROTORS
ROLLING = [50.0, 50.0, 0.0, 0.0, 0.0, 0.0]


def above_pad(height: float) -> Physics:
    """A drone at rest with its skids at this height above the pad [m]."""
    physics = deepcopy(ON_PAD)
    physics.place((0.0, 0.0, GEAR_HEIGHT + height))
    return physics


def fall(physics: Physics, seconds: float = 1.0) -> float:
    """Largest speed of the fall, which the drone has just before it touches [m/s]."""
    largest = 0.0
    for _ in range(round(seconds / Physics.dt)):
        largest = max(largest, math.hypot(*physics.motion.velocity))
        physics.step(OFF)
    return largest


@given(height=st.floats(0.02, 0.35))
@example(height=0.16)
@settings(max_examples=30, deadline=None)
def test_a_drone_that_falls_faster_than_is_allowed_has_hit_the_ground(height: float) -> None:
    physics = above_pad(height)
    speed = fall(physics)
    if abs(speed - FASTEST) > 0.001:
        assert physics.collisions == (speed > FASTEST)


def test_a_skid_that_is_driven_into_the_ground_has_hit_it_however_slow_the_drone_is() -> None:
    physics = above_pad(0.14)
    speed = 0.0
    for _ in range(100):
        if not physics.collisions:
            speed = math.hypot(*physics.motion.velocity)
            physics.step(ROLLING)
    assert physics.collisions == 1
    assert speed < 0.5


def test_a_drone_that_stands_and_stops_its_rotors_hits_nothing() -> None:
    physics = above_pad(0.0)
    fall(physics)
    assert physics.collisions == 0
