"""Real systems on a disk that is full for a while: they go on, and what is missing is said."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from queue import SimpleQueue
from time import monotonic, sleep

import pytest
from command_line import Command, Said
from running_system import until

from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.history.files import TIMELINE_FILE, read_goals, read_records
from skillwing.services.history.recording_state import RecordingState, read_state
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import GoalStatus, Keys, State, encode
from skillwing.services.robot import Robot
from small_disk import fill, free, mounted, obstacle

SKILLSET = """
skillset press {
    data { load: float64 period=1.0 }
    resource plate { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    skill push {
        effect { take: plate -> TAKEN  drop: plate -> FREE }
        precondition { free: resource=(plate == FREE)  success take }
        interrupt { apply=drop }
        result { success PUSHED: apply=drop }
    }
}
"""
SCRIPT = "[skill.push]\ndelay = 0.1\n"
DISK = 64 << 20
WITHIN = 60.0
"""Longest wait for a change, in wall seconds."""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    if (reason := obstacle()) is not None:
        pytest.skip(reason)
    with mounted(tmp_path / "disk", DISK) as place:
        yield place


@pytest.fixture
def source(tmp_path: Path) -> Path:
    file = tmp_path / "press.skillset"
    file.write_text(SKILLSET, encoding="utf-8")
    file.with_name("press.mock.toml").write_text(SCRIPT, encoding="utf-8")
    return file


def wait_for(run_dir: Path, wanted: str) -> RecordingState:
    """Wait until the recorder notices the full disk (`failing`), or that it has room again (`well`)."""
    end = monotonic() + WITHIN
    while monotonic() < end:
        state = read_state(run_dir)
        if state.gaps and (state.failing is not None) == (wanted == "failing"):
            return state
        sleep(0.05)
    raise AssertionError(f"the recorder is not {wanted}: {read_state(run_dir)}")


class System:
    """A system of mocks on a disk, detached."""

    def __init__(self, skillwing: Command, source: Path, run_dir: Path) -> None:
        self.run_dir = run_dir
        self._skillwing = skillwing
        said = skillwing("mock", str(source), "--run-dir", str(run_dir), "--detach")
        assert said.code == 0, said.error

    def start(self) -> str:
        """Run a goal to its end; returns its id."""
        said: Said = self._skillwing("start", "push", "--follow", "--json")
        assert said.code == 0, said.error
        return str(said.json["goal_id"])

    def status(self) -> Said:
        return self._skillwing("status", "--json")

    def stop(self) -> None:
        assert self._skillwing("down").code == 0


@contextmanager
def running(skillwing: Command, source: Path, run_dir: Path) -> Iterator[System]:
    robot = System(skillwing, source, run_dir)
    try:
        yield robot
    finally:
        skillwing("down")


def goals_of(run_dir: Path) -> set[str]:
    return {status.goal_id for status in read_goals(run_dir) if status.terminal is not None}


def test_a_full_disk_costs_the_recording_of_its_time_and_nothing_else(
    skillwing: Command, source: Path, disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(disk)
    with running(skillwing, source, disk / "runs" / "one") as robot:
        before = robot.start()
        fill(disk)
        meanwhile = [robot.start() for _ in range(3)]
        wait_for(robot.run_dir, "failing")
        told = robot.status()
        assert told.code == 0
        assert told.json["recording"].startswith("The run is not recorded. Nothing can be written since")
        free(disk)
        state = wait_for(robot.run_dir, "well")
        assert robot.status().json["recording"] is None
        after = robot.start()
        (listed,) = json.loads(skillwing("runs", "list", "--json").out)
        assert listed["active"]
        assert "No space left on device" in listed["missing"][0]
        kept = skillwing("runs", "prune", "--count", "0", "--json")
        assert kept.json == {"deleted": True, "runs": []}, "an active run is never deleted"
        robot.stop()
    assert {before, after} <= goals_of(robot.run_dir)
    (gap,) = state.gaps
    assert gap.why == "No space left on device"
    assert gap.lost[TIMELINE_FILE] > 0
    recorder = [record for record in read_records(robot.run_dir) if record.subject == "recorder"]
    assert [record.after for record in recorder][-1] == "RECORDING"
    assert "Missing:" in (robot.run_dir / "logs" / "recorder.log").read_text(encoding="utf-8")
    lost = [goal for goal in meanwhile if goal not in goals_of(robot.run_dir)]
    assert lost, "the disk was full"
    replayed = skillwing("replay", str(robot.run_dir), "--json")
    assert (replayed.code, replayed.json["same"], replayed.json["files"]) == (0, True, 2)
    fill(disk)
    drawn = skillwing("timeline", str(robot.run_dir), "--png", str(disk / "run.png"))
    assert drawn.code == 1
    assert f"`{disk / 'run.png'}` cannot be written: No space left on device. Free some room" in drawn.error
    assert not (disk / "run.png").exists()
    free(disk)
    assert "1 run would be deleted" in skillwing("runs", "prune", "--count", "0", "--dry-run").out
    assert robot.run_dir.exists()
    gone = skillwing("runs", "prune", "--count", "0", "--json")
    assert [run["path"] for run in gone.json["runs"]] == ["runs/one"]
    assert not robot.run_dir.exists()


def wait_for_another(robot: System, process: str, before: int) -> None:
    """Wait until a process runs that is not the one with the id `before`."""

    def runs() -> bool:
        now = robot.status().json["processes"][process]
        return now["state"] == "runs" and now["pid"] != before

    until(runs, process)


def test_processes_that_die_on_a_full_disk_come_back_and_the_system_is_stopped_on_one(
    skillwing: Command, source: Path, disk: Path
) -> None:
    with running(skillwing, source, disk / "run") as robot:
        robot.start()
        fill(disk)
        for process in ("recorder", "resource_manager", "skill/push"):
            before = robot.status().json["processes"][process]["pid"]
            os.kill(before, 9)
            wait_for_another(robot, process, before)
            robot.start()
        free(disk)
        wait_for(robot.run_dir, "well")
        after = robot.start()
        until(lambda: after in goals_of(robot.run_dir), "the goal to be recorded")
        fill(disk)
        robot.start()
        wait_for(robot.run_dir, "failing")
        robot.stop()
    assert skillwing("status").code == 3
    assert after in goals_of(robot.run_dir)


def test_a_recorder_ends_in_order_on_a_full_disk(source: Path, disk: Path) -> None:
    """Rerun must not keep it: its file thread used to wait for ever."""
    robot = Robot("press", source, {}, clock="wall")
    exits: SimpleQueue[ProcessExit] = SimpleQueue()
    with Launcher("press", "press", disk / "run", clock="wall", on_exit=exits.put) as launcher:
        launcher.start(robot.observers({"run_dir": str(disk / "run")}))
        fill(disk)
        with closing(ZenohBus("skill/push", "press", launcher.endpoint)) as bus:
            statuses = bus.advertise(Keys("press").status("push"), events=True)
            for number in range(200):
                status = GoalStatus(goal_id=f"g{number}", skill="push", state=State.RUNNING, t=float(number))
                statuses.put(encode(status))
            wait_for(disk / "run", "failing")  # the bus hears nothing that would wake it up
        os.kill(launcher.pids["recorder"], signal.SIGTERM)
        ended = exits.get(timeout=WITHIN)
    assert (ended.process, ended.exit_code) == ("recorder", 0)


@pytest.mark.parametrize("detach", [["--detach"], []])
def test_a_run_that_would_find_its_disk_full_is_refused_with_the_place_and_the_remedy(
    source: Path, disk: Path, detach: list[str], runtime: Path
) -> None:
    del runtime
    fill(disk, leave=4 << 20)
    words = ["-m", "skillwing.services.terminal.cli", "mock", str(source), "--run-dir", str(disk / "run"), *detach]
    ended = subprocess.run([sys.executable, *words], capture_output=True, text=True, timeout=WITHIN, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith(f"There is no room for a run in `{disk / 'run'}`: ")
    assert "`skillwing runs prune`" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_directory_for_the_announcement_that_is_full_is_named(
    source: Path, tmp_path: Path, disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (disk / "skillwing").mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(disk))
    fill(disk)
    words = ["mock", str(source), "--run-dir", str(tmp_path / "run"), "--no-record", "--colocate"]
    command = [sys.executable, "-m", "skillwing.services.terminal.cli", *words]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=WITHIN, check=False)
    assert ended.returncode == 1
    assert f"`{disk / 'skillwing' / 'press.json'}` cannot be written: No space left on device." in ended.stderr
