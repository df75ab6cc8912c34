"""How fast the simulator with all its sensors runs on one core: what its parts cost, and its ratio to real time.

    python benchmarks/sim_speed.py [--seconds 10] [--write]

Processor time is what counts: on a busy machine wall time measures the others.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median

import numpy as np
from performance_page import against, machine, make_parser, table, tell

from skillwing.sim_mujoco.frames.motion import Motion
from skillwing.sim_mujoco.sensors import depth_camera, lidar
from skillwing.sim_mujoco.sensors.rays import RayScene
from skillwing.sim_mujoco.simulator.autopilot import Setpoint
from skillwing.sim_mujoco.simulator.physics import Physics
from skillwing.sim_mujoco.simulator.simulator import SENSORS, Simulator
from skillwing.sim_mujoco.world.world import World, make_world

FLOOR = 5.0
"""The ratio to real time that the simulator with all sensors is to keep on one core."""
_BLOCKS = 5


def _flight(simulator: Simulator, seconds: float) -> None:
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
    rays, rng = RayScene(world.triangles()), np.random.default_rng(1)
    scanner, camera = lidar.Lidar(rays, rng), depth_camera.DepthCamera(rays, rng)
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

    scan = _cost(lambda: scanner.scan(track, 0.0, 0.1), 30)
    picture = _cost(lambda: camera.picture(track[0]), 30)
    step = _cost(steps, 20) / 100
    return [
        ["LiDAR scan, 16 x 1024 rays", f"{1e3 * scan:.2f}", f"{16 * 1024 / scan / 1e6:.1f} M rays"],
        ["depth picture, 320 x 180", f"{1e3 * picture:.2f}", f"{320 * 180 / picture / 1e6:.1f} M pixels"],
        ["step of physics, 2 ms", f"{1e3 * step:.3f}", f"{1e-3 / step:.0f} thousand steps"],
    ]


def ratios(world: World, sensors: tuple[str, ...], seconds: float) -> list[float]:
    """Robot seconds per second of processor time, block by block."""
    simulator = Simulator(world, sensors=sensors)
    _flight(simulator, 2.0)
    found: list[float] = []
    for _ in range(_BLOCKS):
        before, started = simulator.t, time.process_time()
        _flight(simulator, seconds / _BLOCKS)
        found.append((simulator.t - before) / (time.process_time() - started))
    return found


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--seconds", type=float, default=10.0, help="robot time of each flight")
    wanted = options.parse_args()
    world = make_world(1)
    fleet = (("physics, control and navigation", ("range",)), ("the same with LiDAR, depth camera and IMU", SENSORS))
    rows: list[list[str]] = []
    for name, sensors in fleet:
        found = ratios(world, sensors, wanted.seconds)
        rows.append([name, f"{median(found):.1f}", f"{min(found):.1f} to {max(found):.1f}"])
    kept = against(FLOOR, float(rows[-1][1]), at_least=True)
    body = (
        "Processor time on one core; the ratio is robot seconds per second of it, the median of "
        f"{_BLOCKS} blocks. The budget with all sensors is {FLOOR:g}: {kept}. {machine()}.\n\n"
        + table(["part", "ms", "in a second"], parts(world))
        + "\n\n"
        + table(["simulator", "times real time", "blocks"], rows)
    )
    tell("sim_speed.py", "The simulator", body, write=wanted.write)


if __name__ == "__main__":
    main()
