"""Speed of the simulator with all sensors on one core: ratio to real time, and cost of its parts.

    python benchmarks/sim_speed.py [--seconds 10] [--write]

Processor time counts, because wall time depends on other processes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection
from statistics import median

import numpy as np
from numpy.typing import NDArray
from performance_page import against, machine, make_parser, table, write_section

from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.video.rate_control import USUAL_FPS
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.camera.camera import Camera
from skillwing.sim_mujoco.physics.physics import Physics
from skillwing.sim_mujoco.sensors import depth_camera, lidar
from skillwing.sim_mujoco.simulator.simulator import SENSORS, Simulator
from skillwing.sim_mujoco.world.kinds import KINDS
from skillwing.sim_mujoco.world.rays import Floats, RayScene
from skillwing.sim_mujoco.world.world import World, make_world

FLOOR = 5.0
"""The ratio to real time that the simulator with all sensors is to keep on one core."""
WITH_SENSORS = "the same with LiDAR, depth camera and IMU"
WITH_RGB = f"and with the RGB camera at {USUAL_FPS:g} Hz, in the courtyard"
TARGETS = {WITH_SENSORS: 15.0, WITH_RGB: 6.0}
"""Targets, times real time."""
SPEED, SHARE = 2.0, 0.3
"""Largest speed on the first leg of a world's route [m/s], and the flown, obstacle-free share of that leg."""
_BLOCKS = 5
_PICTURE = 320 * 180


class CountedRays(RayScene):
    """Knows how many rays were `cast`."""

    cast = 0

    def distances(self, origins: Floats, directions: Floats, reach: float, nothing: float = 0.0) -> Floats:
        self.cast += len(directions)
        return super().distances(origins, directions, reach, nothing)

    def faces(self, origins: Floats, directions: Floats, reach: float) -> tuple[Floats, NDArray[np.int32]]:
        self.cast += len(directions)
        return super().faces(origins, directions, reach)


def fly(simulator: Simulator, seconds: float) -> None:
    """Climb and fly east for so many seconds of robot time."""
    end = simulator.t + seconds
    while simulator.t < end:
        t = simulator.t
        where = (0.3 * t, 0.0, min(0.5 + t, 4.0))
        simulator.command(Setpoint(where, (0.3, 0.0, 0.0), 0.0))
        simulator.advance(t + 0.02)


def _cost(call: Callable[[], object], times: int) -> float:
    """Processor time of a call [s], the median of some after the first."""
    call()
    costs: list[float] = []
    for _ in range(times):
        started = time.process_time()
        call()
        costs.append(time.process_time() - started)
    return median(costs)


def parts(world: World) -> list[list[str]]:
    """Rows: a part, its cost in ms, and how much of what it works through in a second."""
    rays, rng = CountedRays(world.triangles()), np.random.default_rng(1)
    scanner, zed, camera = lidar.Lidar(rays, rng), depth_camera.DepthCamera(rays, rng), Camera(world, rays)
    track = [
        Motion(0.01 * k, (2.0 + 0.03 * k, 1.0, 4.0), (3.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        for k in range(11)
    ]
    physics = Physics(world)
    physics.place((2.0, 1.0, 4.0))
    thrusts = [physics.airframe.mass * 9.81 / 6.0] * 6

    def steps() -> None:
        for _ in range(100):
            physics.step(thrusts)

    def picture(name: str, take: Callable[[], object]) -> list[str]:
        before = rays.cast
        take()
        cast, cost = rays.cast - before, _cost(take, 30)
        worked = f"{_PICTURE / cost / 1e6:.1f} M pixels, for which {cast / cost / 1e6:.1f} M rays are cast"
        return [name, f"{1e3 * cost:.2f}", worked]

    scan, step = _cost(lambda: scanner.scan(track, 0.0, 0.1), 30), _cost(steps, 20) / 100
    return [
        ["LiDAR scan, 16 x 1024 rays", f"{1e3 * scan:.2f}", f"{16 * 1024 / scan / 1e6:.1f} M rays"],
        picture("depth picture, 320 x 180", lambda: zed.picture(track[0])),
        picture("RGB picture, 320 x 180", lambda: camera.picture(track[0])),
        ["step of physics, 2 ms", f"{1e3 * step:.3f}", f"{1e-3 / step:.0f} thousand steps"],
    ]


def ratios(world: World, sensors: Collection[str], seconds: float, fps: float = 0.0) -> list[float]:
    """Robot seconds per second of processor time, block by block, at the beginning of the route.

    fps: so many RGB pictures a second are wanted.
    """
    simulator = Simulator(world, sensors=sensors)
    fly(simulator, 2.0)
    (x0, y0, z), (x1, y1, _) = world.route[:2]
    simulator.place((x0, y0, z), math.atan2(y1 - y0, x1 - x0))
    if fps:
        simulator.camera.request(simulator.t, fps, 2.0 * seconds, tilt=0.0)
        simulator.camera.take(simulator.t, simulator.motion)  # The first picture makes the camera.
    found: list[float] = []
    begun = simulator.t
    for block in range(1, _BLOCKS + 1):
        before, started = simulator.t, time.process_time()
        while simulator.t < begun + block * seconds / _BLOCKS:
            simulator.command(_on_the_first_leg(world, simulator.t - begun))
            simulator.advance(simulator.t + 0.02)
            simulator.camera.take(simulator.t, simulator.motion)
        found.append((simulator.t - before) / (time.process_time() - started))
    return found


def _on_the_first_leg(world: World, t: float) -> Setpoint:
    (x0, y0, z), (x1, y1, _) = world.route[:2]
    slowness = 0.5 * SHARE * math.hypot(x1 - x0, y1 - y0) / SPEED
    share = SHARE * 0.5 * (1.0 - math.cos(t / slowness))
    where = (x0 + share * (x1 - x0), y0 + share * (y1 - y0), z)
    return Setpoint(where, (0.0, 0.0, 0.0), math.atan2(y1 - y0, x1 - x0))


def target(name: str, found: float) -> str:
    """Cell: target of a row and its result, if it has one."""
    limit = TARGETS.get(name)
    return "" if limit is None else f"{limit:g}: {against(limit, found, at_least=True)}"


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--seconds", type=float, default=10.0, help="robot time of each flight")
    wanted = options.parse_args()
    worlds = {kind: make_world(1, kind) for kind in KINDS}
    usual = worlds["courtyard"]
    factors = {kind: ratios(world, SENSORS, wanted.seconds) for kind, world in worlds.items()}
    slowest = min(factors, key=lambda kind: median(factors[kind]))
    flights = {
        "physics, control and navigation": ratios(usual, ("range",), wanted.seconds),
        WITH_SENSORS: factors["courtyard"],
        f"the same in the slowest kind of world, {slowest}": factors[slowest],
        WITH_RGB: ratios(usual, SENSORS, wanted.seconds, USUAL_FPS),
        f"and in {slowest}, the slowest without that camera": ratios(
            worlds[slowest], SENSORS, wanted.seconds, USUAL_FPS
        ),
    }
    rows = [
        [name, f"{median(each):.1f}", f"{min(each):.1f} to {max(each):.1f}", target(name, median(each))]
        for name, each in flights.items()
    ]
    kept = against(FLOOR, median(factors["courtyard"]), at_least=True)
    body = (
        "Processor time on one core. The ratio is robot seconds per second of processor time, as median of "
        f"{_BLOCKS} blocks. They are flown at the beginning of the route at up to {SPEED:g} m/s, in worlds of seed 1. "
        f"The budget is {FLOOR:g} in the courtyard with all sensors but the RGB camera, which runs only for streams: "
        f"{kept}. {machine()}.\n\n"
        + table(["part", "ms", "in a second"], parts(usual))
        + "\n\n"
        + table(["simulator", "times real time", "blocks", "target"], rows)
    )
    write_section("sim_speed.py", "The simulator", body, write=wanted.write)


if __name__ == "__main__":
    main()
