"""Discs of the blades: they collide, clearance is measured from them, and they weigh nothing."""

from __future__ import annotations

import dataclasses
import math
from copy import deepcopy

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.sim_mujoco.physics.hexacopter import ARM, BODY, ROTOR_RADIUS, ROTORS, attach_to
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.footprint import Footprint
from skillwing.sim_mujoco.world.things.plain import pole
from skillwing.sim_mujoco.world.world import World, make_world

POLE = 0.3
"""Radius of a pole at the origin [m]; it is drawn with eight sides or more, so that it may be a little thinner."""
THINNER = 0.03
BEARINGS = tuple(math.radians(30 + 60 * rotor) for rotor in range(ROTORS))


@pytest.fixture(scope="module")
def beside() -> Physics:
    return Physics(_world_with_a_pole())


def _world_with_a_pole() -> World:
    return dataclasses.replace(make_world(1), obstacles=(pole("pole", Footprint((10.0, 0.0), radius=POLE), 7.0),))


def touches(physics: Physics, gap: float, bearing: float, heading: float = 0.0) -> bool:
    """True if a drone whose centre is so far from the pole's side, at this bearing from it, touches it."""
    reach, copy = POLE + gap, deepcopy(physics)
    copy.place((10.0 + reach * math.cos(bearing), reach * math.sin(bearing), 4.0), heading)
    copy.step([0.0] * ROTORS)
    return copy.collisions > 0


@given(gap=st.floats(TIP_RADIUS, 1.5), bearing=st.floats(-math.pi, math.pi), heading=st.floats(-math.pi, math.pi))
@settings(max_examples=40, deadline=None)
def test_nothing_outside_the_tips_reach_is_hit(beside: Physics, gap: float, bearing: float, heading: float) -> None:
    assert not touches(beside, gap, bearing, heading)


@given(
    gap=st.floats(ARM - ROTOR_RADIUS, TIP_RADIUS - THINNER),
    rotor=st.sampled_from(BEARINGS),
    bearing=st.floats(-math.pi, math.pi),
)
@settings(max_examples=40, deadline=None)
def test_what_gets_between_the_blades_is_hit(beside: Physics, gap: float, rotor: float, bearing: float) -> None:
    """A rotor points to the pole, whose side is beyond the arm's end where nothing but blades is."""
    assert touches(beside, gap, bearing, bearing + math.pi - rotor)


def test_clearance_is_measured_from_the_tips_at_this_moment() -> None:
    simulator = Simulator(_world_with_a_pole(), sensors=())
    for gap in (0.0, 0.2, 1.0, 0.2):
        simulator.place((10.0 - POLE - TIP_RADIUS - gap, 0.0, 4.0))
        assert gap - 1e-3 <= simulator.clearance <= gap + THINNER


def test_the_sphere_holds_all_of_the_drone_and_the_discs_weigh_nothing() -> None:
    spec = mujoco.MjSpec()
    attach_to(spec, (0.0, 0.0, 0.0))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    discs = 0
    for geom in np.flatnonzero(model.geom_bodyid == model.body(f"{BODY}/body").id).tolist():
        assert _farthest(model, data, geom) <= TIP_RADIUS
        discs += model.geom(geom).name.startswith(f"{BODY}/disc")
    assert discs == ROTORS
    assert model.body(f"{BODY}/body").mass == pytest.approx(14.0)


def _farthest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Distance of a geom from the origin, from points all over the surface of its cylinder, capsule or ellipsoid."""
    kind, (radius, half, third) = model.geom_type[geom], model.geom_size[geom].tolist()
    turns = np.linspace(0.0, 2.0 * math.pi, 721)
    circle = np.stack([np.cos(turns), np.sin(turns), np.zeros_like(turns)], axis=-1)
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return max(radius, half, third)
    places = data.geom_xpos[geom] + (
        np.concatenate([radius * circle + [0.0, 0.0, end] for end in (half, -half)])
        @ data.geom_xmat[geom].reshape(3, 3).T
    )
    cap = radius if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
    return float(np.linalg.norm(places, axis=1).max()) + cap
