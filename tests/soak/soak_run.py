"""Run mocks for many robot hours, faster than wall time, and measure memory and disk.

    python tests/soak/soak_run.py --hours 4 --speed 10 --write docs/reliability.md

`--hours` may be given several times, each with its `--rate` and `--speed`. Ends with 1 if a process grew, a goal was
lost, or the files of the run became larger than `--keep`.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from soak_figures import HOUR, Sample, Soak, growths, rates_table, table
from soak_nodes import COUNT_KEY, SoakCount

from skillwing.bt_missions.running.process import mission_process
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.history.recording_state import add_up, read_state
from skillwing.services.mocking.system import mock_processes
from skillwing.services.names import MISSION
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.proc_files import usage
from skillwing.services.protocol import Keys, MissionStatus
from skillwing.services.recording.retention import FILES, find_parts
from skillwing.services.recording.run_facts import RunFacts, write_facts
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.sizes import read_size
from skillwing.services.terminal.doc_sections import Marks, page_with
from skillwing.services.terminal.mission_reporter import MissionReporter

MARKS = Marks.named("soak")
RATES = Marks.named("sizes in an hour")
LINES = ("north", "east", "south", "west")
SKILL = """
    resource belt_{0} {{ initial FREE  FREE -> TAKEN  TAKEN -> FREE }}
    skill {0} {{
        effect {{ take: belt_{0} -> TAKEN  drop: belt_{0} -> FREE }}
        precondition {{ free: resource=(belt_{0} == FREE)  success take }}
        interrupt {{ apply=drop }}
        result {{ success PACKED: apply=drop }}
    }}"""
SKILLS = "".join(map(SKILL.format, (*LINES, "walk")))
SKILLSET = f"skillset soak {{\n    data {{ load: float64 period=1.0 }}{SKILLS}\n}}\n"
SCRIPT = "".join(f"[skill.{name}]\ndelay = 0.05\n" for name in LINES) + "[skill.walk]\ndelay = 2.0\n"
MISSION_TREE = """<root BTCPP_format="4" main_tree_to_execute="rounds">
  <BehaviorTree ID="rounds"><Repeat name="rounds" num_cycles="{cycles}"><walk/></Repeat></BehaviorTree>
</root>
"""
ROUND = 2.1
"""Robot seconds of one round of the mission, about."""
SAMPLES = 120
"""Measurements in one soak."""
LONGEST_WAIT = 60.0
"""Wall seconds without progress of robot time after which the soak gives up."""


@dataclass
class _Watch:
    """State of a running soak."""

    counts: list[SoakCount] = field(default_factory=list[SoakCount])
    samples: list[Sample] = field(default_factory=list[Sample])
    missions: int = 0
    mission_is_over: bool = False

    def note_mission(self, status: MissionStatus) -> None:
        """Take a status of the mission that runs."""
        self.mission_is_over = status.phase.over


def soak(hours: float, rate: float, speed: float, keep: int, mission_hours: float, settle: float, folder: Path) -> Soak:
    """One soak in a folder of its own."""
    source, script, tree = folder / "soak.skillset", folder / "soak.mock.toml", folder / "rounds.xml"
    source.write_text(SKILLSET, encoding="utf-8")
    script.write_text(SCRIPT, encoding="utf-8")
    tree.write_text(MISSION_TREE.format(cycles=max(1, round(mission_hours * HOUR / ROUND))), encoding="utf-8")
    robot, run_dir = Robot("soak", source, {}, clock="robot"), folder / "run"
    run = {"run_dir": str(run_dir), "keep": keep}
    write_facts(run_dir, RunFacts(robot=robot.name, skillset=str(source)))
    client = {"skillset": str(source), "skills": list(LINES), "rate": rate}
    robots = (
        *robot.observers(run),
        *mock_processes(robot, scripts=[script], run=run),
        ProcessSpec("soak_client", "soak_nodes:make_client", client),
    )
    awaited = [Keys(robot.name).alive(each.name) for each in robots]
    clock = ProcessSpec("soak_clock", "soak_nodes:make_clock", {"factor": speed, "awaited": awaited})
    mission, watch = mission_process(robot, str(tree), {}), _Watch()
    begun = time.monotonic()
    with Launcher(robot.name, robot.load_skillset().name, run_dir, clock="robot", restarts=True) as launcher:
        launcher.start((*robots, clock))
        with _bus(launcher, watch) as bus:
            reporter = MissionReporter(run_dir, robot.name, lambda: launcher.states)
            reporter.attach(bus, lambda text, style: None)
            _follow(launcher, bus, watch, mission, hours, run_dir)
            others = [state for state in launcher.states if state.name != MISSION]
    last = watch.counts[-1]
    present = [*(state.name for state in others), "driver"]
    return Soak(
        hours=(watch.samples[-1].t - watch.samples[0].t) / HOUR,
        rate=rate,
        keep=keep,
        settle=settle,
        wall=time.monotonic() - begun,
        started=last.started,
        ended=last.ended,
        succeeded=last.succeeded,
        missions=watch.missions,
        samples=watch.samples,
        growths=growths(watch.samples, settle, [*present, MISSION]),
        written=_written(run_dir),
        lost_processes=tuple(each.name for each in others if each.restarts or each.life != "lives"),
    )


@contextmanager
def _bus(launcher: Launcher, watch: _Watch) -> Iterator[ZenohBus]:
    with closing(ZenohBus("soak_driver", "soak", launcher.endpoint, FollowedClock())) as bus:
        bus.subscribe(COUNT_KEY, message_reader(SoakCount, watch.counts.append))
        on_mission = message_reader(MissionStatus, watch.note_mission)
        bus.subscribe(Keys("soak").mission_status, on_mission, events=True)
        yield bus


def _follow(
    launcher: Launcher, bus: ZenohBus, watch: _Watch, mission: ProcessSpec, hours: float, run_dir: Path
) -> None:
    """Let robot time pass, with one mission after the other, and measure from time to time."""
    end, period, due = hours * HOUR, hours * HOUR / SAMPLES, 0.0
    progress, moved = 0.0, time.monotonic()
    while bus.now() < end:
        bus.run_until(lambda due=due: bus.now() >= due, 1.0)
        if watch.mission_is_over and launcher.running(MISSION):
            os.kill(launcher.pids[MISSION], signal.SIGTERM)
            bus.run_until(lambda: not launcher.running(MISSION), LONGEST_WAIT)
        if not launcher.running(MISSION):
            watch.mission_is_over = False
            launcher.start([mission])
            watch.missions += 1
        now = bus.now()
        if now > progress:
            progress, moved = now, time.monotonic()
        elif time.monotonic() - moved > LONGEST_WAIT:
            sys.exit(f"Robot time stands at {now:.0f} s. See the logs in {run_dir}/logs.")
        if now >= due:
            del watch.counts[:-1]
            watch.samples.append(Sample(now, _memory(launcher), _disk(run_dir)))
            due += period
            if len(watch.samples) % 10 == 1:
                _print_progress(watch)


def _memory(launcher: Launcher) -> dict[str, int]:
    pids = {**launcher.pids, "driver": os.getpid()}
    return {name: found.memory for name, pid in pids.items() if (found := usage(pid)) is not None}


def _disk(run_dir: Path) -> int:
    """Bytes of the files that the retention is about."""
    return sum(part.size for part in find_parts(run_dir, FILES))


def _written(run_dir: Path) -> dict[str, int]:
    """Bytes that were written to each file, with its deleted parts."""
    there = add_up({part.name: part.size} for part in find_parts(run_dir, FILES))
    return add_up([there, {name: gone.size for name, gone in read_state(run_dir).deleted.items()}])


def _print_progress(watch: _Watch) -> None:
    last, count = watch.samples[-1], watch.counts[-1] if watch.counts else None
    memory = " ".join(f"{name}={size / 1e6:.0f}" for name, size in sorted(last.memory.items()))
    goals = 0 if count is None else count.started
    sys.stdout.write(f"{last.t / HOUR:6.2f} h  {goals:9,} goals  disk {last.disk / 1e6:7.1f} MB  {memory}\n")
    sys.stdout.flush()


def _machine() -> str:
    version = f"Python {platform.python_version()}"
    return f"{os.cpu_count()} processors, {platform.machine()}, {version}, {datetime.now(UTC):%Y-%m-%d}"


def main(arguments: list[str] | None = None) -> int:
    """Run the soaks; returns the exit code."""
    parser = argparse.ArgumentParser(description="Run mocks for many robot hours, and measure memory and disk.")
    parser.add_argument("--hours", type=float, action="append", help="robot hours; repeatable (default: 1)")
    parser.add_argument("--rate", type=float, action="append", help="starts a robot second for each (default: 20)")
    parser.add_argument("--speed", type=float, action="append", help="robot seconds a second for each (default: 8)")
    parser.add_argument("--mission-hours", type=float, default=0.25, help="of each mission (default: %(default)s)")
    parser.add_argument("--settle", type=float, default=1.0, help="hours before memory counts (default: %(default)s)")
    parser.add_argument("--keep", type=read_size, default=read_size("1GB"), help="of each run (default: 1GB)")
    parser.add_argument("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    parser.add_argument("--write-rates", type=page_with(RATES), metavar="FILE", help="document for the sizes of files")
    asked = parser.parse_args(arguments)
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    hours = asked.hours or [1.0]
    rates = asked.rate or []
    rates += [20.0] * (len(hours) - len(rates))
    speeds = asked.speed or []
    speeds += [8.0] * (len(hours) - len(speeds))
    soaks: list[Soak] = []
    for each, rate, speed in zip(hours, rates, speeds, strict=True):
        folder = Path(tempfile.mkdtemp(prefix="soak-"))
        done = soak(each, rate, speed, asked.keep, asked.mission_hours, asked.settle * HOUR, folder)
        soaks.append(done)
        for problem in done.problems():
            sys.stdout.write(f"{problem} See {folder}.\n")
        if not done.problems():
            shutil.rmtree(folder)
    figures = table(soaks, _machine())
    sys.stdout.write(f"{figures}\n")
    if asked.write is not None:
        MARKS.replace(asked.write, figures)
    if asked.write_rates is not None:
        RATES.replace(asked.write_rates, rates_table(soaks[0], _machine()))
    return 1 if any(each.problems() for each in soaks) else 0


if __name__ == "__main__":
    sys.exit(main())
