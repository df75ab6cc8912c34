"""Quality of LiDAR-inertial odometry and its map on mapping flights: figures for docs/mapping.md.

    python benchmarks/odometry.py [--seeds 196:212] [--jobs 1] [--keep FILE] [--write]
    python benchmarks/odometry.py --method small-gicp [--seeds 196:199] [--keep FILE] [--recorded FOLDER] [--write]

Flies each seed's route with the whole simulator, once with the nose along the track and once across it, and compares
with the true motion. In flight a copy of the odometry gets each fault of the two sensors, until it detects the fault
or 10 s are over. With `--keep` a file stores finished flights, which are not flown again.

With another `--method` than ours both follow the same flights, without faults. The folder `--recorded` stores the
measurements of flights, which are not flown again.
"""

from __future__ import annotations

import copy
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from statistics import median

import msgspec
import numpy as np
from mapping_flight import MappingFlight, Moment, as_navigation
from odometry_compared import GICP, OURS, compare
from odometry_compared import report as report_comparison
from odometry_on_flight import TruePath, as_scan, drifts, give, make_odometry, off, rms, turned
from performance_page import PAGE, machine, make_parser, spread, spread_said, table, write_section
from recorded_flight import flights
from workers import workers

from skillwing.evaluation.flights.coverage import CoverageJudge
from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.mapping.localiser import ByNavigation
from skillwing.onboard.mapping.mapper import REACH, Mapper
from skillwing.onboard.mapping.node import VOXEL_SIZE
from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.onboard.odometry.divergence_monitor import FEWEST_MATCHES, LARGEST_NIS, LEAST_CLOSE
from skillwing.onboard.odometry.gicp import MissingLibraryError
from skillwing.onboard.odometry.odometry import Fix, LidarInertialOdometry, Phase
from skillwing.sim_mujoco.sensors.channel import Measurement
from skillwing.sim_mujoco.sensors.corruptors import make_corruptor
from skillwing.sim_mujoco.world.layouts.courtyard import BOUNDS

MAPPING_PAGE = PAGE.with_name("mapping.md")
DEMAND = 0.3
"""Largest permitted drift of a flight, RMS [m]."""
NOSES = (("along the track", False), ("across it", True))
SEEDS, SEEDS_TO_COMPARE = "196:212", "196:199"
"""Default seeds: of flights, and of a comparison of methods."""
LOOKED_AT = range(196)
"""Seeds on which constants were chosen, or that were examined during a fix."""
FAULT_AT, TRIED_FOR = 30.0, 10.0
FAULTS: tuple[tuple[str, str, float | None], ...] = (
    ("lidar", "bias", 1.0),
    ("lidar", "bias", 0.3),
    ("lidar", "noise", 2.0),
    ("lidar", "noise", 0.2),
    ("lidar", "freeze", None),
    ("lidar", "blackout", None),
    ("imu", "bias", 1.0),
    ("imu", "bias", 0.1),
    ("imu", "noise", 2.0),
    ("imu", "freeze", None),
    ("imu", "blackout", None),
    ("imu", "dropout", 0.8),
)
"""Faults: sensor, kind, magnitude in the sensor's units (m; m/s2 and rad/s)."""


class Trial(msgspec.Struct, frozen=True):
    """Detection of one fault: delay [s], None if it was missed, and the additional pose error until then [m]."""

    sensor: str
    kind: str
    magnitude: float | None
    noticed: float | None
    error: float


class Result(msgspec.Struct, frozen=True):
    """Figures of one flight. rms, worst, final: errors of the published ENU position [m]. drift: RMS of the drift from
    the first pose, with that pose aligned [m]. nis, fitting, matched: least favourable values of a scan
    (`divergence_monitor.py`). times, map_times: processor times [s]."""

    seed: int
    across: bool
    way: float
    rms: float
    worst: float
    final: float
    drift: float
    heading: float
    sigmas: float
    scans: int
    rejected: int
    nis: float
    fitting: float
    matched: int
    lost: bool
    times: tuple[float, ...]
    map_times: tuple[float, ...]
    coverage: tuple[float | None, float | None, float | None]
    map_error: float | None
    navigation_coverage: tuple[float | None, float | None, float | None]
    navigation_map_error: float | None
    mismatch: float
    trials: tuple[Trial, ...]


class Try:
    """One fault on a copy of the odometry."""

    def __init__(
        self, odometry: LidarInertialOdometry, fault: tuple[str, str, float | None], began: float, error: float
    ) -> None:
        self._odometry, self._fault, self._began, self._before = copy.deepcopy(odometry), fault, began, error
        self._corruptor = make_corruptor(fault[1], fault[2], np.random.default_rng(7))
        self._error = 0.0
        self._noticed: float | None = None

    def feed(self, moment: Moment, path: TruePath) -> None:
        if self._noticed is not None or moment.truth.t > self._began + TRIED_FOR:
            return
        for measurement in moment.happened.measurements:
            data = measurement.data
            if measurement.sensor == self._fault[0]:
                corrupted = self._corruptor.apply(data)
                if corrupted is None:
                    continue
                data = corrupted
            fix = give(self._odometry, Measurement(measurement.sensor, measurement.start, measurement.end, data))
            if fix is not None and self._odometry.phase is not Phase.LOST:
                self._error = max(self._error, off(fix, path.at(fix.t)) - self._before)
        self._odometry.check(moment.truth.t)
        if self._odometry.phase is Phase.LOST:
            self._noticed = moment.truth.t - self._began

    @property
    def trial(self) -> Trial:
        return Trial(*self._fault, self._noticed, self._error)


def fly(job: tuple[int, bool]) -> Result:
    """Fly a seed with the nose along or across the track, and measure everything in `Result`."""
    seed, across = job
    flight = MappingFlight(seed, across=across)
    low, high = BOUNDS.low, BOUNDS.high
    odometry = make_odometry()
    mapper, reference = (Mapper(OccupancyGrid(low, high, VOXEL_SIZE)) for _ in range(2))
    by_navigation = ByNavigation()
    fixes: list[Fix] = []
    path, truths = TruePath(), list[Motion]()
    times: list[float] = []
    map_times: list[float] = []
    mismatches: list[float] = [0.0]
    tries: list[Try] = []
    for moment in flight:
        truth = moment.truth
        path.go_on(truth)
        if not mapper.running and truth.position[2] > flight.world.route[0][2] - 0.3:
            mapper.start()
            reference.start()
        for measurement in moment.happened.measurements:
            started = time.process_time()
            fix = give(odometry, measurement)
            if fix is not None:
                times.append(time.process_time() - started)
                fixes.append(fix)
                truths.append(path.at(fix.t))
                if fix.accepted and mapper.running:
                    placed = fix.placed(REACH)
                    mismatches.append(mapper.grid.fit(mapper.grid.hit_by(placed.points)).mismatch)
                    started = time.process_time()
                    mapper.add(placed)
                    map_times.append(time.process_time() - started)
            if measurement.sensor == "lidar":
                by_navigation.scan(as_scan(measurement))
        for solution in moment.happened.solutions:
            odometry.navigation(as_navigation(solution))
            placement = by_navigation.navigation(as_navigation(solution))
            if placement is not None and placement.points is not None:
                reference.add(placement.points)
        if not tries and truth.t >= FAULT_AT:
            tries = [Try(odometry, fault, truth.t, off(fixes[-1], truths[-1])) for fault in FAULTS]
        for each in tries:
            each.feed(moment, path)
    judge = CoverageJudge(flight.world, flight.world.route)
    judged = [judge.coverage(m.grid.occupied_centres(), m.grid.size) for m in (mapper, reference)]
    errors = np.array([off(fix, truth) for fix, truth in zip(fixes, truths, strict=True)])
    aligned = drifts(fixes, truths)
    normed = [
        (fix.levelled.position - fixes[0].levelled.position - (np.array(truth.position) - truths[0].position))
        / fix.position_sigma
        for fix, truth in zip(fixes, truths, strict=True)
    ]
    return Result(
        seed=seed,
        across=across,
        way=fixes[-1].way,
        rms=rms(errors),
        worst=float(errors.max()),
        final=float(errors[-1]),
        drift=rms(aligned),
        heading=turned(fixes[-1], truths[-1]),
        sigmas=rms(np.array(normed)[1:].ravel()),
        scans=len(fixes),
        rejected=sum(not fix.accepted for fix in fixes),
        nis=max(fix.nis for fix in fixes),
        fitting=min(fix.agreement.close / fix.agreement.matched for fix in fixes if fix.agreement.matched),
        matched=min(fix.agreement.matched for fix in fixes if fix.agreement.matched),
        lost=odometry.phase is Phase.LOST,
        times=tuple(times),
        map_times=tuple(map_times),
        coverage=(judged[0].all, judged[0].buildings, judged[0].terrain),
        map_error=judged[0].error,
        navigation_coverage=(judged[1].all, judged[1].buildings, judged[1].terrain),
        navigation_map_error=judged[1].error,
        mismatch=max(mismatches),
        trials=tuple(each.trial for each in tries),
    )


# --- report --------------------------------------------------------------------------------------------------


def report(results: Sequence[Result], seeds: str) -> str:
    both = [(name, [r for r in results if r.across is across]) for name, across in NOSES]
    heads = ("", *(f"nose {name}" for name, _ in both))
    rows: list[tuple[str, Callable[[Result], float]]] = [
        ("drift from the first pose, RMS [m]", lambda r: r.drift),
        ("error in ENU, RMS [m]", lambda r: r.rms),
        ("error in ENU, largest [m]", lambda r: r.worst),
        ("error in ENU at the end [m]", lambda r: r.final),
        ("attitude error at the end [degrees]", lambda r: r.heading),
        ("error over published sigma, RMS", lambda r: r.sigmas),
        (f"largest NIS of a scan (rejected above {LARGEST_NIS:g})", lambda r: r.nis),
        (f"least share of its points that fit (rejected below {LEAST_CLOSE:g})", lambda r: r.fitting),
        (f"fewest of its points on planes (rejected below {FEWEST_MATCHES})", lambda r: r.matched),
        ("way [m]", lambda r: r.way),
    ]
    lines = [(name, *(spread([of(r) for r in group]) for _, group in both)) for name, of in rows]
    times = 1e3 * np.array([t for r in results for t in r.times])
    map_times = 1e3 * np.array([t for r in results for t in r.map_times])
    scans, rejected = sum(r.scans for r in results), sum(r.rejected for r in results)
    lost = sum(r.lost for r in results)
    return "\n\n".join(
        [
            f"Seeds {seeds}, {len(results)} flights by the whole simulator; "
            f"{spread_said(len({r.seed for r in results}))}. {past(results)} {machine()}.",
            table(heads, lines),
            seed_table(results),
            verdict(results),
            f"A scan takes {np.median(times):.1f} ms of processor time (99 % below {np.quantile(times, 0.99):.1f} ms), "
            f"and {np.median(map_times):.1f} ms ({np.quantile(map_times, 0.99):.1f} ms) to be integrated into the map.",
            f"In {scans / 36000:.2f} hours of good flight {rejected} of {scans} scans were rejected, and {lost} of "
            f"{len(results)} flights ended in a divergence.",
            "### The map",
            map_table(both),
            "### Faults that odometry notices by itself",
            f"Each fault begins {FAULT_AT:g} s into the flight and is tried for {TRIED_FOR:g} s. The error is "
            "that of poses published until then, in excess of the error before the fault.",
            fault_table(results),
        ]
    )


def past(results: Sequence[Result]) -> str:
    """Earlier use of the flown seeds."""
    looked_at = {r.seed for r in results}.intersection(LOOKED_AT)
    return (
        f"Constants were chosen and mistakes fixed by flights of seeds {LOOKED_AT[0]} to {LOOKED_AT[-1]}, "
        f"{len(looked_at)} of them here."
    )


def verdict(results: Sequence[Result]) -> str:
    """Sentence on the flights that met the demand, those that missed it, and those that odometry noticed."""
    told: list[str] = []
    for name, across in NOSES:
        group = [r for r in results if r.across is across]
        missed = [r for r in group if r.lost or r.drift > DEMAND]
        told.append(f"by {len(group) - len(missed)} of {len(group)} flights with the nose {name}")
        if missed:
            which = (f"seed {r.seed} with {r.drift:.2f} m, {'' if r.lost else 'not '}noticed" for r in missed)
            told[-1] += f" (missed: {'; '.join(which)})"
    return f"A drift of at most {DEMAND:g} m (RMS) is demanded of a flight. It is kept {' and '.join(told)}."


def seed_table(results: Sequence[Result]) -> str:
    """Drift of each flight."""
    drifted = {(r.seed, r.across): f"{r.drift:.2f}" + (", lost" if r.lost else "") for r in results}
    seeds = sorted({r.seed for r in results})
    lines = [(f"nose {name}", *(drifted.get((seed, across), "-") for seed in seeds)) for name, across in NOSES]
    return table(("drift, RMS [m], of seed", *map(str, seeds)), lines)


def map_table(both: Sequence[tuple[str, Sequence[Result]]]) -> str:
    lines: list[tuple[str, ...]] = []
    for name, group in both:
        for source, shares, error in (
            ("odometry", lambda r: r.coverage, lambda r: r.map_error),
            ("navigation", lambda r: r.navigation_coverage, lambda r: r.navigation_map_error),
        ):
            cells = [spread([s for r in group if (s := shares(r)[k]) is not None]) for k in range(3)]
            off_by = spread([e for r in group if (e := error(r)) is not None])
            worst = f"{max((r.mismatch for r in group), default=0.0):.3f}" if source == "odometry" else ""
            lines.append((f"nose {name}, poses of {source}", *cells, off_by, worst))
    return table(("", "all", "buildings", "terrain", "error [m]", "worst mismatch"), lines)


def fault_table(results: Sequence[Result]) -> str:
    lines: list[tuple[str, ...]] = []
    for sensor, kind, magnitude in FAULTS:
        trials = [t for r in results for t in r.trials if (t.sensor, t.kind, t.magnitude) == (sensor, kind, magnitude)]
        noticed = [t.noticed for t in trials if t.noticed is not None]
        when = f"{median(noticed):.1f} s, at most {max(noticed):.1f} s" if noticed else "-"
        worst = max((t.error for t in trials), default=0.0)
        name = f"{sensor} {kind}" + ("" if magnitude is None else f" {magnitude:g}")
        lines.append((name, f"{len(noticed)} of {len(trials)}", when, f"{worst:.2f}"))
    return table(("fault", "noticed", "after", "largest error [m]"), lines)


def remembered(file: Path | None) -> list[Result]:
    if file is None or not file.exists():
        return []
    return [msgspec.json.decode(line, type=Result) for line in file.read_bytes().splitlines()]


def flown(jobs: Iterable[tuple[int, bool]], processes: int, keep: Path | None) -> Iterator[Result]:
    with workers(processes) as pool:
        for result in pool.map(fly, jobs):
            line = f"seed {result.seed}, across: {result.across}, drift {result.drift:.3f}, ENU {result.rms:.3f} m"
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
            if keep is not None:
                with keep.open("ab") as file:
                    file.write(msgspec.json.encode(result) + b"\n")
            yield result


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument(
        "--method", choices=(OURS, GICP), default=OURS, help="what ours is compared with, if it is another"
    )
    options.add_argument(
        "--seeds", help=f"first seed and the one after the last; {SEEDS}, or {SEEDS_TO_COMPARE} to compare methods"
    )
    options.add_argument("--jobs", type=int, default=1, help="flights at the same time")
    options.add_argument("--keep", type=Path, help="file that remembers finished flights")
    options.add_argument("--recorded", type=Path, help="folder that remembers what was measured, to compare methods")
    wanted = options.parse_args()
    if wanted.method == OURS:
        _measure(wanted.seeds or SEEDS, wanted.jobs, wanted.keep, write=wanted.write)
        return
    seeds = wanted.seeds or SEEDS_TO_COMPARE
    try:
        outcomes = compare(wanted.method, flights(seeds), wanted.jobs, wanted.recorded, wanted.keep)
    except MissingLibraryError as error:
        raise SystemExit(str(error)) from error
    body, variant = report_comparison(outcomes, wanted.method, seeds), f"--method {wanted.method}"
    title = f"Odometry compared with {wanted.method}"
    write_section("odometry.py", title, body, write=wanted.write, file=MAPPING_PAGE, variant=variant)


def _measure(seeds: str, processes: int, keep: Path | None, *, write: bool) -> None:
    jobs = flights(seeds)
    known = [r for r in remembered(keep) if (r.seed, r.across) in jobs]
    done = {(r.seed, r.across) for r in known}
    results = [*known, *flown([job for job in jobs if job not in done], processes, keep)]
    results.sort(key=lambda r: (r.seed, r.across))
    write_section("odometry.py", "Odometry, measured", report(results, seeds), write=write, file=MAPPING_PAGE)


if __name__ == "__main__":
    main()
