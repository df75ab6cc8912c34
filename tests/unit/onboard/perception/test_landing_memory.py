"""Landing memory: its sensors, and its duration."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from skillwing.onboard.obstacles.free_space import Sighting
from skillwing.onboard.obstacles.landing_memory import PERIOD, READINGS, SURE, LandingMemory
from skillwing.onboard.obstacles.landing_place import SURROUNDINGS
from skillwing.onboard.obstacles.local_map import MEMORY
from skillwing.onboard.obstacles.views import CameraView, RingView
from skillwing.onboard.sensor_data.scans import PlacedPoints
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.obstacles import ObstacleSource

HERE: Vector3 = (0.0, 0.0, 4.0)
GROUND: Vector3 = (1.05, 0.15, 0.0)
CAMERA, LIDAR = ObstacleSource.ZED, ObstacleSource.LIDAR
STILL = (0.0, 0.0, 0.0)


def navigation(t: float, sigma: float = 0.02, height_sigma: float = 0.02) -> Navigation:
    return Navigation(
        t=t,
        position=HERE,
        velocity=STILL,
        quaternion=(1.0, 0.0, 0.0, 0.0),
        angular_velocity=STILL,
        heading=0.0,
        sigma=sigma,
        height_sigma=height_sigma,
    )


def look(memory: LandingMemory, t: float, *places: Vector3, sensor: ObstacleSource = LIDAR) -> None:
    view = RingView() if sensor is LIDAR else CameraView(across=0.9, upright=0.5)
    cloud = np.array(places, dtype=np.float32).reshape(-1, 3)
    memory.see(sensor, Sighting(view, PlacedPoints(t, np.eye(3), np.array(HERE), cloud)))


def remembered(memory: LandingMemory, t: float) -> NDArray[np.float64]:
    known = memory.known(t)
    return np.empty((0, 3)) if known is None else known.solid_within(np.full(3, -np.inf), np.full(3, np.inf))


@pytest.fixture
def memory() -> LandingMemory:
    """Memory of a drone that knows its position, and has seen a place on the ground twice."""
    memory = LandingMemory()
    memory.follow(navigation(0.0))
    look(memory, 0.0, GROUND)
    look(memory, PERIOD, GROUND)
    return memory


def test_nothing_is_known_before_anything_was_seen() -> None:
    assert LandingMemory().known(0.0) is None


def test_it_lasts_for_the_whole_flight(memory: LandingMemory) -> None:
    look(memory, 900.0)
    assert remembered(memory, 1800.0) == pytest.approx(np.array([GROUND]))


@pytest.mark.parametrize(("sigma", "height_sigma"), [(2.0 * SURE, 0.0), (0.0, 2.0 * SURE)])
def test_a_drone_that_is_not_sure_of_its_place_remembers_the_last_seconds(
    memory: LandingMemory, sigma: float, height_sigma: float
) -> None:
    memory.follow(navigation(1.0, sigma, height_sigma))
    assert len(remembered(memory, MEMORY)) == 1
    assert len(remembered(memory, MEMORY + PERIOD + 0.1)) == 0


@pytest.mark.parametrize("outage", [1.0, 2.0 * MEMORY])
def test_one_that_has_found_its_place_again_knows_what_it_had_seen_before(memory: LandingMemory, outage: float) -> None:
    meanwhile = (-3.0, 2.0, 1.0)
    memory.follow(navigation(1.0, sigma=2.0 * SURE))
    for t in (outage, outage + PERIOD):
        look(memory, t, meanwhile)
        memory.known(t)
    assert meanwhile in [tuple(place) for place in remembered(memory, outage + PERIOD).tolist()]
    memory.follow(navigation(outage + 1.0))
    assert remembered(memory, outage + 1.0) == pytest.approx(np.array([GROUND]))


def test_a_drone_unsure_from_the_beginning_restarts_its_memory() -> None:
    memory = LandingMemory()
    for t in (0.0, PERIOD):
        look(memory, t, GROUND)
    assert len(remembered(memory, 1.0)) == 1
    memory.follow(navigation(1.0))
    assert memory.known(1.0) is None


def test_rays_of_a_drone_that_is_not_sure_of_its_place_do_not_erase_what_it_knows(memory: LandingMemory) -> None:
    view = RingView(nearest=np.full((128, 16), 30.0, dtype=np.float32))
    beside = (0.0, 3.0, 4.0)
    for t in (1.0, 1.5):
        look(memory, t, beside)
    memory.follow(navigation(2.0, sigma=2.0 * SURE))
    for t in (2.0, 2.5, 3.0):
        nothing = np.empty((0, 3), dtype=np.float32)
        memory.see(LIDAR, Sighting(view, PlacedPoints(t, np.eye(3), np.array(HERE), nothing)))
    assert len(remembered(memory, 3.0)) < 2
    memory.follow(navigation(3.5))
    assert len(remembered(memory, 3.5)) == 2


def test_a_look_now_and_then_is_enough(memory: LandingMemory) -> None:
    assert not memory.wants(LIDAR, 1.9 * PERIOD)
    assert memory.wants(LIDAR, 2.0 * PERIOD)


def test_the_camera_looks_where_the_lidar_does_not(memory: LandingMemory) -> None:
    assert not memory.wants(CAMERA, 2.9 * PERIOD)
    assert memory.wants(CAMERA, 3.0 * PERIOD)
    look(memory, 3.0 * PERIOD, sensor=CAMERA)
    assert not memory.wants(CAMERA, 3.5 * PERIOD)


def test_only_what_stands_around_the_drone_and_below_is_kept(memory: LandingMemory) -> None:
    far, high = (SURROUNDINGS + 1.0, 0.0, 0.0), (2.0, 0.0, 8.0)
    for t in (1.0, 2.0):
        look(memory, t, far, high)
    assert remembered(memory, 2.0) == pytest.approx(np.array([GROUND]))


def test_points_that_a_ray_passes_are_forgotten_from_every_sensor(memory: LandingMemory) -> None:
    view = RingView(nearest=np.full((128, 16), 30.0, dtype=np.float32))
    beside = (0.0, 3.0, 4.0)
    for t in (1.0, 1.5):
        look(memory, t, beside, sensor=CAMERA)
    assert len(remembered(memory, 1.5)) == 2
    for t in (2.0, 2.5):
        nothing = np.empty((0, 3), dtype=np.float32)
        memory.see(LIDAR, Sighting(view, PlacedPoints(t, np.eye(3), np.array(HERE), nothing)))
    assert len(remembered(memory, 2.5)) < 2


def test_time_that_jumps_back_begins_a_new_memory(memory: LandingMemory) -> None:
    assert memory.wants(LIDAR, -10.0)
    look(memory, -10.0)
    assert memory.known(-10.0) is None


def line(memory: LandingMemory, since: float, readings: int) -> None:
    for reading in range(readings):
        t = since + 0.05 * reading
        memory.meet(t, (2.0 * (t - since), 0.0, 0.0))


def test_the_range_finder_leaves_a_line_where_the_lidar_does_not_look(memory: LandingMemory) -> None:
    line(memory, 10.0, READINGS - 1)
    assert len(remembered(memory, 11.0)) == 1
    line(memory, 10.0 + 0.05 * (READINGS - 1), 1)
    assert len(remembered(memory, 11.0)) > 1


def test_where_the_lidar_looks_the_range_finder_adds_nothing(memory: LandingMemory) -> None:
    line(memory, PERIOD, READINGS)
    assert len(remembered(memory, 1.1)) == 1


def test_a_line_whose_readings_are_not_to_be_believed_is_not_finished(memory: LandingMemory) -> None:
    line(memory, 10.0, READINGS - 1)
    memory.drop_line()
    line(memory, 11.0, READINGS - 1)
    assert len(remembered(memory, 12.0)) == 1
