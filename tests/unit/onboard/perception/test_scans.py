"""Measurements put into the world: directions, moving drones, and payloads that are none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.frames.pose_history import PoseHistory
from skillwing.onboard.sensor_data.directions import depth_directions, lidar_directions
from skillwing.onboard.sensor_data.scans import BLOCK, DepthPicture, LidarScan
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.sensors import DepthHeader, LidarHeader
from skillwing.services.protocol import ProtocolError, encode

LIDAR = LidarHeader(t0=0.0, t1=0.1, columns=64, beams=8, mount=(0.0, 0.0, -0.42))
ZED = DepthHeader(t=0.1, width=32, height=16, fx=20.0, fy=20.0, cx=16.0, cy=8.0, mount=(0.3, 0.0, -0.05))


def pose(t: float, position=(0.0, 0.0, 4.0), heading: float = 0.0, sign: float = 1.0) -> Navigation:
    return Navigation(
        t=t,
        position=position,
        velocity=(0.0, 0.0, 0.0),
        quaternion=(sign * math.cos(heading / 2), 0.0, 0.0, sign * math.sin(heading / 2)),
        angular_velocity=(0.0, 0.0, 0.0),
        heading=heading,
    )


def history(*poses: Navigation) -> PoseHistory:
    poses_ = PoseHistory()
    for each in poses:
        poses_.add(each)
    return poses_


def test_the_ring_lies_across_the_nose_and_turns_from_left_to_up() -> None:
    directions = lidar_directions(4, 3)
    assert np.allclose(np.linalg.norm(directions, axis=-1), 1.0, atol=1e-6)
    assert np.allclose(directions[:, 1], [[0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]], atol=1e-6)
    assert np.allclose(np.degrees(np.arcsin(directions[2, :, 0])), [-15.0, 0.0, 15.0], atol=1e-3)


def test_pixels_look_ahead_with_the_first_one_up_to_the_left() -> None:
    directions = depth_directions(ZED)
    assert directions.shape == (16, 32, 3)
    assert np.allclose(directions[0, 0], [1.0, 15.5 / 20.0, 7.5 / 20.0])
    assert np.allclose(directions[7:9, 15:17].mean(axis=(0, 1)), [1.0, 0.0, 0.0], atol=1e-6)


@given(
    speed=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
    turning=st.floats(-0.8, 0.8),
    target=st.floats(-9.0, -3.0),
)
@settings(max_examples=25, deadline=None)
def test_a_moving_and_turning_drone_still_sees_level_ground_level(
    speed: tuple[float, float, float], turning: float, target: float
) -> None:
    """Ranges to the plane z = `target` are made column by column; all points must come back to that plane."""
    times = (np.arange(LIDAR.columns) + 0.5) / LIDAR.columns * 0.1
    directions = lidar_directions(LIDAR.columns, LIDAR.beams).astype(np.float64)
    height = 4.0 + speed[2] * times - 0.42 - target
    down = -directions[..., 2]
    ranges = np.where(down > 0.1, height[:, None] / np.maximum(down, 0.1), 0.0).astype(np.float32)
    track = [pose(t, tuple(s * t + o for s, o in zip(speed, (0, 0, 4), strict=True)), turning * t) for t in _grid()]
    scan = LidarScan.decode(ranges.tobytes(), encode(LIDAR))
    placed = scan.place(history(*track), 200.0)
    assert len(placed.points) == np.count_nonzero(ranges)
    assert np.allclose(placed.points[:, 2], target, atol=2e-3)
    assert np.allclose(placed.origin, [0.05 * speed[0], 0.05 * speed[1], 3.58 + 0.05 * speed[2]], atol=1e-6)


def _grid() -> list[float]:
    return [round(0.02 * k, 3) for k in range(6)]


def test_a_wall_ahead_is_placed_by_the_heading_of_the_drone() -> None:
    depth = np.full((ZED.height, ZED.width), 5000, dtype=np.uint16)
    picture = DepthPicture.decode(depth.tobytes(), encode(ZED))
    placed = picture.place(history(pose(0.08, heading=math.pi / 2), pose(0.1, heading=math.pi / 2)), 20.0)
    assert placed.points.shape == (ZED.width * ZED.height // BLOCK**2, 3)
    assert np.allclose(placed.points[:, 1], 5.3, atol=1e-5)  # north, seen from 0.3 m before the centre


@given(st.integers(1, 65535), st.integers(0, 15), st.integers(0, 31))
@settings(max_examples=25, deadline=None)
def test_one_wrong_pixel_makes_no_point_and_a_thin_pole_does(depth: int, row: int, column: int) -> None:
    poses = history(pose(0.08), pose(0.1))
    lonely = np.zeros((ZED.height, ZED.width), dtype=np.uint16)
    lonely[row, column] = depth
    assert len(DepthPicture.decode(lonely.tobytes(), encode(ZED)).place(poses, 70.0).points) == 0
    pole = np.full((ZED.height, ZED.width), 15000, dtype=np.uint16)
    pole[:, column] = 8000
    placed = DepthPicture.decode(pole.tobytes(), encode(ZED)).place(poses, 20.0)
    assert np.count_nonzero(np.isclose(placed.points[:, 0], 8.3)) == ZED.height // BLOCK


def test_own_body_and_what_is_out_of_reach_or_no_number_are_left_out() -> None:
    ranges = np.zeros((LIDAR.columns, LIDAR.beams), dtype=np.float32)
    ranges[0, :5] = 0.6, 31.0, np.nan, np.inf, -2.0
    ranges[0, 5] = 7.0
    placed = LidarScan.decode(ranges.tobytes(), encode(LIDAR)).place(history(*map(pose, _grid())), 30.0)
    assert np.allclose(np.linalg.norm(placed.points - [0, 0, 3.58], axis=1), [7.0], atol=1e-4)


@pytest.mark.parametrize(
    ("payload", "header"),
    [
        (b"", LIDAR),
        (bytes(4 * 64 * 8 + 4), LIDAR),
        (b"", LidarHeader(t0=0.0, t1=0.1, columns=0, beams=8, mount=(0, 0, 0))),
        (bytes(64), LidarHeader(t0=0.0, t1=0.1, columns=-4, beams=-4, mount=(0, 0, 0))),
        (bytes(64), LidarHeader(t0=0.2, t1=0.1, columns=4, beams=4, mount=(0, 0, 0))),
    ],
)
def test_a_payload_that_is_no_scan_is_refused(payload: bytes, header: LidarHeader) -> None:
    with pytest.raises(ProtocolError):
        LidarScan.decode(payload, encode(header))


@pytest.mark.parametrize(
    ("payload", "header"),
    [
        (b"x", ZED),
        (bytes(2), DepthHeader(t=0.0, width=1, height=1, fx=1.0, fy=1.0, cx=0.5, cy=0.5, mount=(0, 0, 0))),
        (bytes(32), DepthHeader(t=0.0, width=4, height=4, fx=0.0, fy=1.0, cx=2.0, cy=2.0, mount=(0, 0, 0))),
    ],
)
def test_a_payload_that_is_no_picture_is_refused(payload: bytes, header: DepthHeader) -> None:
    with pytest.raises(ProtocolError):
        DepthPicture.decode(payload, encode(header))


def test_poses_cover_the_time_between_the_first_and_the_last_without_gaps() -> None:
    poses = history(pose(1.0), pose(1.02), pose(1.04))
    assert poses.covers(1.0, 1.04)
    assert not poses.covers(0.99, 1.02)
    assert not poses.covers(1.0, 1.05)
    poses.add(pose(1.5))
    assert not poses.covers(1.0, 1.04)
    poses.add(pose(0.2))
    assert not poses.covers(1.5, 1.5)
    assert not PoseHistory().covers(0.0, 0.0)


def test_the_two_quaternions_of_one_attitude_are_the_same_pose() -> None:
    poses = history(pose(0.0, heading=1.0), pose(0.02, heading=1.0, sign=-1.0))
    _, turns = poses.at(np.array([0.01]))
    assert turns[0][:2, 0] == pytest.approx([math.cos(1.0), math.sin(1.0)])
