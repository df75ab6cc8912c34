"""How fast the simulator with all its sensors runs on one core, as ratios to real time.

python benchmarks/sim_speed.py [seconds of flight]
"""

from __future__ import annotations

import sys
import time

from skillwing.sim_mujoco.simulator.autopilot import Setpoint
from skillwing.sim_mujoco.simulator.simulator import SENSORS, Simulator
from skillwing.sim_mujoco.world.world import make_world


def _flight(simulator: Simulator, seconds: float) -> None:
    """Climb and fly east for so many seconds of robot time."""
    end = simulator.t + seconds
    while simulator.t < end:
        t = simulator.t
        where = (0.3 * t, 0.0, min(0.5 + t, 4.0))
        simulator.command(Setpoint(where, (0.3, 0.0, 0.0), 0.0))
        simulator.advance(t + 0.02)


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    world = make_world(1)
    sys.stdout.write("robot seconds per second of wall time and of processor time\n")
    for name, sensors in (("physics and control", ("range",)), ("with IMU, LiDAR and depth camera", SENSORS)):
        simulator = Simulator(world, sensors=sensors)
        _flight(simulator, 1.0)
        wall, processor = time.perf_counter(), time.process_time()
        _flight(simulator, seconds)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        sys.stdout.write(f"{name:34s} {seconds / wall:6.1f} {seconds / processor:6.1f}\n")


if __name__ == "__main__":
    main()
