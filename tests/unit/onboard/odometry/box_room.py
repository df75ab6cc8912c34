"""A drone in a room, with sensors computed in closed form: a cheap world for odometry.

The room is a box at an angle: the LiDAR's narrow ring sees all its walls, and they are not parallel to the borders of
voxels. It is empty unless there are blocks in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.odometry.odometry import Fix, LidarInertialOdometry
from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.sensor_data.directions import lidar_directions
from skillwing.onboard.sensor_data.scans import LidarScan
from skillwing.onboard.topics.navigation import Navigation
from skillwing.onboard.topics.sensors import LidarHeader
from skillwing.services.protocol import encode

LOW, HIGH = (-20.0, -20.0, -10.0), (20.0, 20.0, 20.0)
HALF = np.array([7.0, 8.0, 4.0])
ASKEW = so3.exp(np.array([0.1, -0.07, 0.8]))
COLUMNS, BEAMS = 360, 16
IMU_RATE, BATCH, PERIOD = 250, 0.02, 0.1
MOUNT = np.array([0.0, 0.0, -0.3])
GRAVITY = np.array([0.0, 0.0, 9.81])
STANDING = 2.2
_FORWARD, _SIDEWAYS, _TURN = 2.0, 1.0, 0.15


@dataclass
class Room:
    """A flight in the room: the drone stands for a while, then sways along a smooth path and turns to and fro.

    lidar_bias, lidar_noise [m], gyro_bias [rad/s], accel_bias [m/s2]: errors of the sensors; they may be changed in
    flight. tilt (3,), offset (3,): errors of navigation, a rotation [rad] and a shift [m] in world axes. blind, deaf,
    lost: no scans, no inertial measurements, no navigation. every: one of this number of inertial batches arrives.
    blocks: obstacles in the room, each by two corners in world axes.
    """

    seed: int = 1
    begins_at: float = 0.0
    lidar_bias: float = 0.0
    lidar_noise: float = 0.02
    gyro_bias: Floats = field(default_factory=lambda: np.array([0.004, -0.003, 0.002]))
    accel_bias: Floats = field(default_factory=lambda: np.array([0.05, -0.04, 0.03]))
    tilt: Floats = field(default_factory=lambda: np.zeros(3))
    offset: Floats = field(default_factory=lambda: np.zeros(3))
    blind: bool = False
    deaf: bool = False
    lost: bool = False
    every: int = 1
    blocks: tuple[tuple[Floats, Floats], ...] = ()

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)
        self.t = self.begins_at

    def position(self, t: float | Floats) -> Floats:
        """Position of the drone (..., 3) at `t` (...)."""
        s = self._phase(t)
        ways = _FORWARD * (1 - np.cos(s)), _SIDEWAYS * np.sin(s) ** 2, 0.5 * (1 - np.cos(2 * s))
        return np.stack(ways, axis=-1)

    def turn(self, t: float | Floats) -> Floats:
        """Attitude of the drone (..., 3, 3) at `t` (...): a yaw, and a roll about the nose."""
        s = self._phase(t)
        yaw, roll = _TURN * (1 - np.cos(s)), 0.1 * np.sin(s) ** 2
        (cos_y, sin_y), (cos_r, sin_r) = ((np.cos(angle), np.sin(angle)) for angle in (yaw, roll))
        turns = np.zeros((*np.shape(s), 3, 3))
        turns[..., 0, 0], turns[..., 0, 1], turns[..., 0, 2] = cos_y, -sin_y * cos_r, sin_y * sin_r
        turns[..., 1, 0], turns[..., 1, 1], turns[..., 1, 2] = sin_y, cos_y * cos_r, -cos_y * sin_r
        turns[..., 2, 1], turns[..., 2, 2] = sin_r, cos_r
        return turns

    def velocity(self, t: float) -> Floats:
        step = 1e-4
        before, after = self.position(t + step * np.array([-1.0, 1.0]))
        return (after - before) / (2 * step)

    def navigation(self, t: float) -> Navigation:
        turn = self.turn(t)
        return Navigation(
            t=t,
            position=tuple((self.position(t) + self.offset).tolist()),
            velocity=tuple(self.velocity(t).tolist()),
            quaternion=so3.quaternion(so3.exp(self.tilt) @ turn if self.tilt.any() else turn),
            angular_velocity=(0.0, 0.0, 0.0),
            heading=0.0,
        )

    def inertial(self, start: float, end: float) -> Inertial:
        times = start + np.arange(round((end - start) * IMU_RATE)) / IMU_RATE
        forces, rates = self.felt(times)
        noise = self._rng.standard_normal((2, len(times), 3))
        return Inertial(times, forces + self.accel_bias + 0.06 * noise[0], rates + self.gyro_bias + 0.005 * noise[1])

    def felt(self, times: Floats) -> tuple[Floats, Floats]:
        """True specific force and angular rate at `times` (N,): (N, 3) both."""
        step = 1e-3
        moments = times + step * np.arange(-1.0, 2.0)[:, None]
        (before, now, after), (turn_before, turn_now, turn_after) = self.position(moments), self.turn(moments)
        force = (after - 2 * now + before) / step**2 + GRAVITY
        change = turn_before.transpose(0, 2, 1) @ turn_after
        # The skew part of such a small rotation is the rotation vector.
        rates = np.stack([change[:, 2, 1], change[:, 0, 2], change[:, 1, 0]], axis=-1) / (2 * step)
        return np.einsum("nji,nj->ni", turn_now, force), rates

    def scan(self, start: float, end: float) -> LidarScan:
        header = LidarHeader(t0=start, t1=end, columns=COLUMNS, beams=BEAMS, mount=tuple(MOUNT.tolist()))
        times = start + (np.arange(COLUMNS) + 0.5) / COLUMNS * (end - start)
        turns = self.turn(times)
        origins = (self.position(times) + turns @ MOUNT)[:, None]
        ways = np.einsum("cbj,cij->cbi", lidar_directions(COLUMNS, BEAMS), turns)
        x, y, z = np.moveaxis((np.copysign(HALF, askew := ways @ ASKEW) - origins @ ASKEW) / askew, 2, 0)
        ranges = np.minimum(np.minimum(x, y), z)  # ten times as fast as the least along a short axis
        for low, high in self.blocks:
            ranges = np.minimum(ranges, distance_to_block(origins, ways, low, high))
        ranges += self.lidar_bias + self.lidar_noise * self._rng.standard_normal(ranges.shape)
        return LidarScan.decode(ranges.astype(np.float32).tobytes(), encode(header))

    def fly(self, odometry: LidarInertialOdometry, seconds: float) -> Iterator[Fix]:
        """Let time pass, in the order in which a simulator publishes: scan, inertial measurements, navigation."""
        for _ in range(round(seconds / BATCH)):
            start, self.t = self.t, round(self.t + BATCH, 6)
            fixes = []
            if not self.blind and round(self.t / BATCH) % round(PERIOD / BATCH) == 0:
                fixes.append(odometry.scan(self.scan(self.t - PERIOD, self.t)))
            if not self.deaf and round(self.t / BATCH) % self.every == 0:
                fixes.append(odometry.imu(self.inertial(start, self.t)))
            if not self.lost:
                odometry.navigation(self.navigation(self.t))
            odometry.check(self.t)
            yield from (fix for fix in fixes if fix is not None)

    def _phase(self, t: float | Floats) -> Floats:
        """Phase of the path at `t`: 0 until STANDING, then smoothly growing."""
        moving = np.maximum(np.asarray(t) - STANDING, 0.0)
        return 0.6 * moving**3 / (moving**2 + 1.0)


def distance_to_block(origins: Floats, ways: Floats, low: Floats, high: Floats) -> Floats:
    """Distances (...) along unit vectors `ways` (..., 3) to the block; infinite if they miss it."""
    with np.errstate(divide="ignore"):
        one, other = (low - origins) / ways, (high - origins) / ways
    entry, leave = np.minimum(one, other).max(axis=-1), np.maximum(one, other).min(axis=-1)
    return np.where((entry > 0.0) & (entry < leave), entry, np.inf)
