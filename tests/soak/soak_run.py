"""Run mocks for many robot hours, faster than wall time, and measure memory and disk.

    python tests/soak/soak_run.py --hours 24 --rate 2 --speed 60 --results runs/soak --write docs/reliability.md

`--hours` may be given several times, each with its `--rate` and `--speed`. Time waits for the starts that are due, so
that the rate is kept on any machine. With `--results`, a soak that is interrupted leaves what it measured, and one that
the same code has finished does not run again. Ends with 1 if a process grew, a goal was lost, or the run directory
became larger than `--keep` and a tenth of it.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from msgspec.structs import replace
from soak_figures import HOUR, Sample, Soak, rates_table, table
from soak_nodes import COUNT_KEY, SoakCount

from skillwing.bt_missions.running.process import mission_process
from skillwing.dsl.whole_files import write_whole
from skillwing.evaluation.campaign.flight_code import flight_code
from skillwing.services.bus.clock import FollowedClock
from skillwing.services.bus.reading import message_reader
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.disk import directory_size
from skillwing.services.history.recording_state import add_up, read_state
from skillwing.services.mocking.system import mock_processes
from skillwing.services.names import MISSION
from skillwing.services.processes.launcher import LOGS, Launcher
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
LINES = ("north", "east", "south", "west", "spring", "summer", "autumn", "winter")
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
SAMPLES = 240
"""Measurements in one soak."""
LOST = re.compile(r"lost (\d+) events that waited")
"""A line in the log of a process that was too busy (`bus/backlog.py`)."""
LONGEST_WAIT = 60.0
"""Wall seconds without progress of robot time after which the soak gives up."""


@dataclass
class _Watch:
    """State of a running soak. on_sample: takes the soak so far."""

    soak: Soak
    run_dir: Path
    on_sample: Callable[[Soak], None]
    counts: list[SoakCount] = field(default_factory=list[SoakCount])
    mission_is_over: bool = False
    mission_works: bool = False
    """True from the first status of a mission on: before, its process is still being loaded, and its memory small."""
    begun: float = field(default_factory=time.monotonic)

    def note_mission(self, status: MissionStatus) -> None:
        """Take a status of the mission that runs."""
        self.mission_is_over = status.phase.over
        self.mission_works = self.mission_works or not status.phase.over

    def forget_mission(self) -> None:
        """Take note that another mission process begins."""
        self.mission_is_over = self.mission_works = False

    def sample(self, launcher: Launcher, now: float) -> None:
        """Measure, and hand on the soak so far."""
        last = self.counts[-1] if self.counts else SoakCount(t=0.0, started=0, ended=0, succeeded=0, behind=0.0)
        del self.counts[:-1]
        memory = _memory(launcher)
        if not self.mission_works:
            memory.pop(MISSION, None)
        parts = sum(part.size for part in find_parts(self.run_dir, FILES))
        self.soak.samples.append(Sample(now, memory, directory_size(self.run_dir), parts, last.started))
        others = [state for state in launcher.states if state.name != MISSION]
        self.soak = replace(
            self.soak,
            wall=time.monotonic() - self.begun,
            ended=last.ended,
            succeeded=last.succeeded,
            written=_written(self.run_dir),
            lost_processes=[each.name for each in others if each.restarts or each.life != "lives"],
            lost_events=_lost_events(self.run_dir / LOGS),
        )
        self.on_sample(self.soak)


def run(asked: Soak, speed: float, mission_hours: float, folder: Path, on_sample: Callable[[Soak], None]) -> Soak:
    """Run one soak in a folder of its own. Ctrl-C ends it early; then it is not finished.

    speed: most robot seconds in a wall second. on_sample: takes the soak so far, after each measurement.
    """
    source, script, tree = folder / "soak.skillset", folder / "soak.mock.toml", folder / "rounds.xml"
    source.write_text(SKILLSET, encoding="utf-8")
    script.write_text(SCRIPT, encoding="utf-8")
    tree.write_text(MISSION_TREE.format(cycles=max(1, round(mission_hours * HOUR / ROUND))), encoding="utf-8")
    robot, run_dir = Robot("soak", source, {}, clock="robot"), folder / "run"
    options = {"run_dir": str(run_dir), "keep": asked.keep}
    write_facts(run_dir, RunFacts(robot=robot.name, skillset=str(source)))
    client = {"skillset": str(source), "skills": list(LINES), "rate": asked.rate}
    robots = (
        *robot.observers(options),
        *mock_processes(robot, scripts=[script], run=options),
        ProcessSpec("soak_client", "soak_nodes:make_client", client),
    )
    awaited = [Keys(robot.name).alive(each.name) for each in robots]
    clock = ProcessSpec(
        "soak_clock", "soak_nodes:make_clock", {"factor": speed, "awaited": awaited, "run_dir": str(run_dir)}
    )
    mission, watch = mission_process(robot, str(tree), {}), _Watch(asked, run_dir, on_sample)
    with Launcher(robot.name, robot.load_skillset().name, run_dir, clock="robot", restarts=True) as launcher:
        launcher.start((*robots, clock))
        with _bus(launcher, watch) as bus:
            reporter = MissionReporter(run_dir, robot.name, lambda: launcher.states)
            reporter.attach(bus, lambda text, style: None)
            try:
                _follow(launcher, bus, watch, mission)
                watch.soak = replace(watch.soak, finished=True)
            except KeyboardInterrupt:
                _say(f"Interrupted after {watch.soak.passed:.1f} robot hours.")
    on_sample(watch.soak)
    return watch.soak


@contextmanager
def _bus(launcher: Launcher, watch: _Watch) -> Iterator[ZenohBus]:
    with closing(ZenohBus("soak_driver", "soak", launcher.endpoint, FollowedClock())) as bus:
        bus.subscribe(COUNT_KEY, message_reader(SoakCount, watch.counts.append))
        on_mission = message_reader(MissionStatus, watch.note_mission)
        bus.subscribe(Keys("soak").mission_status, on_mission, events=True)
        yield bus


def _follow(launcher: Launcher, bus: ZenohBus, watch: _Watch, mission: ProcessSpec) -> None:
    """Let robot time pass, with one mission after the other, and measure from time to time."""
    end = watch.soak.hours * HOUR
    period, due = end / SAMPLES, 0.0
    progress, moved = 0.0, time.monotonic()
    while bus.now() < end:
        bus.run_until(lambda due=due: bus.now() >= due, 1.0)
        if watch.mission_is_over and launcher.running(MISSION):
            os.kill(launcher.pids[MISSION], signal.SIGTERM)
            bus.run_until(lambda: not launcher.running(MISSION), LONGEST_WAIT)
        if not launcher.running(MISSION):
            watch.forget_mission()
            launcher.start([mission])
            watch.soak = replace(watch.soak, missions=watch.soak.missions + 1)
        launcher.shorten_logs()
        now = bus.now()
        if now > progress:
            progress, moved = now, time.monotonic()
        elif time.monotonic() - moved > LONGEST_WAIT:
            sys.exit(f"Robot time stands at {now:.0f} s. See the logs in {watch.run_dir}/logs.")
        if now >= due:
            watch.sample(launcher, now)
            due += period
            if len(watch.soak.samples) % 10 == 1:
                _print_progress(watch.soak)


def _memory(launcher: Launcher) -> dict[str, int]:
    pids = {**launcher.pids, "driver": os.getpid()}
    return {name: found.memory for name, pid in pids.items() if (found := usage(pid)) is not None}


def _written(run_dir: Path) -> dict[str, int]:
    """Bytes that were written to each file, with its deleted parts."""
    there = add_up({part.name: part.size} for part in find_parts(run_dir, FILES))
    return add_up([there, {name: gone.size for name, gone in read_state(run_dir).deleted.items()}])


def _lost_events(logs: Path) -> int:
    """Events that busy processes have dropped, by their logs."""
    texts = (log.read_text(encoding="utf-8", errors="replace") for log in logs.rglob("*.log*"))
    return sum(int(number) for text in texts for number in LOST.findall(text))


def _print_progress(soak: Soak) -> None:
    last = soak.samples[-1]
    memory = " ".join(f"{name}={size / 1e6:.0f}" for name, size in sorted(last.memory.items()))
    _say(
        f"{last.t / HOUR:6.2f} h  {last.started:9,} goals  {soak.wall:6.0f} s  disk {last.directory / 1e6:7.1f} MB  "
        f"{memory}"
    )


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def _machine() -> str:
    version = f"Python {platform.python_version()}"
    return f"{os.cpu_count()} processors, {platform.machine()}, {version}, {datetime.now(UTC):%Y-%m-%d}"


def code_of_soak() -> str:
    """Twelve hexadecimal digits, equal for equal code: of all processes, and of this trial."""
    own = b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("soak_*.py")))
    return hashlib.sha256(flight_code().digest.encode() + own).hexdigest()[:12]


def _finished(file: Path | None, asked: Soak) -> Soak | None:
    """The same soak, if it has run to its end; None otherwise, and for a result with other figures."""
    if file is None or not file.is_file():
        return None
    try:
        found = msgspec.json.decode(file.read_bytes(), type=Soak)
    except msgspec.ValidationError:
        return None
    same = (found.keep, found.settle, found.code) == (asked.keep, asked.settle, asked.code)
    return found if found.finished and same else None


def _soak(asked: Soak, speed: float, mission_hours: float, results: Path | None) -> Soak:
    """The result of a soak that has run before, or else of this run."""
    file = None if results is None else results / f"{asked.hours:g}h-{asked.rate:g}.json"
    if (found := _finished(file, asked)) is not None:
        return found

    def keep(soak: Soak) -> None:
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(file, msgspec.json.encode(soak))

    folder = Path(tempfile.mkdtemp(prefix="soak-"))
    done = run(asked, speed, mission_hours, folder, keep)
    for problem in done.problems():
        _say(f"{problem} See {folder}.")
    if not done.problems():
        shutil.rmtree(folder)
    return done


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Run mocks for many robot hours, and measure memory and disk.")
    add = parser.add_argument
    add("--hours", type=float, action="append", help="robot hours; repeatable (default: 1)")
    add("--rate", type=float, action="append", help="starts a robot second for each (default: 20)")
    add("--speed", type=float, action="append", help="most robot seconds a second for each (default: 8)")
    add("--mission-hours", type=float, default=0.25, help="of each mission (default: %(default)s)")
    add("--settle", type=float, default=1.0, help="hours before memory counts (default: %(default)s)")
    add("--keep", type=read_size, default=read_size("1GB"), help="of each run (default: 1GB)")
    add("--results", type=Path, metavar="DIR", help="folder for results; finished soaks there are not run again")
    add("--write", type=page_with(MARKS), metavar="FILE", help="document that gets the table")
    add("--write-rates", type=page_with(RATES), metavar="FILE", help="document for the sizes of files")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Run the soaks; returns the exit code."""
    asked = _parse(arguments)
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(Path(__file__).parent), os.environ.get("PYTHONPATH")]))
    hours = asked.hours or [1.0]
    rates = [*(asked.rate or []), *[20.0] * len(hours)]
    speeds = [*(asked.speed or []), *[8.0] * len(hours)]
    soaks: list[Soak] = []
    code = code_of_soak()
    for each, rate, speed in zip(hours, rates, speeds, strict=False):
        wanted = Soak(hours=each, rate=rate, keep=asked.keep, settle=asked.settle * HOUR, machine=_machine(), code=code)
        soaks.append(_soak(wanted, speed, asked.mission_hours, asked.results))
        if not soaks[-1].finished:
            break
    figures = table(soaks)
    _say(figures)
    if asked.write is not None and figures:
        MARKS.replace(asked.write, figures)
    if asked.write_rates is not None and soaks[0].begun:
        RATES.replace(asked.write_rates, rates_table(soaks[0]))
    finished = all(each.finished for each in soaks)
    return 0 if finished and not any(each.problems() for each in soaks) else 1


if __name__ == "__main__":
    sys.exit(main())
