"""Two versions of the code, compared in turns: latency, processor time, recovery, cores, messages, simulator, flights.

python benchmarks/bench_against.py REV [--rounds 8] [--flights 3] [--write]

REV becomes a temporary checkout. In each round, both versions are measured one after the other, by the benchmarks of
this version and with this interpreter. Simulator and flights are measured by each version's own benchmarks, since their
modules have moved. `make bench-against REV=...` does the same.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import core_step
import latency
import message_costs
import recovery
from checkouts import IMPORT_ROOTS, ROOT, worktree
from peer_process import PeerError, PeerProcess, own_processes
from performance_page import machine, make_parser, percentile_99, spread, table, write_section

Trees = Mapping[str, Path]
"""Checkouts by name: NOW, and THEN."""
NOW, THEN = "now", "then"
FLIGHTS = 3
"""Flights of the recovery benchmark in each round."""
ABSENT = "not there"
"""Cell for something that the other checkout lacks."""


@dataclass(frozen=True)
class Line:
    """One quantity: a value for each round, of both versions. None for a version that lacks it."""

    label: str
    now: Sequence[float]
    then: Sequence[float] | None

    def cells(self) -> list[str]:
        """Label, median of each version, and the median of the ratios of the rounds with their least and largest."""
        here = f"{median(self.now):.2f}"
        if self.then is None:
            return [self.label, here, ABSENT, ""]
        ratios = [now / then for now, then in zip(self.now, self.then, strict=True) if then > 0.0]
        return [self.label, here, f"{median(self.then):.2f}", spread(ratios)]


def by_name(label: str, values: Mapping[str, Sequence[float]]) -> Line:
    """A line from the values of each version that has them."""
    return Line(label, values[NOW], values.get(THEN))


def joined(rounds: Sequence[Sequence[float]]) -> list[float]:
    """The values of all rounds."""
    return [each for values in rounds for each in values]


def open_each(trees: Trees, opened: Callable[[Path], PeerProcess]) -> dict[str, PeerProcess]:
    """A system of each checkout; without that of the other one if it does not start."""
    systems = {NOW: opened(trees[NOW])}
    try:
        systems[THEN] = opened(trees[THEN])
    except PeerError as error:
        sys.stderr.write(f"The other checkout does not start: {error}\n")
    return systems


# --- the benchmarks --------------------------------------------------------------------------------------------------


def latency_lines(trees: Trees, rounds: int, calls: int) -> Iterator[Line]:
    """Median of each kind of call and the processor time of a start, by round; 99th percentiles of all rounds.

    The systems have a recorder, as those of `skillwing up`.
    """
    with ExitStack() as stack:
        systems = open_each(trees, lambda tree: latency.open_system(stack, tree, recorded=True))
        blocks = latency.measure(systems, rounds, calls)
    told = {name: [each.publications for each in found] for name, found in blocks.items()}
    yield by_name("publications of a start", told)
    for row in latency.ROWS:
        times = {name: [getattr(block, row.kind) for block in found] for name, found in blocks.items()}
        medians = {name: [1e3 * median(each) for each in found] for name, found in times.items()}
        pooled = {name: [1e3 * percentile_99(joined(found))] for name, found in times.items()}
        yield by_name(f"{row.label}, p50, ms", medians)
        yield by_name(f"{row.label}, p99, ms", pooled)
    for process, label in latency.STARTING.items():
        used = {name: [1e3 * each.cpu[process] for each in found] for name, found in blocks.items()}
        yield by_name(f"CPU per start, {label}, ms", used)
    sums = {name: [1e3 * each.start_cpu for each in found] for name, found in blocks.items()}
    yield by_name("CPU per start, sum, ms", sums)


def recovery_lines(trees: Trees, rounds: int) -> Iterator[Line]:
    """Recovery from a dead camera; the first round is a warm-up."""
    with ExitStack() as stack:
        systems = open_each(trees, lambda tree: recovery.open_system(stack, tree))
        flown: dict[str, list[list[float]]] = {name: [] for name in systems}
        by_design: dict[str, list[float]] = {}
        for number in range(rounds + 1):
            for name in latency.turns(systems, number):
                times, waited = recovery.fly(systems[name], FLIGHTS)
                flown[name].append(times)
                by_design[name] = [1e3 * waited]
    label = "camera dead, until the first grant of the LiDAR branch"
    counted = {name: found[1:] for name, found in flown.items()}
    yield by_name(
        f"{label}, p50, ms", {name: [1e3 * median(each) for each in found] for name, found in counted.items()}
    )
    yield by_name(f"{label}, p99, ms", {name: [1e3 * percentile_99(joined(found))] for name, found in counted.items()})
    yield by_name(f"{label}, robot time by design, ms", by_design)


def step_lines(trees: Trees, rounds: int) -> Iterator[Line]:
    """Processor time of a step of each core."""
    found = in_turns(trees, core_step.run, rounds)
    for case in core_step.CASES:
        yield by_name(f"{case}, us", {name: [each[case] for each in runs] for name, runs in found.items()})


def message_lines(trees: Trees, rounds: int) -> Iterator[Line]:
    """Processor time to encode and decode each message."""
    found = in_turns(trees, message_costs.run, rounds)
    for kind in found[NOW][0]:
        for way in ("encode", "decode"):
            costs = {name: [each[kind][way] for each in runs] for name, runs in found.items() if kind in runs[0]}
            yield by_name(f"{way} `{kind}`, us", costs)


OWN_FIGURES = (
    (
        "sim_speed.py",
        r"\| the same with LiDAR, depth camera and IMU \| ([\d.]+)",
        "simulator with LiDAR, depth and IMU",
    ),
    ("sim_speed.py", r"\| and with the RGB camera at 15 Hz, in the courtyard \| ([\d.]+)", "the same and RGB at 15 Hz"),
    ("campaign_speed.py", r"([\d.]+) times (?:as fast as )?real time", "mapping flight in one process"),
    ("stack_speed.py", r"\| \d+ s \| ([\d.]+)", "mapping flight by the whole stack, wall time"),
)
"""Script of a version, its figure in times real time, and what that is."""


def speed_lines(trees: Trees, rounds: int) -> Iterator[Line]:
    """Time of a robot second in simulator and flights."""
    found = in_turns(trees, own_figures, rounds)
    for _, _, label in OWN_FIGURES:
        values = {name: [1e3 / each[label] for each in runs] for name, runs in found.items()}
        yield by_name(f"a robot second, {label}, ms", values)


def own_figures(tree: Path) -> dict[str, float]:
    """Figures of a version by its own scripts. Raises CalledProcessError and ValueError."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(str(tree / root) for root in IMPORT_ROOTS)}
    told = {
        name: subprocess.run(
            [sys.executable, str(tree / "benchmarks" / name)],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout
        for name in dict.fromkeys(script for script, _, _ in OWN_FIGURES)
    }
    figures: dict[str, float] = {}
    for name, pattern, label in OWN_FIGURES:
        match = re.search(pattern, told[name])
        if match is None:
            raise ValueError(f"`{name}` of {tree} tells no figure for: {label}.")
        figures[label] = float(match[1])
    return figures


def in_turns(trees: Trees, run: Callable[[Path], Any], rounds: int) -> dict[str, list[Any]]:
    """Results of a benchmark with each checkout, round by round; without those of a checkout where it fails."""
    results: dict[str, list[Any]] = {name: [] for name in trees}
    for number in range(rounds):
        for name in latency.turns(results, number):
            try:
                results[name].append(run(trees[name]))
            except (subprocess.CalledProcessError, ValueError):
                if name == NOW:
                    raise
                del results[name]
    return results


# --- the report ------------------------------------------------------------------------------------------------------


def section(revision: str, rounds: int, flights: int, lines: Sequence[Line], measured_on: str) -> str:
    """Section of the page. measured_on: machine and date, with the load before the flights, which are a load."""
    heads = ("", NOW, revision, "ratio (rounds)")
    return f"""Both versions were measured in turns, in {rounds} rounds, simulator and flights in {flights}. A
ratio is the median of the ratios of the rounds, with the least and the largest. A single number is of all rounds
together. Below 1, this version needs less.
What the other version lacks is *{ABSENT}*. Beside managers and client a process receives
everything, as a recorder does. {measured_on}.

{table(heads, [line.cells() for line in lines])}"""


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("revision", metavar="REV")
    options.add_argument("--rounds", type=int, default=8)
    options.add_argument("--flights", type=int, default=3, help="rounds of simulator and flights")
    options.add_argument("--calls", type=int, default=25, help="of each kind in a round")
    given = options.parse_args()
    try:
        with own_processes(), worktree(given.revision) as (revision, tree):
            trees = {NOW: ROOT, THEN: tree}
            lines = [
                *latency_lines(trees, given.rounds, given.calls),
                *recovery_lines(trees, given.rounds),
                *step_lines(trees, given.rounds),
                *message_lines(trees, given.rounds),
            ]
            measured_on = machine()
            lines += speed_lines(trees, given.flights)
    except (PeerError, ValueError) as error:
        sys.exit(str(error))
    body = section(revision, given.rounds, given.flights, lines, measured_on)
    write_section("bench_against.py", "An earlier version", body, write=given.write)


if __name__ == "__main__":
    main()
