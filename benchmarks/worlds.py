"""Promises and costs of worlds, and visibility of a wire.

python benchmarks/worlds.py [--seeds N] [--seconds S] [--write]

Makes every kind of world with N seeds, and every tenth with its smallest and largest scale. Flies each kind for S robot
seconds along its route. Looks at a wire of the power line. `--write` puts the figures into docs/worlds.md.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median

import mujoco
import numpy as np
from performance_page import machine, table, write_section
from world_promises import broken_promises

from skillwing.onboard.frames.vectors import Motion, Vector
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
from skillwing.sim_mujoco.sensors.lidar import Lidar
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.kinds import KINDS, make_site
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.things.obstacle import ObstacleKind
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.world import TERRAIN, World, make_world

PAGE = Path(__file__).parents[1] / "docs" / "worlds.md"
SPEED = 2.0
ROUNDS = 3
DISTANCES = (2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 20.0)
LOOKS = 60
ENOUGH = 3
"""Returns close together that the obstacle node takes for an obstacle."""


def promises(seeds: int) -> str:
    rows = []
    for kind, made in KINDS.items():
        low, high = made.scales
        count = broken = 0
        blockers = []
        for seed in range(seeds):
            for scale in sorted({1.0, low, high} if seed % 10 == 0 else {1.0}):
                site = make_site(seed, kind, scale)
                obstacles = made.build(site).obstacles
                count += 1
                broken += bool(broken_promises(site, obstacles))
                if scale == 1.0:
                    blockers.append(sum(each.leg is not None for each in obstacles))
        route = f"{sum(blockers) / len(blockers):.1f} ({min(blockers)} to {max(blockers)})"
        rows.append((kind, str(count), str(broken), route))
    return table(("kind", "worlds tried", "worlds with a broken promise", "obstacles on the route"), rows)


def costs(seconds: float) -> str:
    """Each round measures every kind once, so that a busy machine is as busy for all of them."""
    kinds = list(KINDS)
    built: dict[str, list[float]] = {kind: [] for kind in kinds}
    steps: dict[str, list[float]] = {kind: [] for kind in kinds}
    factors: dict[str, list[float]] = {kind: [] for kind in kinds}
    sizes: dict[str, tuple[int, int]] = {}
    for seed in range(1, ROUNDS + 1):
        for kind in kinds:
            begun = time.process_time()
            world = make_world(seed, kind)
            faces = len(world.triangles().faces)
            built[kind].append(time.process_time() - begun)
            sizes[kind] = world.spec().compile().ngeom, faces
            steps[kind].append(_step_cost(world))
            factors[kind].append(_factor(world, seconds))
    rows = [
        (
            kind,
            str(sizes[kind][0]),
            str(sizes[kind][1]),
            f"{1e3 * median(built[kind]):.0f}",
            f"{median(steps[kind]):.1f}",
            _spread(factors[kind]),
            _spread([ours / base for ours, base in zip(factors[kind], factors["courtyard"], strict=True)]),
        )
        for kind in kinds
    ]
    heads = ("kind", "geoms", "triangles", "made in [ms]", "physics step [us]", "factor", "beside the courtyard")
    return table(heads, rows)


def _spread(values: list[float]) -> str:
    return f"{median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def _step_cost(world: World) -> float:
    """Microseconds of processor time for a step of a small ball that falls over the home pad, free of contacts."""
    spec = world.spec()
    body = spec.worldbody.add_body(pos=[0.0, 0.0, 60.0])
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.3, 0.0, 0.0], mass=14.0)
    spec.option.gravity = [0.0, 0.0, 0.0]
    spec.option.timestep = 0.002
    model = spec.compile()
    data = mujoco.MjData(model)
    begun = time.process_time()
    mujoco.mj_step(model, data, nstep=3000)
    return 1e6 * (time.process_time() - begun) / 3000


def _factor(world: World, seconds: float) -> float:
    """Robot seconds per second of processor time, of the simulator with all its sensors, along the first leg."""
    simulator = Simulator(world)
    (x0, y0, z), (x1, y1, _) = world.route[:2]
    length = math.hypot(x1 - x0, y1 - y0)
    heading = math.atan2(y1 - y0, x1 - x0)
    simulator.place((x0, y0, z), heading)
    # Up to what may stand on the leg, and back.
    reach = 0.3 * length
    end, begun = simulator.t + seconds, time.process_time()
    while simulator.t < end:
        along = reach * (0.5 - 0.5 * math.cos(SPEED / reach * simulator.t))
        where = x0 + along * math.cos(heading), y0 + along * math.sin(heading), z
        simulator.command(Setpoint(where, (0.0, 0.0, 0.0), heading))
        simulator.advance(simulator.t + 0.02)
    return seconds / (time.process_time() - begun)


def wire() -> str:
    """Returns of a look at one conductor against the sky, from different distances."""
    world = make_world(1, "industrial")
    span = next(each for each in world.obstacles if each.kind is ObstacleKind.WIRE)
    conductor = replace(span, solids=tuple(each for each in span.solids if each.part.startswith("0-")))
    middle = conductor.solids[len(conductor.solids) // 2].position
    rays = RayScene(_without_ground(replace(world, obstacles=(conductor,))))
    camera, lidar = DepthCamera(rays, np.random.default_rng(1)), Lidar(rays, np.random.default_rng(2))

    def picture(motion: Motion) -> int:
        return int(np.count_nonzero(camera.picture(motion)))

    def scan(motion: Motion) -> int:
        return int(np.count_nonzero(lidar.scan([motion, replace(motion, t=0.1)], 0.0, 0.1)))

    # The wire runs from west to east; the drone is south of it, or below.
    ways: list[tuple[str, Callable[[Motion], int], float, Callable[[float], Vector]]] = [
        ("camera, flying at it", picture, math.pi / 2, lambda away: (middle[0], middle[1] - away, middle[2])),
        ("LiDAR, flying at it like a crab", scan, 0.0, lambda away: (middle[0], middle[1] - away, middle[2])),
        ("LiDAR, flying along below it", scan, 0.0, lambda away: (middle[0], middle[1], middle[2] - away)),
        ("LiDAR, crossing below it", scan, math.pi / 2, lambda away: (middle[0], middle[1], middle[2] - away)),
    ]
    rows = []
    for name, look, heading, place in ways:
        cells = []
        for away in DISTANCES:
            returns = [look(motion) for motion in _looks(place(away), heading)]
            cells.append(f"{median(returns):.0f} ({100 * sum(n >= ENOUGH for n in returns) / len(returns):.0f} %)")
        rows.append((name, *cells))
    return table(("", *(f"{away:g} m" for away in DISTANCES)), rows)


def _without_ground(world: World) -> Triangles:
    whole = world.triangles()
    keep = whole.labels != TERRAIN
    return Triangles(whole.vertices, whole.faces[keep], whole.labels[keep])


def _looks(place: Vector, heading: float) -> Iterator[Motion]:
    """The drone at rest near a place, hardly turned, as it happens in flight."""
    rng = np.random.default_rng(3)
    for _ in range(LOOKS):
        x, y, z = (value + float(rng.uniform(-0.2, 0.2)) for value in place)
        half = (heading + float(rng.uniform(-0.06, 0.06))) / 2
        yield Motion(0.0, (x, y, z), (0.0, 0.0, 0.0), (math.cos(half), 0.0, 0.0, math.sin(half)), (0.0, 0.0, 0.0))


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seeds", type=int, default=1000, metavar="N", help="seeds to try of each kind")
    options.add_argument("--seconds", type=float, default=10.0, metavar="S", help="robot seconds to fly in each world")
    options.add_argument("--write", action="store_true", help="put the figures into docs/worlds.md")
    wanted = options.parse_args()
    body = f"""{machine()}.

**Promises.** Seeds 0 to {wanted.seeds - 1}; the smallest and the largest scale as well for each tenth of them.

{promises(wanted.seeds)}

**What a world costs.** Seeds 1 to {ROUNDS}, median and spread. `factor`: robot seconds per second of processor time
of the simulator without the RGB camera, during {wanted.seconds:g} s of flight at the
beginning of the route. Times are processor times, and still longer on a busy machine; the last column compares with the
courtyard in the same round.

{costs(wanted.seconds)}

**What sensors see of a wire.** One conductor of 3 cm against the sky, {LOOKS} looks from about each distance: median
of the returns from it in one picture or revolution, and the share of looks with {ENOUGH} returns or more.

{wire()}"""
    write_section("worlds.py", "Figures", body, write=wanted.write, file=PAGE)


if __name__ == "__main__":
    main()
