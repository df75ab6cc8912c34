"""Two drones in one world: their motion, contacts, winds, and what their sensors see of each other."""

from __future__ import annotations

import math
from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.sensor_data.names import LIDAR, RANGE, ZED
from skillwing.sim_mujoco.physics.dynamics import Dynamics
from skillwing.sim_mujoco.physics.hexacopter import ROTORS
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.simulator.fleet import Fleet
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.footprint import Point
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.standing import LEAST_GAP, MOST_DRONES, STANDING_RADIUS, standing_places
from skillwing.sim_mujoco.world.vehicle_rays import PARTS, VehicleRays
from skillwing.sim_mujoco.world.world import make_world

WORLD = make_world(1)
FAR_APART: tuple[Point, Point] = ((0.0, 4.0), (0.0, -4.0))
HOVER = [14.0 * 9.81 / ROTORS] * ROTORS
OVER_ALL = 15.0
"""Height above every obstacle [m]."""


@cache
def _standing() -> tuple[Physics, Physics]:
    dynamics = Dynamics(WORLD, FAR_APART)
    return Physics(WORLD, dynamics, 0), Physics(WORLD, dynamics, 1)


def pair() -> tuple[Physics, Physics]:
    """Two drones on the ground, 8 m apart."""
    return deepcopy(_standing())


def step(drones: tuple[Physics, Physics], thrusts: list[float], steps: int = 1) -> None:
    for _ in range(steps):
        for drone in drones:
            drone.actuate(thrusts)
        drones[0].dynamics.step()
        for drone in drones:
            drone.check_contacts()


# --- motion -----------------------------------------------------------------------------------------------------------


def test_a_drone_far_from_the_other_moves_as_if_it_were_alone() -> None:
    alone, drones = Physics(WORLD), pair()
    alone.place((5.0, 2.0, OVER_ALL), 0.3)
    drones[0].place((5.0, 2.0, OVER_ALL), 0.3)
    drones[1].place((-5.0, -2.0, OVER_ALL))
    thrusts = [21.0, 23.0, 22.0, 23.5, 22.5, 24.0]
    for _ in range(500):
        alone.step(thrusts)
        step(drones, thrusts)
    ours, theirs = drones[0].motion, alone.motion
    assert math.dist(ours.position, theirs.position) < 1e-9
    assert math.dist(ours.velocity, theirs.velocity) < 1e-9
    assert drones[0].inertial == pytest.approx(alone.inertial, abs=1e-6)
    assert [drone.collisions for drone in drones] == [0, 0]


def test_each_drone_stands_where_it_was_put_and_counts_no_collision() -> None:
    drones = pair()
    step(drones, [0.0] * ROTORS, 500)
    for drone, (x, y) in zip(drones, FAR_APART, strict=True):
        assert math.dist(drone.motion.position[:2], (x, y)) < 0.02
        assert drone.collisions == 0


def test_to_put_one_drone_elsewhere_leaves_the_other_where_it_is() -> None:
    drones = pair()
    before = drones[1].motion
    drones[0].place((10.0, 10.0, OVER_ALL))
    assert drones[1].motion == before


@given(
    one=st.tuples(st.floats(-8, 8), st.floats(-8, 8), st.floats(-2, 2)),
    other=st.tuples(st.floats(-8, 8), st.floats(-8, 8), st.floats(-2, 2)),
)
@settings(max_examples=15, deadline=None)
def test_each_drone_drifts_with_the_wind_at_its_own_place(
    one: tuple[float, float, float], other: tuple[float, float, float]
) -> None:
    """A lone drone in that wind drifts alike. Only the derivative of the drag differs, by little in 0.2 s."""
    drones = pair()
    for drone, wind, x in zip(drones, (one, other), (-5.0, 5.0), strict=True):
        drone.place((x, 0.0, OVER_ALL))
        drone.set_wind(wind)
    step(drones, HOVER, 100)
    for drone, wind, x in zip(drones, (one, other), (-5.0, 5.0), strict=True):
        alone = Physics(WORLD)
        alone.place((x, 0.0, OVER_ALL))
        alone.set_wind(wind)
        for _ in range(100):
            alone.step(HOVER)
        assert math.dist(drone.motion.velocity, alone.motion.velocity) < 1e-3 * (1.0 + math.hypot(*wind))


@given(bearing=st.floats(-math.pi, math.pi), gap=st.floats(0.02, 1.0))
@settings(max_examples=20, deadline=None)
def test_drones_touch_only_where_their_spheres_meet(bearing: float, gap: float) -> None:
    drones = pair()
    away = 2.0 * TIP_RADIUS + gap
    drones[0].place((0.0, 0.0, OVER_ALL))
    drones[1].place((away * math.cos(bearing), away * math.sin(bearing), OVER_ALL))
    assert drones[0].separation == pytest.approx(gap)
    step(drones, HOVER)
    assert [drone.collisions for drone in drones] == [0, 0]


def test_a_contact_of_two_drones_is_a_collision_of_both() -> None:
    drones = pair()
    drones[0].place((0.0, 0.0, OVER_ALL))
    drones[1].place((1.0, 0.0, OVER_ALL))
    assert drones[1].separation is not None
    assert drones[1].separation < 0.0
    step(drones, HOVER)
    assert [drone.collisions for drone in drones] == [1, 1]


def test_a_drone_that_falls_onto_the_ground_is_no_collision_of_the_other() -> None:
    drones = pair()
    drones[0].place((0.0, 4.0, 3.0))
    step(drones, [0.0] * ROTORS, 500)
    assert [drone.collisions for drone in drones] == [1, 0]


# --- sensors ----------------------------------------------------------------------------------------------------------


def seen(position: tuple[float, float, float], heading: float = 0.0) -> VehicleRays:
    turn = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    return VehicleRays(RayScene(WORLD.triangles()), lambda: [(position, turn)])


def unit(rng: np.random.Generator, count: int) -> np.ndarray:
    directions = rng.normal(size=(count, 3)).astype(np.float32)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


@given(seed=st.integers(0, 2**32 - 1), heading=st.floats(-math.pi, math.pi))
@settings(max_examples=20, deadline=None)
def test_rays_end_on_the_surface_of_the_other_drone_or_where_they_did_without_it(seed: int, heading: float) -> None:
    rng = np.random.default_rng(seed)
    place = (3.0, 1.0, OVER_ALL)
    starts = (np.array(place) + 5.0 * unit(rng, 4)).astype(np.float32)
    aims = np.array(place) + rng.normal(0.0, 0.4, (4, 200, 3)) - starts[:, None]
    directions = (aims / np.linalg.norm(aims, axis=2, keepdims=True)).reshape(-1, 3).astype(np.float32)
    rays, bare = seen(place, heading), RayScene(WORLD.triangles())
    ours, cosines = rays.hits(starts, directions, 60.0)
    theirs, _ = bare.hits(starts, directions, 60.0)
    changed = np.flatnonzero(ours != theirs)
    assert len(changed) > 10
    ends = np.repeat(starts, 200, axis=0)[changed] + ours[changed, None] * directions[changed]
    assert (np.linalg.norm(ends - np.array(place), axis=1) <= TIP_RADIUS + 1e-3).all()
    assert ((theirs[changed] == 0.0) | (ours[changed] < theirs[changed])).all()
    assert ((cosines[changed] >= 0.0) & (cosines[changed] <= 1.0 + 1e-6)).all()
    assert np.array_equal(rays.distances(starts, directions, 60.0), ours)


def test_a_ray_to_the_hub_ends_at_its_surface_squarely() -> None:
    rays = seen((10.0, 0.0, OVER_ALL))
    distances, cosines = rays.hits(np.array([0.0, 0.0, OVER_ALL]), np.array([[1.0, 0.0, 0.0]], np.float32), 60.0)
    assert distances == pytest.approx(10.0 - PARTS[0][1][0], abs=1e-4)
    assert cosines == pytest.approx(1.0, abs=1e-5)


def test_a_drone_out_of_reach_or_behind_changes_no_bit() -> None:
    rng = np.random.default_rng(1)
    starts, directions = np.array([[0.0, 0.0, 5.0]], np.float32), unit(rng, 4000)
    bare = RayScene(WORLD.triangles())
    far = seen((300.0, 0.0, 5.0))
    assert all(map(np.array_equal, far.hits(starts, directions, 60.0), bare.hits(starts, directions, 60.0)))
    ahead = directions[directions[:, 0] > 0.3]
    behind = seen((-20.0, 0.0, 5.0))
    assert np.array_equal(behind.distances(starts, ahead, 60.0), bare.distances(starts, ahead, 60.0))


def test_depth_camera_and_lidar_see_the_other_drone_at_its_distance() -> None:
    """The left drone looks along its nose, where the right one is. The LiDAR's ring lies across the nose."""
    fleet = Fleet(WORLD, dict(zip(("left", "right"), FAR_APART, strict=True)), {})
    left, right = fleet.drones.values()
    alone = Simulator(WORLD)
    left.place((0.0, 0.0, OVER_ALL))
    for drone in (right, alone):
        drone.place((6.0, 0.0, OVER_ALL), math.pi / 2.0)
    out, lonely = fleet.advance(0.3), alone.advance(0.3)
    picture = [each.data for each in out["left"].measurements if each.sensor == ZED][-1]
    assert np.count_nonzero((picture > 4.5) & (picture < 6.5)) > 30
    around, nothing = (
        [np.count_nonzero((each.data > 4.5) & (each.data < 6.5)) for each in found.measurements if each.sensor == LIDAR]
        for found in (out["right"], lonely)
    )
    assert around[-1] > 10
    assert nothing[-1] == 0


def test_sensors_of_two_drones_in_the_same_situation_have_errors_of_their_own() -> None:
    fleet = Fleet(WORLD, dict(zip(("left", "right"), FAR_APART, strict=True)), {})
    out = fleet.advance(0.5)
    heights = [[float(m.data[0]) for m in out[robot].measurements if m.sensor == RANGE] for robot in out]
    assert len(heights[0]) == len(heights[1]) > 3
    assert heights[0] != heights[1]


def test_the_same_fleet_flies_the_same_way_bit_by_bit() -> None:
    def flown() -> list[Motion]:
        options = {"left": {"wind": (3.0, 0.0, 0.0), "turbulence": 5.0}, "right": {"turbulence": 5.0}}
        fleet = Fleet(WORLD, dict(zip(options, FAR_APART, strict=True)), options)
        for drone in fleet.drones.values():
            drone.place((*drone.home, OVER_ALL))
        fleet.advance(1.0)
        return [drone.motion for drone in fleet.drones.values()]

    assert flown() == flown()


# --- places -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", range(1, MOST_DRONES + 1))
def test_standing_places_are_free_and_apart(count: int) -> None:
    places = standing_places(WORLD.site, count)
    assert len(places) == count
    for number, place in enumerate(places):
        assert math.hypot(*place) <= STANDING_RADIUS + 1e-3
        others = places[:number]
        assert all(math.dist(place, other) >= 2.0 * TIP_RADIUS + LEAST_GAP - 1e-2 for other in others)


@pytest.mark.parametrize("count", [0, MOST_DRONES + 1])
def test_more_drones_than_there_is_room_for_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match="there is room for"):
        standing_places(WORLD.site, count)
