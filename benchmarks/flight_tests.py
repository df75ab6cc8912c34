"""Flight quality and failsafes of the simulated drone: figures and pictures in docs/flight.md.

    python benchmarks/flight_tests.py [SECTION] [--seeds 3] [--write]

Each figure is the median of flights with different seeds (ground, noise, turbulence), with the least and the largest.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from typing import Any

import flight_plots
from flight_trials import (
    WIND,
    Flight,
    fence_run,
    guided_leg,
    gust,
    hover,
    into_wind,
    land_on_a_slope,
    low_battery,
    rotor_out,
    silence,
    step_response,
    turn,
)
from flight_without_fixes import lost_fixes, lost_fixes_seeing, route_without_fixes
from performance_page import machine, make_parser, table, write_section

DOCS = Path(__file__).parents[1] / "docs"
Figures = dict[str, float]
Trial = Callable[[int], tuple[Flight, Figures]]
WALLS = {"east": (1, 0, 0), "north": (0, 1, 0), "west": (-1, 0, 0), "south": (0, -1, 0), "ceiling": (0, 0, 1)}
LEFT = {"stopped": 0.0, "1/4 left": 0.25, "1/2 left": 0.5, "3/4 left": 0.75}
MODERATE: dict[str, Any] = {"wind": WIND, "turbulence": 15.4}
_SHARES = ("landed", "took off again", "right one", "at rest")
"""Figures that are yes or no: told as a number of flights."""


class FlightTests:
    """Runs trials over seeds, keeps the first flight of each for the pictures, and tells about them in tables."""

    def __init__(self, seeds: int) -> None:
        self._seeds = range(1, seeds + 1)
        self.flights: dict[str, Flight] = {}

    def over_seeds(self, name: str, trial: Trial) -> dict[str, str]:
        """Cells of a table row, by heading."""
        runs: list[Figures] = []
        for seed in self._seeds:
            flight, figures = trial(seed)
            self.flights.setdefault(name, flight)
            runs.append(figures)
        sys.stderr.write(f"{name}\n")
        return {key: _told(key, [run[key] for run in runs]) for key in runs[0]}

    def table(self, trials: Iterable[tuple[str, Trial]], what: str) -> str:
        """A table of these trials, all with the same figures."""
        rows = [(name, self.over_seeds(f"{what}: {name}", trial)) for name, trial in trials]
        return table([what, *rows[0][1]], [[name, *cells.values()] for name, cells in rows])


def _told(key: str, values: list[float]) -> str:
    if key in _SHARES:
        return f"{round(sum(values))} of {len(values)}"
    known = [value for value in values if not math.isnan(value)]
    if not known:
        return "never"
    digits = 2 if max(map(abs, known)) < 10 else 1
    text = f"{median(known):.{digits}f} ({min(known):.{digits}f} to {max(known):.{digits}f})"
    return text if len(known) == len(values) else f"{text}, {len(known)} of {len(values)}"


def control(tests: FlightTests) -> str:
    rows = [
        tests.table([("at once", step_response), ("as a segment at 3 m/s", guided_leg)], "10 m east"),
        tests.table([("90 degrees", turn)], "turning on the spot"),
        tests.table(
            [
                ("calm", hover),
                ("steady wind of (8, 4) m/s", lambda seed: hover(seed, wind=WIND)),
                ("light turbulence (7.7 m/s at 6 m)", lambda seed: hover(seed, wind=(4.0, 2.0, 0.0), turbulence=7.7)),
                ("moderate turbulence (15.4 m/s at 6 m)", lambda seed: hover(seed, **MODERATE)),
            ],
            "staying at a place for 40 s, 15 m up",
        ),
        tests.table([("step of wind of (8, 4) m/s", into_wind)], "wind"),
        tests.table([("1 - cosine, 10 m/s, 3 s", gust)], "gust"),
    ]
    return "\n\n".join(rows)


def landing(tests: FlightTests) -> str:
    hills = {"0.45 m, as in the courtyard": 0.45, "1 m": 1.0, "2 m": 2.0}
    trials = [(name, lambda seed, a=a: land_on_a_slope(seed, a)) for name, a in hills.items()]
    return tests.table(trials, "height of the hills")


def fence(tests: FlightTests) -> str:
    trials = [
        (f"{wall}, {wind:g} m/s from behind", lambda seed, d=way, w=wind: fence_run(seed, d, w))
        for wall, way in WALLS.items()
        for wind in ((0.0, 8.0) if not way[2] else (0.0,))
    ]
    return tests.table(trials, "towards the wall")


def rotors(tests: FlightTests) -> str:
    calm = [
        (f"rotor {rotor}, {name}", lambda seed, r=rotor, s=share: rotor_out(seed, r, s))
        for name, share in LEFT.items()
        for rotor in range(1, 7)
    ]
    windy = [
        (f"rotor {rotor}, stopped, in turbulence", lambda seed, r=rotor: rotor_out(seed, r, 0.0, **MODERATE))
        for rotor in range(1, 7)
    ]
    return tests.table([*calm, *windy], "which rotor")


def failsafes(tests: FlightTests) -> str:
    rows = [
        tests.table([("calm", trial), ("turbulence", lambda seed, trial=trial: trial(seed, **MODERATE))], what)
        for what, trial in (("setpoints end at 5 m/s", silence), ("battery critical, 25 m up", low_battery))
    ]
    rows += [
        tests.table(_LOST_FIXES, "no satellite fixes any more"),
        tests.table([("nose along the track", route_without_fixes)], "a route without satellite fixes"),
    ]
    return "\n\n".join(rows)


_LOST_FIXES: list[tuple[str, Trial]] = [
    ("no odometry, calm", lost_fixes),
    ("no odometry, turbulence", lambda seed: lost_fixes(seed, **MODERATE)),
    ("odometry, calm", lost_fixes_seeing),
    ("odometry, turbulence", lambda seed: lost_fixes_seeing(seed, **MODERATE)),
    ("odometry for 10 s only", lambda seed: lost_fixes_seeing(seed, blind_after=10.0)),
]


SECTIONS: dict[str, tuple[str, Callable[[FlightTests], str], Callable[[dict[str, Flight], Path], None]]] = {
    "Control": ("control", control, flight_plots.control),
    "Landing and taking off on slopes": ("landing", landing, flight_plots.landing),
    "Towards the fence": ("fence", fence, flight_plots.fence),
    "A rotor fails": ("rotors", rotors, flight_plots.rotors),
    "Failsafes": ("failsafes", failsafes, flight_plots.failsafes),
}


def main() -> None:
    options = make_parser(__doc__)
    options.add_argument("section", nargs="?", choices=[name for name, _, _ in SECTIONS.values()], help="all if none")
    options.add_argument("--seeds", type=int, default=3, help="flights for each figure")
    wanted = options.parse_args()
    for title, (name, measure, draw) in SECTIONS.items():
        if wanted.section not in (None, name):
            continue
        tests = FlightTests(wanted.seeds)
        body = measure(tests)
        picture = DOCS / "images" / "flight" / f"{name}.png"
        if wanted.write:
            picture.parent.mkdir(parents=True, exist_ok=True)
            draw(tests.flights, picture)
        where = f"{wanted.seeds} seeds each: median (least to largest). {machine()}."
        text = f"{where}\n\n{body}\n\n![{title}](images/flight/{name}.png)"
        write_section(f"flight_tests.py {name}", title, text, write=wanted.write, file=DOCS / "flight.md")


if __name__ == "__main__":
    main()
