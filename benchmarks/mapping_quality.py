"""How good and how fast the map and the view of the way ahead are: figures quoted in docs/mapping.md.

    python benchmarks/mapping_quality.py [seeds]

Flies the sensors (without physics) along the planned route of some worlds, from which what stands on the route was
taken away, once with the nose along the track and once across it, and judges each map. Poses are the true ones: this
is the best that the grid can do. What it does with the poses of odometry is in benchmarks/odometry.py.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from statistics import median
from typing import TypeVar

import numpy as np
from mapping_flight import free_route

from skillwing.services.protocol import encode
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.frames.pose_history import PoseHistory
from skillwing.sim_mujoco.frames.vectors import Vector, wrap
from skillwing.sim_mujoco.judge.coverage import Judge
from skillwing.sim_mujoco.mapping.mapper import REACH, Mapper
from skillwing.sim_mujoco.mapping.occupancy import OccupancyGrid
from skillwing.sim_mujoco.obstacles.free_space import FreeSpace, Sighting
from skillwing.sim_mujoco.obstacles.views import CameraView, RingView
from skillwing.sim_mujoco.sensors import depth_camera, lidar
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.sensors.scans import DepthPicture, LidarScan
from skillwing.sim_mujoco.world.world import World

T = TypeVar("T")
SPEED, YAW_RATE, TICK = 2.0, 0.6, 0.01
TICKS_PER_SCAN = 10


class Stopwatch:
    """Processor times by name: on a busy machine they are steadier than wall times."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}

    def measure(self, name: str, call: Callable[[], T]) -> T:
        started = time.process_time()
        result = call()
        self.times.setdefault(name, []).append(time.process_time() - started)
        return result


def flight(world: World, across: float) -> Iterator[Motion]:
    """Motions along the route, turning on the spot; `across` is the angle between nose and track."""
    t, heading = 0.0, None
    for a, b in pairwise(world.route):
        wanted = math.atan2(b[1] - a[1], b[0] - a[0]) + across
        heading = wanted if heading is None else heading
        turn = wrap(wanted - heading)
        for k in range(round(abs(turn) / (YAW_RATE * TICK))):
            yield _motion(t, a, (0.0, 0.0, 0.0), heading + math.copysign(k * YAW_RATE * TICK, turn))
            t += TICK
        heading, steps = wanted, round(math.dist(a, b) / (SPEED * TICK))
        velocity = (SPEED * math.cos(wanted - across), SPEED * math.sin(wanted - across), 0.0)
        for k in range(steps):
            x, y, z = (a[i] + (b[i] - a[i]) * k / steps for i in range(3))
            yield _motion(t, (x, y, z), velocity, wanted)
            t += TICK


def _motion(t: float, position: Vector, velocity: Vector, heading: float) -> Motion:
    attitude = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    return Motion(t, position, velocity, attitude, (0.0, 0.0, 0.0))


def fly(seed: int, across: float, stopwatch: Stopwatch) -> str:
    """Map one world, look ahead with both sensors, and say how good the map is."""
    world = free_route(seed)
    rays, rng = RayScene(world.triangles()), np.random.default_rng(seed)
    scanner, camera = lidar.Lidar(rays, rng), depth_camera.DepthCamera(rays, rng)
    mapper, poses = Mapper(OccupancyGrid((-50.0, -50.0, -8.0), (80.0, 70.0, 24.0))), PoseHistory()
    spaces = {"zed": FreeSpace(), "lidar": FreeSpace()}
    mapper.start()
    track: list[Motion] = []
    misfits: list[float] = []
    for tick, motion in enumerate(flight(world, across)):
        if tick % 2 == 0:
            poses.add(_navigation(motion))
        track.append(motion)
        if len(track) <= TICKS_PER_SCAN:
            continue
        scan = _scan(scanner, track)
        picture = _picture(camera, motion)
        track = track[-1:]
        if not poses.covers(*scan.span):
            continue
        placed = stopwatch.measure("scan: place", lambda s=scan: s.place(poses, REACH))
        misfits.append(mapper.grid.fit(mapper.grid.hit_by(placed.points)).misfit)
        stopwatch.measure("scan: map", lambda p=placed: mapper.add(p))
        stopwatch.measure("lidar: remember", lambda s=scan, p=placed: spaces["lidar"].see(Sighting(RingView.of(s), p)))
        placed = stopwatch.measure("picture: place", lambda p=picture: p.place(poses, 20.0))
        stopwatch.measure("zed: remember", lambda i=picture, p=placed: spaces["zed"].see(Sighting(CameraView.of(i), p)))
        for name, space in spaces.items():
            ahead = tuple(p + 4.0 * v for p, v in zip(motion.position, motion.velocity, strict=True))
            stopwatch.measure(
                f"{name}: look ahead",
                lambda s=space, m=motion, a=ahead: s.outlook(m.t, m.position, m.velocity, 0.0, ((a[0], a[1], a[2]),)),
            )
    coverage = Judge(world, world.route).coverage(mapper.grid.occupied_centres(), mapper.grid.size)
    shares = ", ".join(
        f"{name} {share:.2f}"
        for name, share in (("all", coverage.all), ("buildings", coverage.buildings), ("terrain", coverage.terrain))
        if share is not None
    )
    return (
        f"{shares}; error {100 * (coverage.error or 0.0):.0f} cm; {len(mapper.grid.occupied())} voxels; "
        f"misfit median {median(misfits):.3f}, worst {max(misfits):.3f}; diverged: {mapper.diverged}"
    )


def _navigation(motion: Motion) -> topics.Navigation:
    return topics.Navigation(
        t=motion.t,
        position=motion.position,
        velocity=motion.velocity,
        quaternion=motion.quaternion,
        angular_velocity=motion.rate,
        heading=0.0,
    )


def _scan(scanner: lidar.Lidar, track: list[Motion]) -> LidarScan:
    header = topics.LidarHeader(
        t0=track[0].t, t1=track[-1].t, columns=lidar.COLUMNS, beams=lidar.BEAMS, mount=lidar.LIDAR_MOUNT
    )
    return LidarScan.decode(scanner.scan(track, header.t0, header.t1).tobytes(), encode(header))


def _picture(camera: depth_camera.DepthCamera, motion: Motion) -> DepthPicture:
    header = topics.DepthHeader(
        t=motion.t,
        width=depth_camera.WIDTH,
        height=depth_camera.HEIGHT,
        fx=depth_camera.FOCAL,
        fy=depth_camera.FOCAL,
        cx=depth_camera.WIDTH / 2,
        cy=depth_camera.HEIGHT / 2,
        mount=depth_camera.ZED_MOUNT,
    )
    return DepthPicture.decode((camera.picture(motion) * 1000.0).astype(np.uint16).tobytes(), encode(header))


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    stopwatch = Stopwatch()
    for seed in range(1, seeds + 1):
        for name, across in (("nose along the track", 0.0), ("nose across the track", -math.pi / 2)):
            sys.stdout.write(f"world {seed}, {name}: {fly(seed, across, stopwatch)}\n")
    for name, times in stopwatch.times.items():
        p95 = sorted(times)[int(0.95 * len(times))]
        sys.stdout.write(f"{name}: median {1e3 * median(times):.1f} ms, p95 {1e3 * p95:.1f} ms\n")


if __name__ == "__main__":
    main()
