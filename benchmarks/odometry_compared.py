"""Comparison of our odometry with alternatives, on the same measurements of the same flights."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from mapping_flight import Moment, as_navigation
from odometry_on_flight import TruePath, drifts, give, make_odometry, off, rms, turned
from performance_page import machine, spread, spread_said, table
from recorded_flight import moments
from workers import workers

from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.mapping.mapper import REACH, Mapper
from skillwing.onboard.mapping.node import MAP_DIVERGED, VOXEL_SIZE
from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.onboard.odometry.gicp import gicp_matcher
from skillwing.onboard.odometry.matching import MakeMatcher, PlaneMatcher
from skillwing.onboard.odometry.odometry import Fix, Phase
from skillwing.sim_mujoco.world.layouts.courtyard import BOUNDS

OURS, GICP = "ours", "small-gicp"
_ABOVE = 1.0
"""Height of the drone at which the map begins [m]."""


class Outcome(msgspec.Struct, frozen=True):
    """Tracking of one flight by one method, until a divergence.

    drift, rms, worst, final, heading: as in `odometry.Result` [m, degrees]. times: processor times of scans [s].
    lost_at, lost: time and reason of a divergence; empty without one.
    """

    method: str
    seed: int
    across: bool
    drift: float
    rms: float
    worst: float
    final: float
    heading: float
    scans: int
    rejected: int
    times: tuple[float, ...]
    lost_at: float | None
    lost: str


class Follower:
    """One method that follows a flight."""

    def __init__(self, method: str, box: Box) -> None:
        self.method = method
        self._odometry = make_odometry(_matcher(method))
        self._mapper = Mapper(OccupancyGrid(box.low, box.high, VOXEL_SIZE))
        self._fixes: list[Fix] = []
        self._path, self._truths = TruePath(), list[Motion]()
        self._times: list[float] = []
        self._lost_at: float | None = None
        self._lost = ""

    def feed(self, moment: Moment) -> None:
        """Take the measurements of a moment, unless the method or its map has diverged."""
        if self._lost:
            return
        self._path.go_on(moment.truth)
        if moment.truth.position[2] > _ABOVE:
            self._mapper.start()
        for measurement in moment.happened.measurements:
            started = time.process_time()
            fix = give(self._odometry, measurement)
            if fix is not None:
                self._times.append(time.process_time() - started)
                self._fixes.append(fix)
                self._truths.append(self._path.at(fix.t))
                if fix.accepted:
                    self._mapper.add(fix.placed(REACH))
        for solution in moment.happened.solutions:
            self._odometry.navigation(as_navigation(solution))
        self._odometry.check(moment.truth.t)
        if self._odometry.phase is Phase.LOST or self._mapper.diverged:
            self._lost_at = moment.truth.t
            self._lost = self._odometry.text or MAP_DIVERGED

    def outcome(self, seed: int, *, across: bool) -> Outcome:
        fixes, truths = self._fixes, self._truths
        errors = np.array([off(fix, truth) for fix, truth in zip(fixes, truths, strict=True)])
        return Outcome(
            method=self.method,
            seed=seed,
            across=across,
            drift=rms(drifts(fixes, truths)),
            rms=rms(errors),
            worst=float(errors.max()),
            final=float(errors[-1]),
            heading=turned(fixes[-1], truths[-1]),
            scans=len(fixes),
            rejected=sum(not fix.accepted for fix in fixes),
            times=tuple(self._times),
            lost_at=self._lost_at,
            lost=self._lost,
        )


def _matcher(method: str) -> MakeMatcher:
    return PlaneMatcher if method == OURS else gicp_matcher()


def compare(
    method: str, flights: Sequence[tuple[int, bool]], processes: int, folder: Path | None, keep: Path | None
) -> list[Outcome]:
    """Results of our method and of `method` on each flight, with `processes` flights at once.

    folder: store of measurements. keep: file of results, which are not computed again. Raises MissingLibraryError.
    """
    _matcher(method)
    known = {(o.method, o.seed, o.across): o for o in _remembered(keep)}
    missing = [
        ([each for each in (OURS, method) if (each, seed, across) not in known], seed, across, folder)
        for seed, across in flights
    ]
    with workers(processes) as pool:
        for outcomes in pool.map(_followed, [each for each in missing if each[0]]):
            for outcome in outcomes:
                known[outcome.method, outcome.seed, outcome.across] = outcome
                if keep is not None:
                    with keep.open("ab") as file:
                        file.write(msgspec.json.encode(outcome) + b"\n")
    return [known[each, seed, across] for seed, across in flights for each in (OURS, method)]


def _followed(wanted: tuple[Sequence[str], int, bool, Path | None]) -> list[Outcome]:
    """Results of methods on one flight. wanted: methods, seed, nose across the track, folder of recordings."""
    methods, seed, across, folder = wanted
    followers = [Follower(each, BOUNDS) for each in methods]
    for moment in moments(seed, across=across, folder=folder):
        for follower in followers:
            follower.feed(moment)
    return [follower.outcome(seed, across=across) for follower in followers]


def _remembered(keep: Path | None) -> list[Outcome]:
    if keep is None or not keep.exists():
        return []
    return [msgspec.json.decode(line, type=Outcome) for line in keep.read_bytes().splitlines()]


def report(outcomes: Sequence[Outcome], method: str, seeds: str) -> str:
    groups = [
        (f"{name}, nose {way} the track", [o for o in outcomes if o.method == name and o.across is across])
        for across, way in ((False, "along"), (True, "across"))
        for name in (OURS, method)
    ]
    rows = [
        ("drift from the first pose, RMS [m]", [spread([o.drift for o in group]) for _, group in groups]),
        ("error in ENU, RMS [m]", [spread([o.rms for o in group]) for _, group in groups]),
        ("error in ENU, largest [m]", [spread([o.worst for o in group]) for _, group in groups]),
        ("error in ENU at the end [m]", [spread([o.final for o in group]) for _, group in groups]),
        ("attitude error at the end [degrees]", [spread([o.heading for o in group]) for _, group in groups]),
        ("scans rejected", [f"{sum(o.rejected for o in g)} of {sum(o.scans for o in g)}" for _, g in groups]),
        ("flights with a divergence", [f"{sum(bool(o.lost) for o in g)} of {len(g)}" for _, g in groups]),
        ("a scan, processor time, median (99 %) [ms]", [_cost([t for o in g for t in o.times]) for _, g in groups]),
    ]
    drift = {(o.method, o.across, o.seed): o.drift for o in outcomes}
    numbers = sorted({o.seed for o in outcomes})
    by_seed = [
        (f"{name}, nose {way} the track", *(f"{drift[name, across, seed]:.2f}" for seed in numbers))
        for across, way in ((False, "along"), (True, "across"))
        for name in (OURS, method)
    ]
    return "\n\n".join(
        [
            f"Both on the same measurements; seeds {seeds}, on which ours was not tuned, {len(outcomes) // 2} flights "
            f"by the whole simulator; {spread_said(len(numbers))}. {machine()}.",
            table(("", *(name for name, _ in groups)), [(name, *cells) for name, cells in rows]),
            table(("drift, RMS [m], of seed", *map(str, numbers)), by_seed),
            _divergences(outcomes),
        ]
    )


def _cost(times: Sequence[float]) -> str:
    return f"{1e3 * np.median(times):.1f} ({1e3 * np.quantile(times, 0.99):.1f})"


def _divergences(outcomes: Sequence[Outcome]) -> str:
    lines = [
        f"- {o.method}, seed {o.seed}, nose {'across' if o.across else 'along'} the track: after {o.lost_at:.1f} s, "
        f"{o.lost}; figures are those until then."
        for o in outcomes
        if o.lost_at is not None
    ]
    return "\n".join(["Divergences that were noticed:", "", *lines]) if lines else "No divergence was noticed."
