"""How fast the simulator with all its sensors runs on one core, as ratios to real time.

python benchmarks/sim_speed.py [seconds of flight]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from skillwing.sim_mujoco.autopilot import Setpoint
from skillwing.sim_mujoco.simulator import Simulator
from skillwing.sim_mujoco.world import make_world


def _flight(simulator: Simulator, seconds: float) -> float:
    """Wall time of climbing and flying east for so many seconds of robot time."""
    started = time.perf_counter()
    end = simulator.t + seconds
    while simulator.t < end:
        t = simulator.t
        where = (0.3 * t, 0.0, min(0.5 + t, 4.0))
        simulator.command(Setpoint(where, (0.3, 0.0, 0.0), 0.0))
        simulator.advance(t + 0.02)
    return time.perf_counter() - started


def _rate(repeat: int, call: Callable[[], object]) -> float:
    started = time.perf_counter()
    for _ in range(repeat):
        call()
    return (time.perf_counter() - started) / repeat


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    building = _rate(1, lambda: make_world(2).triangles())
    simulator = Simulator(make_world(1))
    _flight(simulator, 1.0)
    wall = _flight(simulator, seconds)
    lines = (
        f"world built in {1e3 * building:.0f} ms",
        f"{seconds:g} s of flight with all sensors in {wall:.2f} s: {seconds / wall:.1f} x real time",
    )
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
