"""Obstacle avoidance by camera and by LiDAR: writes the table in docs/obstacles.md.

    python benchmarks/obstacles.py [--seeds 1:7] [--jobs 2] [--keep FILE] [--write]

Flights are kept in FILE, one line each. Flights in FILE are not repeated, so an interrupted run continues and a run may
be extended.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

from obstacle_course import COURSES, Flown, fly, make_course
from performance_page import machine, make_parser, table, write_section
from workers import workers

from skillwing.onboard.topics.obstacles import ObstacleSource

PAGE = Path(__file__).parents[1] / "docs" / "obstacles.md"
SENSORS = {"camera": ObstacleSource.ZED, "LiDAR": ObstacleSource.LIDAR}
SLOW, FAST = 2.0, 5.0
GUSTY = 8.0
"""Wind at a height of 6 m that causes the turbulence [m/s]."""
WIND = (4.0, 3.0, 0.0)
"""Mean wind, ENU [m/s]. It moves the eddies past the drone: without it a gust would not end."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One flight. speed, turbulence [m/s]. watch: guidance uses the obstacle reports."""

    course: str
    sensor: str
    seed: int
    speed: float = SLOW
    turbulence: float = 0.0
    watch: bool = True


def trials(seeds: Sequence[int]) -> list[Trial]:
    """All trials of the page, in the order of seeds."""
    return [
        trial
        for seed in seeds
        for sensor in SENSORS
        for trial in (
            *(Trial(course, sensor, seed) for course in COURSES),
            *(Trial(course, sensor, seed, FAST, GUSTY) for course in ("poles", "wall")),
            Trial("poles", sensor, seed, watch=False),
        )
    ]


def flown(trial: Trial) -> Flown:
    """Fly a trial, in a worker process."""
    return fly(
        make_course(trial.course, trial.seed),
        SENSORS[trial.sensor],
        speed=trial.speed,
        watch=trial.watch,
        turbulence=trial.turbulence,
        wind=WIND if trial.turbulence > 0.0 else (0.0, 0.0, 0.0),
    )


class FlightFile:
    """Finished flights, also in a file if one is given."""

    def __init__(self, file: Path | None) -> None:
        self.flights: dict[Trial, Flown] = {}
        self._file = file
        if file is not None and file.exists():
            for line in file.read_text(encoding="utf-8").splitlines():
                read = json.loads(line)
                self.flights[Trial(**read["trial"])] = Flown(**read["flown"])

    def add(self, trial: Trial, result: Flown) -> None:
        self.flights[trial] = result
        line = json.dumps({"trial": asdict(trial), "flown": asdict(result)})
        sys.stderr.write(line + "\n")
        if self._file is not None:
            with self._file.open("a", encoding="utf-8") as out:
                out.write(line + "\n")


def fly_all(wanted: Iterable[Trial], kept: FlightFile, jobs: int) -> None:
    missing = [trial for trial in wanted if trial not in kept.flights]
    with workers(jobs) as pool:
        futures = {pool.submit(flown, trial): trial for trial in missing}
        for future in as_completed(futures):
            kept.add(futures[future], future.result())


def row(name: str, sensor: str, flights: Sequence[Flown]) -> list[str]:
    arrived = [flight for flight in flights if flight.arrived]
    clearances = sorted(flight.clearance for flight in flights)
    return [
        name,
        sensor,
        f"{len(arrived)} of {len(flights)}",
        str(sum(flight.collisions > 0 for flight in flights)),
        f"{max(0.0, clearances[0]):.2f} ({median(clearances):.2f})",
        f"{median(flight.blocked for flight in flights):g}",
        f"{median(flight.seconds for flight in arrived):.0f}" if arrived else "–",
    ]


def report(kept: FlightFile, wanted: Sequence[Trial], seeds: Sequence[int]) -> str:
    """Text of the section."""
    names = {(SLOW, 0.0, True): "{}", (FAST, GUSTY, True): "{}, 5 m/s in gusts", (SLOW, 0.0, False): "{}, unwatched"}
    rows: list[list[str]] = []
    for (speed, turbulence, watch), name in names.items():
        for course in COURSES:
            for sensor in SENSORS:
                condition = (course, sensor, speed, turbulence, watch)
                flights = [
                    kept.flights[trial]
                    for trial in wanted
                    if trial in kept.flights
                    and (trial.course, trial.sensor, trial.speed, trial.turbulence, trial.watch) == condition
                ]
                if flights:
                    rows.append(row(name.format(course), sensor, flights))
    heads = ("course", "by", "arrived", "flights with a collision", "least clearance [m] (median)", "stops", "time [s]")
    return (
        f"{table(heads, rows)}\n\nSeeds {seeds[0]} to {seeds[-1]}; {machine()}. Clearance is that of the blades' tips; "
        "stops and time are medians, the time that of the flights that arrived, take-off included."
    )


def _seeds(text: str) -> range:
    first, _, end = text.partition(":")
    try:
        seeds = range(int(first), int(end))
    except ValueError:
        seeds = range(0)
    if not seeds:
        raise argparse.ArgumentTypeError(f"{text!r} is no range of seeds; write it like 1:7")
    return seeds


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("--seeds", type=_seeds, default=range(1, 7), help="first seed and the one after the last")
    options.add_argument("--jobs", type=int, default=2, help="flights at once")
    options.add_argument("--keep", type=Path, help="file in which flights are kept")
    options.add_argument("--only-kept", action="store_true", help="fly nothing, tell of the flights that are kept")
    asked = options.parse_args()
    kept, wanted = FlightFile(asked.keep), trials(asked.seeds)
    if not asked.only_kept:
        fly_all(wanted, kept, asked.jobs)
    write_section("obstacles.py", "Courses", report(kept, wanted, asked.seeds), write=asked.write, file=PAGE)


if __name__ == "__main__":
    main()
