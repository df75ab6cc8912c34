"""A system of mocks on a small disk, with a client that starts goals all the time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

from full_disk_figures import Outage
from full_disk_judge import EndedGoal, Kill, failure_sentences, missing_sentences
from soak_run import LINES, SCRIPT, SKILLSET

from skillwing.dsl import load
from skillwing.services.bus.clock import WallClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.history.files import read_goals
from skillwing.services.history.recording_state import Gap, read_state
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from small_disk import full

KILLED = ("", "recorder", RESOURCE_MANAGER, skill_process(LINES[0]), "data_manager", "")
"""Processes that are killed in the outages, in turn; empty for none."""
RATE = 10.0
"""Goals that are started in a second."""
WITHIN = 30.0
"""Wall seconds in which a process has to be back, or everything to be written again."""
LONGEST_COMMAND = 60.0
"""Wall seconds that a command may take."""
CLI = [sys.executable, "-m", "skillwing.services.terminal.cli"]


@dataclass(slots=True)
class _Work:
    """Goals of the client, by id. times: robot times at which they ended."""

    running: dict[str, GoalHandle] = field(default_factory=dict[str, GoalHandle])
    ended: dict[str, GoalHandle] = field(default_factory=dict[str, GoalHandle])
    times: dict[str, float] = field(default_factory=dict[str, float])


class MockedSystem:
    """The system of `skillwing mock`, detached, as a context manager. disk: of its run; folder: of all else."""

    def __init__(self, disk: Path, folder: Path) -> None:
        self.run_dir = disk / "run"
        self._disk = disk
        source = folder / "soak.skillset"
        source.write_text(SKILLSET, encoding="utf-8")
        source.with_name("soak.mock.toml").write_text(SCRIPT, encoding="utf-8")
        self._command("mock", str(source), "--run-dir", str(self.run_dir), "--keep", "100MB", "--detach")
        self._bus = ZenohBus("client/full_disk", "soak", str(self._status()["endpoint"]), WallClock())
        self._interface = SkillsetInterface(self._bus, load(source), client="full_disk")
        self._work, self._turn, self._stops = _Work(), 0, False
        self._bus.every(1.0 / RATE, self._start_next)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bus.close()
        subprocess.run([*CLI, "down"], check=False, capture_output=True, timeout=60)

    def work(self, seconds: float) -> None:
        """Start goals for some wall seconds."""
        end = monotonic() + seconds
        self._bus.run_until(lambda: monotonic() >= end, seconds + 1.0)

    def suffer(self, seconds: float, killed: str, kill_at: float) -> Outage:
        """Keep the disk full for so many wall seconds, and kill a process in it after `kill_at` s."""
        outage = Outage(seconds=seconds, killed=killed)
        before = set(self._work.ended)
        gaps = len(read_state(self.run_dir).gaps)
        kill: Kill | None = None
        with full(self._disk):
            end = monotonic() + seconds
            self.work(kill_at)
            if killed:
                kill = self._kill(killed, outage)
            self.work(max(0.0, end - monotonic() - 5.0))
            said = self._status()["recording"] or ""
            if not said.startswith("The run is not recorded."):
                outage.problems.append(f"`status` says {said!r} on a full disk.")
            self.work(max(0.0, end - monotonic()))
        freed = monotonic()
        if self._bus.run_until(lambda: self._is_well(gaps), WITHIN):
            outage.back = monotonic() - freed
        else:
            outage.problems.append("The recorder does not write again.")
        self.work(2.0)
        self._judge(outage, set(self._work.ended) - before, read_state(self.run_dir).gaps[gaps:], kill)
        return outage

    def end(self) -> list[str]:
        """Stop the system. Returns a sentence for each broken promise about the whole run."""
        self._stops = True
        self._bus.run_until(lambda: not self._work.running, WITHIN)
        problems = [f"A goal of {each.skill} never ended." for each in self._work.running.values()]
        self._bus.close()
        self._command("down")
        replayed = subprocess.run([*CLI, "replay", str(self.run_dir), "--json"], capture_output=True, check=False)
        if replayed.returncode != 0:
            problems.append(f"The replay differs: {replayed.stdout.decode()}{replayed.stderr.decode()}")
        return problems

    def _judge(self, outage: Outage, ended: set[str], gaps: Sequence[Gap], kill: Kill | None) -> None:
        """Compare the goals that ended since the begin of the outage with the files and the gaps."""
        there = {status.goal_id for status in read_goals(self.run_dir) if status.terminal is not None}
        goals = sorted((self._ended(goal_id, there) for goal_id in ended), key=lambda goal: goal.t)
        outage.goals, outage.lost = len(goals), sum(sum(gap.lost.values()) for gap in gaps)
        outage.failed = sum(not goal.success for goal in goals)
        outage.unrecorded = sum(not goal.recorded for goal in goals)
        outage.problems += [*failure_sentences(goals, kill), *missing_sentences(goals, gaps)]
        if not goals:
            outage.problems.append("No goal ended.")

    def _ended(self, goal_id: str, recorded: set[str]) -> EndedGoal:
        goal = self._work.ended[goal_id]
        terminal = goal.terminal
        return EndedGoal(
            skill=goal.skill,
            t=self._work.times[goal_id],
            success=terminal is not None and terminal.success,
            ending="" if terminal is None else terminal.ending,
            reason="" if terminal is None else terminal.reason,
            recorded=goal_id in recorded,
        )

    def _is_well(self, gaps: int) -> bool:
        state = read_state(self.run_dir)
        return len(state.gaps) > gaps and state.failing is None

    def _kill(self, process: str, outage: Outage) -> Kill:
        """Kill a process with -9, and wait until another one is there."""
        before = self._processes()[process]["pid"]
        at = self._bus.now()
        os.kill(before, 9)
        end, now = monotonic() + WITHIN, {}
        while monotonic() < end:
            now = self._processes()[process]
            if now["state"] == "runs" and now["pid"] != before:
                return Kill(process=process, at=at, back=self._bus.now())
        outage.problems.append(f"{process} does not come back: it {now.get('state')}.")
        return Kill(process=process, at=at, back=None)

    def _processes(self) -> dict[str, Any]:
        return self._status()["processes"]

    def _status(self) -> dict[str, Any]:
        return json.loads(self._command("status", "--json"))

    def _command(self, *words: str) -> str:
        """Run a command, while goals are started. Returns its output. Raises RuntimeError if it did not do its work.

        Exit code 1 of `status` is a trouble that it found, such as a process that is away for the moment.
        """
        process = subprocess.Popen([*CLI, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            if hasattr(self, "_bus") and not self._bus.closed:
                self._bus.run_until(lambda: process.poll() is not None, LONGEST_COMMAND)
            said, error = process.communicate(timeout=LONGEST_COMMAND)
        finally:
            process.kill()
        if process.returncode not in ((0, 1) if words[0] == "status" else (0,)):
            raise RuntimeError(f"`skillwing {' '.join(words)}` ended with {process.returncode}: {error}{said}")
        return said

    def _start_next(self) -> None:
        for goal_id, goal in list(self._work.running.items()):
            if goal.terminal is not None:
                self._work.ended[goal_id] = self._work.running.pop(goal_id)
        if self._stops or not self._interface.ready:
            return
        skill = LINES[self._turn % len(LINES)]
        self._turn += 1
        if all(goal.skill != skill for goal in self._work.running.values()):
            handle = self._interface.start(skill)
            self._work.running[handle.goal_id] = handle
            handle.on_change(self._note_end)

    def _note_end(self, goal: GoalHandle) -> None:
        if goal.done:
            self._work.times[goal.goal_id] = self._bus.now()
