"""How far the way is free: what counts as an obstacle, what is seen, and for how long it is believed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from skillwing.sim_mujoco.obstacles.free_space import (
    MEMORY,
    STALE,
    TUBE_RADIUS,
    CameraView,
    FreeSpace,
    Outlook,
    RingView,
    Sighting,
    View,
)
from skillwing.sim_mujoco.sensors.scans import PlacedPoints

CAMERA = CameraView(across=0.9, upright=0.5)
RING = RingView()
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


def look(space: FreeSpace, stamp: float, cloud: Cloud, *, view: View = CAMERA, heading: float = 0.0) -> None:
    space.see(Sighting(view, PlacedPoints(stamp, about_z(heading), np.array(HERE), cloud)))


def space_that_saw(cloud: Cloud, *, view: View = CAMERA, heading: float = 0.0) -> FreeSpace:
    space = FreeSpace()
    for stamp in (0.0, 0.1, 0.2):
        look(space, stamp, cloud, view=view, heading=heading)
    return space


def judge(space: FreeSpace, target, *, t: float = 0.25, here=HERE, velocity=(0.0, 0.0, 0.0), heading=0.0) -> Outlook:
    return space.outlook(t, here, velocity, heading, target)


@given(st.floats(1.0, 18.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
@settings(max_examples=50, deadline=None)
def test_free_up_to_the_pole_whatever_the_bearing(distance: float, aside: float, bearing: float) -> None:
    """The answer depends on where the pole stands relative to the way, not on where the way points."""
    turn = about_z(bearing).astype(np.float32)
    centre = np.array(HERE, np.float32)
    space = space_that_saw(((pole(distance, aside) - centre) @ turn.T + centre).astype(np.float32), heading=bearing)
    target = (19.0 * math.cos(bearing), 19.0 * math.sin(bearing), 4.0)
    assert judge(space, target).free_distance == pytest.approx(distance, abs=1e-3)


@given(st.floats(1.0, 18.0), st.floats(TUBE_RADIUS + 0.01, 6.0))
@settings(max_examples=30, deadline=None)
def test_what_stands_beside_the_tube_or_behind_the_drone_is_no_obstacle(distance: float, aside: float) -> None:
    space = space_that_saw(np.concatenate([pole(distance, aside), pole(-distance)]))
    assert judge(space, (19.0, 0.0, 4.0)).free_distance == pytest.approx(19.0)


def test_where_nothing_stands_the_way_is_free_to_its_end_or_to_the_horizon() -> None:
    space = space_that_saw(NOTHING)
    assert judge(space, (12.0, 0.0, 4.0)).free_distance == pytest.approx(12.0)
    assert judge(space, (60.0, 0.0, 4.0)).free_distance == pytest.approx(CAMERA.horizon)
    assert judge(space, HERE).free_distance == pytest.approx(0.0)


def test_behind_the_target_only_what_is_too_close_to_it_counts() -> None:
    assert judge(space_that_saw(pole(12.0)), (10.0, 0.0, 4.0)).free_distance == pytest.approx(10.0)
    too_close = judge(space_that_saw(pole(10.8)), (10.0, 0.0, 4.0)).free_distance
    assert too_close == pytest.approx(10.8 - TUBE_RADIUS, abs=1e-3)


def test_a_few_or_scattered_points_are_no_obstacle() -> None:
    assert judge(space_that_saw(pole(5.0, count=4)), (12.0, 0.0, 4.0)).free_distance == pytest.approx(12.0)
    scattered = np.array([[x, 0.0, 4.0] for x in np.arange(2.0, 10.0, 0.3)], dtype=np.float32)
    assert judge(space_that_saw(scattered), (12.0, 0.0, 4.0)).free_distance == pytest.approx(12.0)
    hidden = np.concatenate([scattered, pole(7.1)])
    assert judge(space_that_saw(hidden), (12.0, 0.0, 4.0)).free_distance == pytest.approx(7.1, abs=0.5)


def test_one_poor_measurement_among_good_ones_changes_nothing() -> None:
    target = (12.0, 0.0, 4.0)
    ghost = space_that_saw(NOTHING)
    look(ghost, 0.3, pole(3.0))
    assert judge(ghost, target, t=0.3).free_distance == pytest.approx(12.0)
    look(ghost, 0.4, pole(3.0))
    assert judge(ghost, target, t=0.4).free_distance == pytest.approx(3.0)
    missed = space_that_saw(pole(3.0))
    look(missed, 0.3, NOTHING)
    assert judge(missed, target, t=0.3).free_distance == pytest.approx(3.0)


def test_what_has_come_too_close_to_be_seen_is_remembered_for_a_moment() -> None:
    space = space_that_saw(pole(2.0))
    target, here = (9.0, 0.0, 4.0), (1.0, 0.0, 4.0)
    remembered = np.arange(0.3, 0.1 + MEMORY, 0.1)
    for t in remembered:
        look(space, float(t), NOTHING)
    assert judge(space, target, t=float(remembered[-1]), here=here).free_distance == pytest.approx(1.0)
    forgotten = 0.25 + MEMORY
    look(space, forgotten, NOTHING)
    assert judge(space, target, t=forgotten, here=here).free_distance == pytest.approx(8.0)


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
def test_nothing_is_said_of_ways_that_the_sensor_does_not_look_along(view: View, target, sees: bool) -> None:
    outlook = judge(space_that_saw(NOTHING, view=view), target)
    assert (outlook.free_distance is not None) == sees
    assert outlook.stamp == pytest.approx(0.2)


def test_the_stamp_is_that_of_the_latest_look_along_the_way() -> None:
    space = space_that_saw(NOTHING)
    look(space, 0.5, NOTHING, heading=math.pi)
    ahead, back = judge(space, (9.0, 0.0, 4.0), t=0.6), judge(space, (-9.0, 0.0, 4.0), t=0.6)
    assert (ahead.free_distance, ahead.stamp) == (pytest.approx(9.0), pytest.approx(0.2))
    assert (back.free_distance, back.stamp) == (pytest.approx(9.0), pytest.approx(0.5))
    late = judge(space, (9.0, 0.0, 4.0), t=0.2 + STALE + 0.05)
    assert (late.free_distance, late.stamp) == (None, pytest.approx(0.5))


def test_old_measurements_say_nothing_and_no_measurement_even_less() -> None:
    space = space_that_saw(pole(5.0))
    assert judge(space, (9.0, 0.0, 4.0), t=0.2 + STALE + 0.01) == Outlook(None, None, CAMERA.horizon, 0.2)
    assert judge(FreeSpace(), (9.0, 0.0, 4.0)) == Outlook(None, None, 0.0, None)
    space.forget()
    assert judge(space, (9.0, 0.0, 4.0)).stamp is None


def test_time_that_jumps_back_begins_a_new_memory() -> None:
    space = space_that_saw(pole(5.0))
    look(space, 0.05, NOTHING)
    assert judge(space, (9.0, 0.0, 4.0), t=0.1).free_distance == pytest.approx(9.0)


def test_ahead_is_where_the_camera_looks_or_where_the_ring_sees_the_drone_go() -> None:
    assert judge(space_that_saw(pole(6.0)), None).ahead == pytest.approx(6.0)
    assert judge(space_that_saw(pole(-6.0), heading=math.pi), None, heading=math.pi).ahead == pytest.approx(6.0)
    ring = space_that_saw(pole(0.0, 6.0), view=RING)
    assert judge(ring, None, velocity=(0.0, 2.0, 0.0)).ahead == pytest.approx(6.0)
    assert judge(ring, None, velocity=(0.0, -2.0, 0.0)).ahead is None
    assert judge(ring, None, velocity=(2.0, 0.0, 0.0)).ahead is None
    assert judge(ring, None).ahead is None
