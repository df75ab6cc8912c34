"""Savings on rays and their price: computed pixels, and Embree without robust mode.

python benchmarks/ray_choices.py [--seeds 2] [--places 16] [--no-times] [--write]

Casts rays from places along the routes of every kind of world. Errors are counted for docs/sensors.md; counts do not
depend on the load of the machine. Saved processor time is written to docs/performance.md.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median
from typing import Final
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from performance_page import machine, ratio, table, write_section
from ray_aims import Ground, Rays, picture_rays, places, scan_rays
from ray_rivals import EitherSide, EveryPixel, EverySecondRow, RobustRays, WatchedRays, camera_with
from sim_speed import fly

from skillwing.onboard.frames.vectors import Motion
from skillwing.sim_mujoco.sensors import depth_camera, depth_pictures
from skillwing.sim_mujoco.sensors.depth_camera import Infill
from skillwing.sim_mujoco.sensors.lidar import PERIOD, REACH, Lidar
from skillwing.sim_mujoco.simulator import simulator
from skillwing.sim_mujoco.world.kinds import KINDS
from skillwing.sim_mujoco.world.rays import Floats, RayScene
from skillwing.sim_mujoco.world.world import World, make_world

SENSORS_PAGE = Path(__file__).parents[1] / "docs" / "sensors.md"
PASSED: Final = 0.01
"""Difference in length to the reference ray from which a ray counts as slipped through a surface [m]."""
FAR_OFF: Final = 5.0
"""Multiple of the camera's noise from which a pixel's error counts as far off."""
RULES: Final[dict[str, type[Infill]]] = {
    "both sides: as it is": Infill,
    "either side": EitherSide,
    "both sides, and every second row": EverySecondRow,
}
_BLOCKS, _BLOCK = 5, 2.0
"""Number of flights, and duration of each [s]."""
_EVERYWHERE = 1e4

Counts = dict[str, list[list[float]]]
"""Rows of a table: numbers, world by world."""


class Differences:
    """Counted errors in some worlds."""

    def __init__(self) -> None:
        self.pictures: Counts = {}
        """Counts by rule: pixels, rays, pixels in reach; of these, those off by more than the noise, and far off."""
        self.rays: Counts = {}
        """Counts by kind: rays, other end in robust mode, slipped through, slipped without a return, slipped in robust
        mode; and the largest other difference [m]."""
        self.unseen: Counts = {}
        """Counts by sensor: rays that hit something in reach; of these, rays without a measurement."""

    def count(self, world: World, motions: Sequence[Motion]) -> None:
        """Count the errors in one more world."""
        self._fill_pictures(world, motions)
        self._cast_robustly(world, motions)
        self._lose(world, motions)

    def _fill_pictures(self, world: World, motions: Sequence[Motion]) -> None:
        rays = WatchedRays(world.triangles())
        every = camera_with(EveryPixel, rays)
        truths = [_within_reach(every.true_depth(motion)) for motion in motions]
        for name, rule in RULES.items():
            camera, before, found = camera_with(rule, rays), rays.cast, np.zeros(4)
            for motion, truth in zip(motions, truths, strict=True):
                depth = _within_reach(camera.true_depth(motion))
                off = np.abs(depth - truth) / depth_pictures.noise_at(truth)
                near = np.minimum(depth, truth) < depth_pictures.REACH
                found += truth.size, near.sum(), (off > 1.0).sum(), (off > FAR_OFF).sum()
            pixels, *others = found.tolist()
            self.pictures.setdefault(name, []).append([pixels, rays.cast - before, *others])

    def _cast_robustly(self, world: World, motions: Sequence[Motion]) -> None:
        whole, ground = world.triangles(), Ground(world)
        all_of_it = RayScene(whole), RobustRays(whole)
        bare = RayScene(ground.triangles), RobustRays(ground.triangles)
        kinds: dict[str, tuple[tuple[RayScene, RayScene], float, Iterable[Rays]]] = {
            "depth camera, every pixel": (all_of_it, depth_pictures.REACH, map(picture_rays, motions)),
            "LiDAR": (all_of_it, REACH, map(scan_rays, motions)),
            "at the bare ground, anywhere": (bare, _EVERYWHERE, map(ground.anywhere, motions)),
            "at edges of its triangles": (bare, _EVERYWHERE, map(ground.edges, motions)),
            "straight down on its corners": (bare, _EVERYWHERE, [ground.corners()]),
        }
        for name, (scenes, reach, casts) in kinds.items():
            found, largest = np.zeros(5), 0.0
            for rays in casts:
                ours, robust = (scene.distances(*rays, reach, nothing=np.inf) for scene in scenes)
                slipped, reverse = ours > robust + PASSED, robust > ours + PASSED
                lost, other = slipped & np.isinf(ours), ours != robust
                found += len(ours), other.sum(), slipped.sum(), lost.sum(), reverse.sum()
                other &= ~(slipped | reverse)
                largest = max(largest, float(np.abs(ours[other] - robust[other]).max(initial=0.0)))
            self.rays.setdefault(name, []).append([*found.tolist(), largest])

    def _lose(self, world: World, motions: Sequence[Motion]) -> None:
        rays, rng = RayScene(world.triangles()), np.random.default_rng(world.seed)
        camera, scanner, found = depth_camera.DepthCamera(rays, rng), Lidar(rays, rng), np.zeros((2, 2))
        for motion in motions:
            seen = _within_reach(camera.true_depth(motion)) < depth_pictures.REACH
            hit = rays.distances(*scan_rays(motion), REACH) > 0.0
            lost, silent = camera.picture(motion) == 0.0, _scan(scanner, motion).ravel() == 0.0
            found += (seen.sum(), (seen & lost).sum()), (hit.sum(), (hit & silent).sum())
        for name, counts in zip(("pixels", "shots"), found.tolist(), strict=True):
            self.unseen.setdefault(name, []).append(counts)


def _within_reach(depth: Floats) -> Floats:
    """Depths beyond the camera's reach, and missing ones, become its reach."""
    return np.where(depth > 0.0, depth, np.inf).clip(max=depth_pictures.REACH).astype(np.float32)


def _scan(scanner: Lidar, motion: Motion) -> Floats:
    return scanner.scan([motion, replace(motion, t=PERIOD)], 0.0, PERIOD)


def differences_told(found: Differences, count: int) -> str:
    """Differences as Markdown; `count` places in each world."""
    unseen = {name: np.array(rows).T for name, rows in found.unseen.items()}
    pixels, shots = (_share(lost, hit, 1e2) for hit, lost in (unseen["pixels"], unseen["shots"]))
    worlds = len(found.unseen["pixels"])
    seeds = worlds // len(KINDS)
    return f"""{count} places along the route of each of {worlds} worlds (seeds 1 to {seeds} of each kind); the least
and the largest share of a world are in brackets. {machine()}.

**Pixels that are computed.** An eighth of the pixels is always cast: every second one of every fourth row. One between
known ones is cast where the line through them is broken, and computed elsewhere. The reference is a ray for every pixel
with something in reach. Off: by more than the camera's noise. Far off: by {FAR_OFF:g} times as much, because
something was missed or is on the wrong side of an edge.

{_pictures_told(found.pictures)}

**Rays without Embree's robust mode.** The reference is the same rays in that mode. End elsewhere: by as little as
their last digit. Slip through: they end more than {1e2 * PASSED:g} cm farther away, or nowhere.

{_rays_told(found.rays)}

For other reasons {pixels} % of the pixels with something in reach have no depth. Of the
LiDAR's shots at something in reach {shots} % have no return."""


def _pictures_told(pictures: Counts) -> str:
    rows: list[list[str]] = []
    for name, counts in pictures.items():
        pixels, cast, near, off, far = np.array(counts).T
        rays = _share(cast, pixels, 1e2), _share(cast - pixels / 8, pixels, 1e2)
        rows.append([name, *rays, _share(off, near, 1e6), _share(far, near, 1e6)])
    heads = ["cast where the line is broken on", "rays, % of the pixels", "beside the eighth"]
    return table([*heads, "off, per million", "far off, per million"], rows)


def _rays_told(rays: Counts) -> str:
    rows: list[list[str]] = []
    for name, counts in rays.items():
        number, other, slipped, lost, reverse, largest = np.array(counts).T
        slips = f"{slipped.sum():.0f}", _share(slipped, number, 1e6), f"{lost.sum():.0f}", f"{reverse.sum():.0f}"
        most = f"{1e3 * largest.max():.2g}"
        rows.append([name, f"{number.sum():.0f}", _share(other, number, 1e2), most, *slips])
    heads = ["rays", "number", "end elsewhere, %", "by at most, mm, if they do not slip", "slip through"]
    return table([*heads, "per million", "and end nowhere", "slip in robust mode only"], rows)


def _share(part: NDArray[np.float64], whole: NDArray[np.float64], of: float) -> str:
    each = of * part / whole
    total, least, largest = (_short(value) for value in (of * part.sum() / whole.sum(), each.min(), each.max()))
    return total if least == largest else f"{total} ({least} to {largest})"


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def times_told(worlds: Sequence[World], count: int) -> str:
    """Time ratios of the alternatives to the rules in use, measured in turns, as Markdown."""
    blocks: dict[str, list[tuple[list[float], list[float]]]] = {}
    casting: list[float] = []
    for world in worlds:
        motions, triangles = list(places(world, count)), world.triangles()
        plain, robust, watched = RayScene(triangles), RobustRays(triangles), WatchedRays(triangles)
        ours = camera_with(Infill, plain).picture
        scans = [partial(_scan, Lidar(rays, np.random.default_rng(1))) for rays in (robust, plain)]
        pairs: dict[str, Sequence[Callable[[Motion], object]]] = {
            "depth picture, cast where broken on either side": (camera_with(EitherSide, plain).picture, ours),
            "depth picture, every pixel cast": (camera_with(EveryPixel, plain).picture, ours),
            "depth picture in robust mode": (camera_with(Infill, robust).picture, ours),
            "LiDAR scan in robust mode": scans,
        }
        for name, calls in pairs.items():
            for call in calls:
                call(motions[0])  # Embree builds its tree with the first ray
            costs = [[_cost(partial(call, motion)) for call in calls] for motion in motions]
            blocks.setdefault(name, []).append(([other for other, _ in costs], [own for _, own in costs]))
        picture = camera_with(Infill, watched).picture
        picture(motions[0])
        watched.seconds = 0.0
        taken = sum(_cost(partial(picture, motion)) for motion in motions)
        casting.append(100 * watched.seconds / taken)
    blocks["simulator with all sensors in robust mode"] = _flights(worlds[0])
    rows = [[name, ratio(each)] for name, each in blocks.items()]
    return f"""What the sensors could use instead of what they do use, by turns with that: at {count} places along the
route of each of {len(worlds)} worlds, and in {_BLOCKS} flights of {_BLOCK:g} s. Ratios of medians of processor time,
with the least and the largest of a world or flight in brackets. Casting is {median(casting):.0f} % of what a depth
picture takes ({min(casting):.0f} to {max(casting):.0f}). What goes wrong is counted in [sensors.md](sensors.md).
{machine()}.

{table(["instead", "times as long"], rows)}"""


def _cost(call: Callable[[], object]) -> float:
    """Processor time of one call [s]."""
    started = time.process_time()
    call()
    return time.process_time() - started


def _flights(world: World) -> list[tuple[list[float], list[float]]]:
    with patch.object(simulator, "RayScene", RobustRays):
        robust = simulator.Simulator(world)
    pair = robust, simulator.Simulator(world)
    for each in pair:
        fly(each, _BLOCK)
    costs = [[_cost(partial(fly, each, _BLOCK)) for each in pair] for _ in range(_BLOCKS)]
    return [([other], [own]) for other, own in costs]


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seeds", type=int, default=2, help="worlds of each kind")
    options.add_argument("--places", type=int, default=16, help="places in each world")
    options.add_argument("--no-times", action="store_true", help="count only, on a machine that has other work")
    options.add_argument(
        "--write", action="store_true", help="into docs/sensors.md, and times into docs/performance.md"
    )
    wanted = options.parse_args()
    if min(wanted.seeds, wanted.places) < 1:
        options.error("give one seed and one place at least")
    worlds = [make_world(seed, kind) for kind in KINDS for seed in range(1, wanted.seeds + 1)]
    found = Differences()
    for world in worlds:
        found.count(world, list(places(world, wanted.places)))
    told = differences_told(found, wanted.places)
    write_section(
        "ray_choices.py", "What is not cast, and what slips through", told, write=wanted.write, file=SENSORS_PAGE
    )
    if not wanted.no_times:
        write_section("ray_choices.py", "Rays", times_told(worlds, wanted.places), write=wanted.write)


if __name__ == "__main__":
    main()
