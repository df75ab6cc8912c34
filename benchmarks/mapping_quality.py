"""Quality and cost of the map and of obstacle detection, with true poses.

    python benchmarks/mapping_quality.py [--seeds 4] [--no-times] [--write]

Moves the sensors without physics along the planned route of some worlds. Obstacles on it are removed. The nose points
along the track and across it. Each map is judged. Poses are the true ones, so this is the share that the planned
way shows. benchmarks/odometry.py measures maps with the poses of odometry.
`--write` puts the figures into docs/mapping.md.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import median, quantiles
from typing import Final, TypeVar

import numpy as np
from mapping_flight import free_route
from numpy.typing import NDArray
from performance_page import machine, spread, table, write_section

from skillwing.evaluation.flights.coverage import CoverageJudge, MapQuality
from skillwing.onboard.frames.pose_history import PoseHistory
from skillwing.onboard.frames.vectors import Motion, Vector, wrap
from skillwing.onboard.mapping.mapper import REACH, Mapper
from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.onboard.obstacles.free_space import FreeSpace, Sighting
from skillwing.onboard.obstacles.views import CameraView, RingView
from skillwing.onboard.sensor_data.scans import DepthPicture, LidarScan, PlacedPoints
from skillwing.onboard.topics import navigation, sensors
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors import depth_camera, depth_pictures, lidar
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World

T = TypeVar("T")
SPEED, YAW_RATE, TICK = 2.0, 0.6, 0.01
TICKS_PER_SCAN = 10
PAGE = Path(__file__).parents[1] / "docs" / "mapping.md"
NOSES: Final = {"nose along the track": 0.0, "nose across the track": -math.pi / 2}
JUDGED: Final = {"all": "all", "buildings": "buildings", "terrain": "terrain", "error": "error [m]"}
"""Fields of `MapQuality`, and how they are told."""
MISPLACED: Final[dict[str, tuple[Vector, float]]] = {
    "in the right place": ((0.0, 0.0, 0.0), 0.0),
    "0.8 m too high": ((0.0, 0.0, 0.8), 0.0),
    "2 m off along the nose": ((2.0, 0.0, 0.0), 0.0),
    "2 m off sideways": ((0.0, 2.0, 0.0), 0.0),
    "turned by 15 degrees": ((0.0, 0.0, 0.0), math.radians(15.0)),
}
"""Displacements and turns of scans about the drone, to test that they contradict the map."""
SETTLED, MISPLACED_EVERY = 50, 10
"""Every so many scans one is misplaced, once so many were mapped."""


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


@dataclass(frozen=True, slots=True)
class Mapped:
    """Result of one flight; `mismatches` are those of scans displaced by MISPLACED."""

    coverage: MapQuality
    worst_mismatch: float
    mismatches: dict[str, list[float]]
    diverged: bool


def fly(seed: int, across: float, stopwatch: Stopwatch) -> Mapped:
    """Map one world, and look ahead with both sensors."""
    world = free_route(seed)
    rays, rng = RayScene(world.triangles()), np.random.default_rng(seed)
    scanner, camera = lidar.Lidar(rays, rng), depth_camera.DepthCamera(rays, rng)
    mapper, poses = Mapper(OccupancyGrid((-50.0, -50.0, -8.0), (80.0, 70.0, 24.0))), PoseHistory()
    spaces = {"depth camera": FreeSpace(), "LiDAR": FreeSpace()}
    mapper.start()
    track: list[Motion] = []
    worst = 0.0
    mismatches: dict[str, list[float]] = {name: [] for name in MISPLACED}
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
        placed = stopwatch.measure("a scan, put into the world", lambda s=scan: s.place(poses, REACH))
        worst = max(worst, _mismatch(mapper.grid, placed.points))
        if mapper.scans >= SETTLED and mapper.scans % MISPLACED_EVERY == 0:
            for name, (aside, turn) in MISPLACED.items():
                mismatches[name].append(_mismatch(mapper.grid, _moved(placed, aside, turn)))
        stopwatch.measure("a scan, put into the map", lambda p=placed: mapper.add(p))
        ring = RingView.of(scan)
        stopwatch.measure(
            "a scan, remembered as obstacles", lambda v=ring, p=placed: spaces["LiDAR"].see(Sighting(v, p))
        )
        placed = stopwatch.measure("a depth picture, put into the world", lambda p=picture: p.place(poses, 20.0))
        view = CameraView.of(picture)
        stopwatch.measure(
            "a depth picture, remembered as obstacles",
            lambda v=view, p=placed: spaces["depth camera"].see(Sighting(v, p)),
        )
        for name, space in spaces.items():
            ahead = tuple(p + 4.0 * v for p, v in zip(motion.position, motion.velocity, strict=True))
            stopwatch.measure(
                f"the way ahead, judged by {name}",
                lambda s=space, m=motion, a=ahead: s.outlook(m.t, m.position, m.velocity, 0.0, ((a[0], a[1], a[2]),)),
            )
    coverage = CoverageJudge(world, world.route).coverage(mapper.grid.occupied_centres(), mapper.grid.size)
    return Mapped(coverage, worst, mismatches, mapper.diverged)


def _mismatch(grid: OccupancyGrid, points: NDArray[np.float32]) -> float:
    return grid.fit(grid.hit_by(points)).mismatch


def _moved(placed: PlacedPoints, aside: Vector, turn: float) -> NDArray[np.float32]:
    """The points of a scan whose pose was wrong by so much, along the drone's heading, and turned about it."""
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    moved = (placed.points - placed.origin) @ turned.T + placed.origin + placed.turn @ np.array(aside)
    return moved.astype(np.float32)


def _navigation(motion: Motion) -> navigation.Navigation:
    return navigation.Navigation(
        t=motion.t,
        position=motion.position,
        velocity=motion.velocity,
        quaternion=motion.quaternion,
        angular_velocity=motion.rate,
        heading=0.0,
    )


def _scan(scanner: lidar.Lidar, track: list[Motion]) -> LidarScan:
    header = sensors.LidarHeader(
        t0=track[0].t, t1=track[-1].t, columns=lidar.COLUMNS, beams=lidar.BEAMS, mount=lidar.LIDAR_MOUNT
    )
    return LidarScan.decode(scanner.scan(track, header.t0, header.t1).tobytes(), encode(header))


def _picture(camera: depth_camera.DepthCamera, motion: Motion) -> DepthPicture:
    header = sensors.DepthHeader(
        t=motion.t,
        width=depth_pictures.WIDTH,
        height=depth_pictures.HEIGHT,
        fx=depth_pictures.FOCAL,
        fy=depth_pictures.FOCAL,
        cx=depth_pictures.WIDTH / 2,
        cy=depth_pictures.HEIGHT / 2,
        mount=depth_pictures.ZED_MOUNT,
    )
    return DepthPicture.decode((camera.picture(motion) * 1000.0).astype(np.uint16).tobytes(), encode(header))


def maps_told(flown: dict[str, list[Mapped]]) -> str:
    """Quality of the maps, as Markdown."""
    maps: list[list[str]] = []
    for name, each in flown.items():
        judged = [[getattr(one.coverage, part) for one in each] for part in JUDGED]
        shares = [spread([value for value in values if value is not None]) for values in judged]
        worst, diverged = max(one.worst_mismatch for one in each), sum(one.diverged for one in each)
        maps.append([name, *shares, f"{worst:.3f}", str(diverged)])
    mismatches = {
        way: [value for each in flown.values() for one in each for value in one.mismatches[way]] for way in MISPLACED
    }
    count = len(next(iter(flown.values())))
    return f"""Sensors flown without physics, with true poses, along the routes of {count} courtyards (seeds from 1 on)
without the obstacles on the route. They fly level, and begin with their heading of flight. Real flights turn and tilt,
and so see more across the track. Medians, the least and the largest in brackets.
{machine()}.

{table(["", *JUDGED.values(), "worst mismatch", "diverged"], maps)}

Scans in the right place and in wrong ones, compared with the map before their integration:

{table(["scan", "mismatch"], [[way, spread(values)] for way, values in mismatches.items()])}"""


def times_told(stopwatch: Stopwatch) -> str:
    """Costs, as Markdown."""
    costs = [
        [name, f"{1e3 * median(times):.1f}", f"{1e3 * quantiles(times, n=20)[-1]:.1f}"]
        for name, times in stopwatch.times.items()
    ]
    return f"Processor time:\n\n{table(['', 'median [ms]', '95 % below [ms]'], costs)}"


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seeds", type=int, default=4, help="worlds, the first of them of seed 1")
    options.add_argument("--no-times", action="store_true", help="tell no times, on a machine that has other work")
    options.add_argument("--write", action="store_true", help="put the figures into docs/mapping.md")
    wanted = options.parse_args()
    if wanted.seeds < 1:
        options.error("give one seed at least")
    stopwatch = Stopwatch()
    flown = {
        name: [fly(seed, across, stopwatch) for seed in range(1, wanted.seeds + 1)] for name, across in NOSES.items()
    }
    told = maps_told(flown) if wanted.no_times else f"{maps_told(flown)}\n\n{times_told(stopwatch)}"
    write_section("mapping_quality.py", "The map at its best", told, write=wanted.write, file=PAGE)


if __name__ == "__main__":
    main()
