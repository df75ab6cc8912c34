"""Cost of a recording: size of its files and processor time of the recorder.

python benchmarks/recording_cost.py [--seeds 3] [--write]

Flies the demo in real time, with and without its fault, and without a viewer.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil
from performance_page import machine, spread, spread_said, table, write_section

PAGE = Path(__file__).parents[1] / "docs" / "recordings.md"
FLIGHTS = {"the depth camera fails": (), "no fault": ("--no-fault",)}
FILES = ("recording*.rrd", "timeline*.jsonl", "goals*.jsonl", "flight*.jsonl", "steps/*", "logs/**/*.log")
LOOK_EVERY = 0.2
"""Wall seconds between two looks at the recorder; what it uses after the last is not counted."""
WITHIN = 900.0
"""Wall seconds for one flight."""


@dataclass(frozen=True)
class Recorded:
    """One flight. robot, wall: seconds; cpu: of the recorder, percent of one core; the others: megabytes of a file."""

    robot: float
    wall: float
    cpu: float
    recording: float
    timeline: float
    goals: float
    flight: float
    steps: float
    logs: float

    @property
    def per_hour(self) -> dict[str, float]:
        """Megabytes of each file in a robot hour."""
        sizes = (self.recording, self.timeline, self.goals, self.flight, self.steps, self.logs)
        return {name: 3600.0 * size / self.robot for name, size in zip(FILES, sizes, strict=True)}


def _recorder_of(demo: psutil.Process) -> psutil.Process | None:
    for child in demo.children():
        try:
            if any("recorder" in word for word in child.cmdline()):
                return child
        except psutil.NoSuchProcess:
            continue
    return None


def _watched(demo: subprocess.Popen[str]) -> tuple[float, float]:
    """Processor seconds of the recorder, and the wall seconds that it lived, until the flight is over."""
    told, used, lived = psutil.Process(demo.pid), 0.0, 0.0
    recorder = None
    end = time.monotonic() + WITHIN
    while demo.poll() is None and time.monotonic() < end:
        try:
            recorder = recorder or _recorder_of(told)
            if recorder is not None:
                times = recorder.cpu_times()
                used, lived = times.user + times.system, time.time() - recorder.create_time()
        except psutil.NoSuchProcess:
            pass
        time.sleep(LOOK_EVERY)
    return used, lived


def fly(seed: int, options: Sequence[str]) -> Recorded:
    """Fly the demo, and look at what it left. Ends the measurement where it does."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        words = ["demo", "--seed", str(seed), "--viewer", "none", "--run-dir", str(run), *options]
        demo = subprocess.Popen(
            [str(Path(sys.executable).with_name("skillwing")), *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            used, lived = _watched(demo)
        finally:
            demo.terminate()
            said, _ = demo.communicate()
        if demo.returncode != 0 or not lived:
            sys.exit(f"`skillwing {' '.join(words)}` ended with {demo.returncode}:\n{said}\nNothing was measured.")
        report = json.loads((run / "report.json").read_text(encoding="utf-8"))
        sizes = {name: sum(file.stat().st_size for file in run.glob(name)) / 1e6 for name in FILES}
    return Recorded(report["sim_time_s"], report["wall_time_s"], 100.0 * used / lived, *sizes.values())


def section(flights: dict[str, list[Recorded]], seeds: range) -> str:
    rows = [
        (
            name,
            spread([each.robot for each in flown]),
            spread([each.robot / each.wall for each in flown]),
            spread([each.recording for each in flown]),
            spread([each.timeline for each in flown]),
            spread([each.goals for each in flown]),
            spread([each.cpu for each in flown]),
        )
        for name, flown in flights.items()
    ]
    heads = (
        "demo",
        "robot time, s",
        "times real time",
        "`recording.rrd`, MB",
        "`timeline.jsonl`, MB",
        "`goals.jsonl`, MB",
        "recorder, % of a core",
    )
    hourly = [
        (name, *(spread([each.per_hour[file] for each in flown]) for file in FILES)) for name, flown in flights.items()
    ]
    files = [f"`{file}`" for file in FILES]
    return (
        f"The mapping demo in the courtyards of seeds {seeds[0]} to {seeds[-1]}, recorded to files only, in "
        f"real time if the machine can; {spread_said(len(seeds))}. {machine()}.\n\n{table(heads, rows)}\n\n"
        f"Megabytes in a robot hour of flight:\n\n{table(('demo', *files), hourly)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="What it costs to record a flight.")
    parser.add_argument("--seeds", type=int, default=3, help="so many worlds")
    parser.add_argument("--write", action="store_true", help="put the figures into docs/recordings.md")
    asked = parser.parse_args()
    seeds = range(1, 1 + asked.seeds)
    flights = {name: [fly(seed, options) for seed in seeds] for name, options in FLIGHTS.items()}
    write_section("recording_cost.py", "Sizes and costs", section(flights, seeds), write=asked.write, file=PAGE)


if __name__ == "__main__":
    main()
