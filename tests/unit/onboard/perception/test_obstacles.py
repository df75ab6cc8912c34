"""Free distance: obstacles, fields of view, and the duration of the memory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.obstacles.free_space import (
    NARROW,
    STALE,
    TUBE_RADIUS,
    FreeSpace,
    Outlook,
    Sighting,
)
from skillwing.onboard.obstacles.local_map import MEMORY, VOXEL, LocalMap
from skillwing.onboard.obstacles.views import CameraView, RingView, SensorView
from skillwing.onboard.sensor_data.scans import PlacedPoints
from skillwing.sim_mujoco.world.kinds import KINDS, make_site
from skillwing.sim_mujoco.world.layouts.plot import LEG_CLEARANCE

CAMERA = CameraView(across=0.9, upright=0.5)
RING = RingView()
EVERYWHERE = np.full(3, -np.inf), np.full(3, np.inf)
HERE = (0.0, 0.0, 4.0)
Cloud = NDArray[np.float32]


def pole(x: float, y: float = 0.0, count: int = 20) -> Cloud:
    """Points on the near side of a pole."""
    z = np.linspace(2.0, 6.0, count)
    return np.stack([np.full(count, x), np.full(count, y), z], axis=-1).astype(np.float32)


NOTHING: Cloud = np.empty((0, 3), dtype=np.float32)


def about_z(heading: float) -> NDArray[np.float64]:
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def look(space: FreeSpace, stamp: float, cloud: Cloud, *, view: SensorView = CAMERA, heading: float = 0.0) -> None:
    space.see(Sighting(view, PlacedPoints(stamp, about_z(heading), np.array(HERE), cloud)))


def space_that_saw(cloud: Cloud, *, view: SensorView = CAMERA, heading: float = 0.0) -> FreeSpace:
    space = FreeSpace()
    for stamp in (0.0, 0.1, 0.2):
        look(space, stamp, cloud, view=view, heading=heading)
    return space


def judge(space: FreeSpace, target, *, t: float = 0.25, here=HERE, velocity=(0.0, 0.0, 0.0), heading=0.0) -> Outlook:
    return space.outlook(t, here, velocity, heading, () if target is None else (target,))


def whole(length: float) -> Any:
    """Reported distance of a free way of this length."""
    return pytest.approx(min(length + TUBE_RADIUS, CAMERA.sight), abs=0.1)


@given(st.floats(1.5, 18.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
@settings(max_examples=50, deadline=None)
def test_free_up_to_the_pole_whatever_the_bearing(distance: float, aside: float, bearing: float) -> None:
    """The answer depends on where the pole stands relative to the way, not on where the way points."""
    turn = about_z(bearing).astype(np.float32)
    centre = np.array(HERE, np.float32)
    space = space_that_saw(((pole(distance, aside) - centre) @ turn.T + centre).astype(np.float32), heading=bearing)
    target = (19.0 * math.cos(bearing), 19.0 * math.sin(bearing), 4.0)
    assert judge(space, target).free_distance == pytest.approx(distance, abs=1e-3)


@given(st.floats(1.5, 18.0), st.floats(TUBE_RADIUS + 0.01, 6.0))
@settings(max_examples=30, deadline=None)
def test_what_stands_beside_the_tube_or_behind_the_drone_is_no_obstacle(distance: float, aside: float) -> None:
    space = space_that_saw(np.concatenate([pole(distance, aside), pole(-distance)]))
    assert judge(space, (19.0, 0.0, 4.0)).free_distance == whole(19.0)


def test_where_nothing_stands_the_way_is_free_to_behind_its_end_or_as_far_as_one_can_see() -> None:
    space = space_that_saw(NOTHING)
    assert judge(space, (12.0, 0.0, 4.0)).free_distance == whole(12.0)
    assert judge(space, (60.0, 0.0, 4.0)).free_distance == pytest.approx(CAMERA.sight)
    assert judge(space, HERE).free_distance == pytest.approx(TUBE_RADIUS)


def test_behind_the_target_only_what_is_too_close_to_it_counts() -> None:
    assert judge(space_that_saw(pole(12.0)), (10.0, 0.0, 4.0)).free_distance == whole(10.0)
    assert judge(space_that_saw(pole(10.8)), (10.0, 0.0, 4.0)).free_distance == pytest.approx(10.8, abs=0.05)


@given(st.floats(0.02, 8.0), st.floats(-0.5, 1.8), st.floats(-1.8, 1.8))
@example(length=0.25, behind=0.125, aside=1.21875)
@settings(max_examples=60, deadline=None)
def test_around_the_end_of_a_way_counts_what_is_near_it_in_any_direction(
    length: float, behind: float, aside: float
) -> None:
    """The end counts also if the drone is only centimetres away from it, in any direction. The tube of a drone that
    stands near the pole from the beginning is narrower."""
    pole_here = np.column_stack([np.full((5, 2), (length + behind, aside)), np.linspace(3.5, 4.5, 5)])
    space = space_that_saw(pole_here.astype(np.float32))
    free = judge(space, (length, 0.0, 4.0)).free_distance
    assert free is not None
    away = math.hypot(max(behind, 0.0), aside)
    radius = TUBE_RADIUS if math.hypot(length + behind, aside) > TUBE_RADIUS + 0.3 else NARROW
    if away > TUBE_RADIUS:
        assert free == whole(length)
    elif away < radius - 0.2 and behind > 0.01:
        assert free == pytest.approx(length + away, abs=0.2)


def test_a_few_or_scattered_points_are_no_obstacle() -> None:
    assert judge(space_that_saw(pole(5.0, count=4)), (12.0, 0.0, 4.0)).free_distance == whole(12.0)
    scattered = np.array([[x, 0.0, 4.0] for x in np.arange(2.0, 10.0, 0.6)], dtype=np.float32)
    assert judge(space_that_saw(scattered), (12.0, 0.0, 4.0)).free_distance == whole(12.0)
    hidden = np.concatenate([scattered, pole(7.1)])
    assert judge(space_that_saw(hidden), (12.0, 0.0, 4.0)).free_distance == pytest.approx(7.1, abs=0.5)


def test_one_poor_measurement_among_good_ones_changes_nothing() -> None:
    target = (12.0, 0.0, 4.0)
    ghost = space_that_saw(NOTHING)
    look(ghost, 0.3, pole(3.0))
    assert judge(ghost, target, t=0.3).free_distance == whole(12.0)
    look(ghost, 0.4, pole(3.0))
    assert judge(ghost, target, t=0.4).free_distance == pytest.approx(3.0)
    missed = space_that_saw(pole(3.0))
    look(missed, 0.3, NOTHING)
    assert judge(missed, target, t=0.3).free_distance == pytest.approx(3.0)


def test_what_has_come_too_close_to_be_seen_is_remembered_for_seconds() -> None:
    space = space_that_saw(pole(4.0))
    target, here = (9.0, 0.0, 4.0), (2.0, 0.0, 4.0)
    for t in np.arange(0.3, 0.1 + MEMORY, 0.4):
        look(space, float(t), NOTHING)
    assert judge(space, target, t=0.2 + MEMORY - 0.1, here=here).free_distance == pytest.approx(2.0, abs=0.01)
    look(space, 0.25 + MEMORY, NOTHING)
    assert judge(space, target, t=0.25 + MEMORY, here=here).free_distance == whole(7.0)


def test_a_ghost_goes_when_it_is_seen_through() -> None:
    space, behind = space_that_saw(pole(4.0)), CameraView(0.9, 0.5, nearest=np.full((9, 16), 12.0, np.float32))
    target = (9.0, 0.0, 4.0)
    assert judge(space, target).free_distance == pytest.approx(4.0)
    for stamp in (0.3, 0.4, 0.5):
        look(space, stamp, NOTHING, view=behind)
    assert judge(space, target, t=0.5).free_distance == whole(9.0)


def wall_ahead(distance: float) -> Cloud:
    y, z = np.meshgrid(np.arange(-6.0, 6.0, 0.2), np.arange(2.0, 6.0, 0.2))
    return np.stack([np.full(y.size, distance), y.ravel(), z.ravel()], axis=-1).astype(np.float32)


def test_next_to_something_the_tube_is_as_narrow_as_there_is_room() -> None:
    """A drone that stands near a wall can leave it and fly along it, but neither at it nor nearer to it."""
    wall = wall_ahead(1.4)
    away, along = space_that_saw(wall, heading=math.pi), space_that_saw(wall, heading=math.pi / 2)
    assert judge(away, (-8.0, 0.0, 4.0)).free_distance == whole(8.0)
    assert judge(along, (0.0, 5.0, 4.0)).free_distance == whole(5.0)
    nearer = judge(along, (0.4, 5.0, 4.0)).free_distance
    assert nearer is not None
    assert nearer < 4.0
    at_it = judge(space_that_saw(wall), (3.0, 0.0, 4.0)).free_distance
    assert at_it == pytest.approx(1.4, abs=0.1)


@given(st.floats(TIP_RADIUS, NARROW - 0.1), st.floats(0.0, math.pi / 2))
@settings(max_examples=30, deadline=None)
def test_nearer_than_that_it_can_only_leave(distance: float, slope: float) -> None:
    """The drone leaves a wall at a slope at which everything ahead is outside of the narrowest tube."""
    wall, slope = wall_ahead(distance), max(slope, math.acos(distance / NARROW))
    leave = (-8.0 * math.sin(slope), 8.0 * math.cos(slope), 4.0)
    assert judge(space_that_saw(wall, heading=math.pi / 2 + slope), leave).free_distance == whole(8.0)
    along = judge(space_that_saw(wall, heading=math.pi / 2), (0.0, 8.0, 4.0)).free_distance
    assert along is not None
    assert along < 1.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_tube_fits_into_the_gaps_that_every_world_promises(kind: str) -> None:
    assert make_site(1, kind).passage - 1.0 > 2.0 * TUBE_RADIUS
    assert TUBE_RADIUS < LEG_CLEARANCE - 1.0


def test_the_narrowest_tube_leaves_the_blades_room() -> None:
    assert TIP_RADIUS + 0.3 < NARROW < TUBE_RADIUS


def circle(radius: float, metres: float) -> tuple[tuple[float, float, float], ...]:
    """Corners of a way around (0, radius) from the origin, each a metre on, at the height of the drone."""
    angles = np.arange(1.0, metres + 0.5) / radius
    return tuple((radius * math.sin(a), radius * (1.0 - math.cos(a)), 4.0) for a in angles)


def test_on_a_bent_way_the_horizon_is_where_the_ring_loses_it() -> None:
    """The nose points to the centre, so the ring looks along the tangent, from which the circle bends away."""
    for radius in (6.0, 12.0):
        space = space_that_saw(NOTHING, view=RING, heading=math.pi / 2)
        outlook = space.outlook(0.25, HERE, (0.0, 0.0, 0.0), math.pi / 2, circle(radius, 8.0))
        assert outlook.free_distance == whole(8.0)
        assert outlook.horizon == pytest.approx(min(2 * math.sin(RING.half_angle) * radius, RING.reach), abs=1.0)
    nose_on_the_track = space_that_saw(NOTHING, view=RING)
    assert nose_on_the_track.outlook(0.25, HERE, (0.0, 0.0, 0.0), 0.0, circle(6.0, 8.0)).free_distance is None


def test_on_a_bent_way_it_finds_what_stands_on_the_bend() -> None:
    radius, metres = 10.0, 6.0
    angle = metres / radius
    space = space_that_saw(
        pole(radius * math.sin(angle), radius * (1 - math.cos(angle))), view=RING, heading=math.pi / 2
    )
    free = space.outlook(0.25, HERE, (0.0, 0.0, 0.0), math.pi / 2, circle(radius, 9.0)).free_distance
    assert free == pytest.approx(metres, abs=0.3)
    beside = space.outlook(0.25, HERE, (0.0, 0.0, 0.0), math.pi / 2, ((9.0, 0.0, 4.0),)).free_distance
    assert beside == whole(9.0)


# --- the local map -------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), max_size=40), st.integers(0, 3))
@settings(max_examples=50, deadline=None)
def test_a_voxel_is_solid_from_the_second_vote_on(places: list[tuple[float, float, float]], votes: int) -> None:
    known, cloud = LocalMap(), np.array(places, dtype=np.float64).reshape(-1, 3)
    for stamp in range(votes):
        known.see(cloud, np.zeros(3), 0.1 * stamp, lambda seen: np.zeros(len(seen), dtype=bool))
    voxels = {tuple(cell) for cell in np.floor(cloud / VOXEL).astype(int).tolist()}
    assert {tuple(cell) for cell in np.floor(known.solid_within(*EVERYWHERE) / VOXEL).astype(int).tolist()} == (
        voxels if votes >= 2 else set()
    )


@given(*[st.tuples(*[st.floats(-20.0, 20.0)] * 3)] * 2)
@settings(max_examples=50, deadline=None)
def test_a_box_holds_the_solid_points_that_lie_in_it(one: tuple[float, ...], other: tuple[float, ...]) -> None:
    known, cloud = LocalMap(), np.random.default_rng(4).uniform(-20.0, 20.0, (200, 3))
    for stamp in (0.0, 0.1):
        known.see(cloud, np.zeros(3), stamp, lambda seen: np.zeros(len(seen), dtype=bool))
    low, high = np.minimum(one, other), np.maximum(one, other)
    everywhere = known.solid_within(*EVERYWHERE)
    inside = ((everywhere >= low) & (everywhere <= high)).all(axis=1)
    assert known.solid_within(low, high).tolist() == everywhere[inside].tolist()


def test_what_is_far_behind_is_forgotten() -> None:
    known, nothing = LocalMap(span=10.0), lambda seen: np.zeros(len(seen), dtype=bool)
    known.see(np.array([[1.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), np.zeros(3), 0.0, nothing)
    known.see(np.empty((0, 3)), np.array([12.0, 0.0, 0.0]), 0.1, nothing)
    assert len(known) == 1


# --- views -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "view",
    [
        CameraView(0.9, 0.5, nearest=np.full((45, 80), 8.0, np.float32)),
        RingView(nearest=np.full((128, 16), 8.0, np.float32)),
    ],
)
def test_a_measurement_sees_through_what_is_nearer_than_what_it_saw(view: SensorView) -> None:
    direction = np.array([1.0, 0.0, 0.0]) if isinstance(view, CameraView) else np.array([0.0, 0.8, 0.6])
    places = np.array([2.0, 6.0, 7.9, 9.0, -3.0])[:, None] * direction
    ring_looks_back_too = isinstance(view, RingView)
    assert view.sees_through(places).tolist() == [True, True, False, False, ring_looks_back_too]
    assert not view.sees_through(np.array([[0.0, 0.0, 5.0]]))[0] or ring_looks_back_too


@pytest.mark.parametrize("view", [CAMERA, RING])
def test_a_measurement_without_returns_sees_through_nothing(view: SensorView) -> None:
    places = np.random.default_rng(1).uniform(-9.0, 9.0, (100, 3))
    assert not view.sees_through(places).any()


@pytest.mark.parametrize(
    ("view", "target", "sees"),
    [
        (CAMERA, (10.0, 8.0, 4.0), True),
        (CAMERA, (10.0, 11.0, 4.0), False),
        (CAMERA, (10.0, 0.0, 8.0), True),
        (CAMERA, (10.0, 0.0, 10.0), False),
        (CAMERA, (-10.0, 0.0, 4.0), False),
        (CAMERA, (0.0, 0.0, 12.0), False),
        (CAMERA, (-0.2, 0.1, 4.0), True),
        (RING, (0.0, 10.0, 4.0), True),
        (RING, (0.0, -10.0, 4.0), True),
        (RING, (0.0, 0.0, 12.0), True),
        (RING, (1.9, 10.0, 4.0), True),
        (RING, (2.4, 10.0, 4.0), False),
        (RING, (10.0, 0.0, 4.0), False),
        (RING, (0.4, 0.3, 4.0), True),
    ],
)
def test_nothing_is_said_of_ways_that_the_sensor_does_not_look_along(view: SensorView, target, sees: bool) -> None:
    outlook = judge(space_that_saw(NOTHING, view=view), target)
    assert (outlook.free_distance is not None) == sees
    assert outlook.stamp == pytest.approx(0.2)


def test_the_stamp_is_that_of_the_latest_look_along_the_way() -> None:
    space = space_that_saw(NOTHING)
    look(space, 0.5, NOTHING, heading=math.pi)
    ahead, back = judge(space, (9.0, 0.0, 4.0), t=0.6), judge(space, (-9.0, 0.0, 4.0), t=0.6)
    assert (ahead.free_distance, ahead.stamp) == (whole(9.0), pytest.approx(0.2))
    assert (back.free_distance, back.stamp) == (whole(9.0), pytest.approx(0.5))
    late = judge(space, (9.0, 0.0, 4.0), t=0.2 + STALE + 0.05)
    assert (late.free_distance, late.stamp) == (None, pytest.approx(0.5))


def test_old_measurements_say_nothing_and_no_measurement_even_less() -> None:
    space = space_that_saw(pole(5.0))
    assert judge(space, (9.0, 0.0, 4.0), t=0.2 + STALE + 0.01) == Outlook(None, None, CAMERA.reach, 0.2)
    assert judge(FreeSpace(), (9.0, 0.0, 4.0)) == Outlook(None, None, 0.0, None)
    space.forget()
    assert judge(space, (9.0, 0.0, 4.0)).stamp is None


def test_time_that_jumps_back_begins_a_new_memory() -> None:
    space = space_that_saw(pole(5.0))
    look(space, 0.05, NOTHING)
    assert judge(space, (9.0, 0.0, 4.0), t=0.1).free_distance == whole(9.0)


def test_ahead_is_where_the_camera_looks_or_where_the_ring_sees_the_drone_go() -> None:
    assert judge(space_that_saw(pole(6.0)), None).ahead == pytest.approx(6.0)
    assert judge(space_that_saw(pole(-6.0), heading=math.pi), None, heading=math.pi).ahead == pytest.approx(6.0)
    ring = space_that_saw(pole(0.0, 6.0), view=RING)
    assert judge(ring, None, velocity=(0.0, 2.0, 0.0)).ahead == pytest.approx(6.0)
    assert judge(ring, None, velocity=(0.0, -2.0, 0.0)).ahead is None
    assert judge(ring, None, velocity=(2.0, 0.0, 0.0)).ahead is None
    assert judge(ring, None).ahead is None
