"""Models of the sensors: lost returns, holes, wandering biases."""

from __future__ import annotations

import numpy as np
import pytest

from skillwing.onboard.frames.vectors import Motion
from skillwing.sim_mujoco.sensors.depth_camera import BASELINE, DepthCamera
from skillwing.sim_mujoco.sensors.depth_pictures import FOCAL, NEAREST, REACH
from skillwing.sim_mujoco.sensors.instruments import IMU_PERIOD, IMU_TURN_ON, IMU_WALK, Imu
from skillwing.sim_mujoco.sensors.lidar import Lidar
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.triangles import Triangles

LEVEL = (1.0, 0.0, 0.0, 0.0)
SHOTS = 20_000


def board(x: float, y: tuple[float, float], z: tuple[float, float] = (-50.0, 50.0)) -> list[tuple[float, ...]]:
    """The corners of an upright rectangle across the nose of a drone at the origin."""
    return [(x, y[0], z[0]), (x, y[1], z[0]), (x, y[1], z[1]), (x, y[0], z[1])]


def scene(*boards: list[tuple[float, ...]]) -> RayScene:
    corners = np.array([corner for each in boards for corner in each], dtype=np.float32)
    faces = [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(len(boards)) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return RayScene(Triangles(corners, np.array(faces, dtype=np.int32), np.zeros(len(faces), dtype=np.int8)))


def lost(distance: float, squareness: float) -> float:
    """Share of the LiDAR's shots at a surface that do not return."""
    lidar = Lidar(scene(board(10.0, (-1.0, 1.0))), np.random.default_rng(3))
    seen = lidar.returns(np.full(SHOTS, distance, dtype=np.float32), np.full(SHOTS, squareness, dtype=np.float32))
    return 1.0 - float(seen.mean())


def test_more_lidar_shots_are_lost_the_farther_and_the_more_grazing() -> None:
    by_range = [lost(r, 1.0) for r in (5.0, 30.0, 45.0, 59.0)]
    assert by_range == sorted(by_range)
    assert by_range[0] < 0.02
    assert by_range[-1] == pytest.approx(0.5, abs=0.05)
    by_incidence = [lost(20.0, c) for c in (1.0, 0.3, 0.1, 0.03)]
    assert by_incidence == sorted(by_incidence)
    assert by_incidence[-1] > 0.7


def test_a_ray_says_how_squarely_it_hits() -> None:
    rays = scene(board(10.0, (-50.0, 50.0)))
    directions = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-1.0, 0.0, 0.0]], dtype=np.float32)
    distances, squareness = rays.hits(np.zeros(3, dtype=np.float32), directions, 60.0)
    assert distances == pytest.approx([10.0, 10.0 / 0.6, 0.0], abs=1e-4)
    assert squareness == pytest.approx([1.0, 0.6, 0.0], abs=1e-5)


def test_left_of_something_near_the_depth_camera_is_blind_for_as_wide_as_disparities_differ() -> None:
    near, far = 2.0, 10.0
    camera = DepthCamera(
        scene(board(near + 0.3, (-0.3, 0.3)), board(far + 0.3, (-50.0, 50.0))), np.random.default_rng(1)
    )
    depth = camera.picture(Motion(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), LEVEL, (0.0, 0.0, 0.0)))
    row = np.median(depth, axis=0)
    front = np.flatnonzero((row > 0.0) & (row < 3.0))
    shadow = np.flatnonzero(row[30 : front[0]] == 0.0) + 30
    assert len(shadow) == pytest.approx(FOCAL * BASELINE * (1 / near - 1 / far), abs=2.0)
    assert front[0] - shadow[-1] <= 2
    beside = row[front[-1] + 3 : 300]
    assert beside == pytest.approx(np.full(len(beside), far), abs=0.1)


def test_the_farther_a_wall_the_more_holes_has_its_picture() -> None:
    shares = []
    for distance in (2.0, 10.0, 18.0):
        camera = DepthCamera(scene(board(distance + 0.3, (-80.0, 80.0))), np.random.default_rng(1))
        depth = camera.picture(Motion(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), LEVEL, (0.0, 0.0, 0.0)))
        inner = depth[:, 40:]
        shares.append(float((inner == 0.0).mean()))
        assert depth[depth > 0.0].min() >= NEAREST
        assert depth.max() <= REACH
    assert shares == sorted(shares)
    assert shares[0] < 0.01 < shares[-1]


def test_imu_biases_wander_as_a_random_walk() -> None:
    ends, starts = [], []
    for seed in range(200):
        imu = Imu(np.random.default_rng(seed))
        starts.append(imu.bias)
        for _ in range(100):
            imu.measure(np.zeros((25, 6)))
        ends.append(imu.bias)
    walked = np.std(np.array(ends) - np.array(starts), axis=0)
    seconds = 100 * 25 * IMU_PERIOD
    assert walked == pytest.approx(IMU_WALK * np.sqrt(seconds), rel=0.2)
    assert np.std(starts, axis=0) == pytest.approx(IMU_TURN_ON, rel=0.2)
