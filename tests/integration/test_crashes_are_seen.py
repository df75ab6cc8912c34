"""Crashes and hangs of a ground robot's managers, with real processes: what `status`, `top` and `doctor` show."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from command_line import Command

from skillwing.services.history.files import read_goals
from skillwing.services.protocol import State
from skillwing.services.terminal.exit_codes import FAILED, OK

pytestmark = pytest.mark.slow

PATIENCE = 60.0
FORKLIFT = """
skillset forklift {
    enum Mode { SLOW FAST }
    data { charge: float64 period=1.0  load: float64 [kg] period=1.0 }
    resource wheels { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    resource fork { initial LOWERED  LOWERED -> MOVING  MOVING -> LOWERED  MOVING -> RAISED  RAISED -> MOVING }
    resource area { initial CLEAR  extern CLEAR -> OCCUPIED  extern OCCUPIED -> CLEAR }
    resource brake { initial RELEASED  extern RELEASED -> APPLIED  extern APPLIED -> RELEASED }
    skill drive {
        progress=0.2 { left: float64 [m] }
        input { target: float64 [m]  speed: float64 [m/s] in 0.1..3.0 }
        effect { take: wheels -> TAKEN  release: wheels -> FREE }
        precondition {
            clear: resource=(area == CLEAR)
            released: resource=(brake == RELEASED)
            free: resource=(wheels == FREE)
            success take
        }
        invariant { clear: resource=(area == CLEAR)  violation=release }
        result { success ARRIVED: apply=release  failure BLOCKED: apply=release }
        interrupt { apply=release }
    }
    skill lift {
        input { height: float64 [m] in 0.0..4.0  mode: Mode }
        effect { take: fork -> MOVING  raised: fork -> RAISED  lowered: fork -> LOWERED }
        precondition { success take }
        result { success UP: apply=raised  failure STUCK: apply=lowered }
        interrupt { apply=lowered }
    }
    skill lower {
        effect { take: fork -> MOVING  lowered: fork -> LOWERED }
        precondition { success take }
        result { success DOWN: apply=lowered  failure STUCK: apply=lowered }
        interrupt { apply=lowered }
    }
    skill wait { input { duration: float64 [s] } result { success DONE } }
    skill scan { result { success SEEN  failure NOTHING } }
}
"""
SCRIPT = """
[skill.drive]
delay = 1000.0
[skill.lift]
delay = 1000.0
[skill.scan]
forever = true
"""


class Forklift:
    """A mocked forklift. Its processes are killed and stopped by their names."""

    def __init__(self, command: Command, run_dir: Path) -> None:
        self.command = command
        self.run_dir = run_dir
        self.supervisor = int(self.status["pid"])

    @property
    def status(self) -> Any:
        return self.command("status", "--json").json

    def signal(self, process: str, number: signal.Signals) -> None:
        os.kill(self.status["processes"][process]["pid"], number)

    def start(self, skill: str, *inputs: str) -> str:
        said = self.command("start", skill, *inputs, "--json")
        assert said.code == OK, said.error
        return str(said.json["goal_id"])

    def goal(self, goal_id: str) -> Any:
        """The goal in `status`; None if it is not there."""
        return next((goal for goal in self.status["goals"] if goal["goal_id"] == goal_id), None)

    def ending(self, goal_id: str) -> str | None:
        """Kind of end of a goal in `status`."""
        goal = self.goal(goal_id)
        return None if goal is None or goal["terminal"] is None else str(goal["terminal"]["ending"])

    def recorded_endings(self, goal_id: str) -> list[str]:
        return [
            str(goal.terminal.ending)
            for goal in read_goals(self.run_dir)
            if goal.goal_id == goal_id and goal.terminal is not None
        ]

    def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, self.status

    def until_well(self) -> None:
        self.until(lambda: self.command("status").code == OK)

    def findings(self) -> dict[str, str]:
        """Sentences of `doctor`, by the names of their problems."""
        return {each["about"]: each["what"] for each in self.command("doctor", "--json").json["findings"]}


@pytest.fixture(scope="module")
def forklift(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Forklift]:
    """A mocked forklift. Afterwards none of its processes is left."""
    folder = tmp_path_factory.mktemp("forklift")
    (folder / "forklift.skillset").write_text(FORKLIFT, encoding="utf-8")
    (folder / "forklift.mock.toml").write_text(SCRIPT, encoding="utf-8")
    said = skillwing("mock", str(folder / "forklift.skillset"), "--detach", "--run-dir", str(folder / "run"))
    assert said.code == OK, said.error
    robot = Forklift(skillwing, folder / "run")
    processes = psutil.Process(robot.supervisor).children()
    try:
        yield robot
    finally:
        assert skillwing("down").code == OK
        assert psutil.wait_procs(processes, timeout=PATIENCE)[1] == []


@pytest.fixture
def without_restarts(forklift: Forklift) -> Iterator[None]:
    """The supervisor is stopped, so that a killed process stays down."""
    os.kill(forklift.supervisor, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(forklift.supervisor, signal.SIGCONT)
        forklift.until_well()


def manager_in_top(forklift: Forklift, skill: str) -> str:
    return str(forklift.command("top", "--json").json["skills"][skill]["manager"])


def row(text: str, skill: str) -> list[str]:
    """Words of a skill's row in a table."""
    return next(line.split() for line in text.splitlines() if line.startswith(f"{skill} "))


@pytest.mark.usefixtures("without_restarts")
def test_a_killed_manager_is_seen_while_it_is_down(forklift: Forklift) -> None:
    goal = forklift.start("drive", "target=5", "speed=1")
    forklift.signal("skill/drive", signal.SIGKILL)
    said = forklift.command("status")
    assert said.code == FAILED
    assert goal in said.out, "neither running nor ended is the goal forgotten"
    forklift.until(lambda: forklift.ending(goal) == "LOST")
    assert forklift.command("status").code == FAILED
    assert "skill/drive" in forklift.goal(goal)["terminal"]["reason"]
    assert forklift.status["resources"]["wheels"] == "FREE"
    assert manager_in_top(forklift, "drive") == "down"
    shown = row(forklift.command("top", "--once").out, "drive")
    assert shown[1:3] == ["DOWN", "LOST"]
    found = forklift.findings()
    assert "skill/drive" in found["process_down"]
    assert "`drive` ended LOST" in found["goal_lost"]
    assert forklift.command("doctor").code == FAILED


def test_after_the_restart_the_lost_goal_is_still_shown(forklift: Forklift) -> None:
    goal = forklift.start("drive", "target=5", "speed=1")
    forklift.signal("skill/drive", signal.SIGKILL)
    forklift.until(lambda: forklift.ending(goal) == "LOST")
    forklift.until_well()
    assert forklift.ending(goal) == "LOST"
    assert manager_in_top(forklift, "drive") == "runs"
    forklift.until(lambda: forklift.recorded_endings(goal) == ["LOST"])


def test_a_stopped_manager_is_seen_and_its_goal_ends_once(forklift: Forklift) -> None:
    goal = forklift.start("scan")
    forklift.signal("skill/scan", signal.SIGSTOP)
    try:
        assert forklift.command("status").code == FAILED
        forklift.until(lambda: forklift.ending(goal) == "LOST")
        assert row(forklift.command("top", "--once").out, "scan")[1:3] == ["SILENT", "LOST"]
        assert "skill/scan" in forklift.findings()["process_stopped"]
        assert forklift.command("status").code == FAILED
    finally:
        forklift.signal("skill/scan", signal.SIGCONT)
    forklift.until_well()
    assert forklift.ending(goal) == "LOST"
    # The manager learns of the loss, and can run the next goal. Its own news of the old one changes nothing.
    forklift.until(lambda: forklift.command("start", "scan").code == OK)
    assert forklift.command("interrupt", "scan").code == OK
    assert forklift.recorded_endings(goal) == ["LOST"]


def test_a_goal_is_known_while_its_manager_and_the_resource_manager_are_down(forklift: Forklift) -> None:
    goal = forklift.start("lift", "height=2", "mode=SLOW")
    forklift.until(
        lambda: any(each.goal_id == goal and each.state is State.RUNNING for each in read_goals(forklift.run_dir))
    )
    forklift.signal("resource_manager", signal.SIGSTOP)
    try:
        forklift.signal("skill/lift", signal.SIGKILL)
        said = forklift.command("status")
        assert said.code == FAILED
        assert goal in said.out
        assert row(forklift.command("top", "--once").out, "lift")[1] == "RUNNING"
    finally:
        forklift.signal("resource_manager", signal.SIGCONT)
    forklift.until(lambda: forklift.ending(goal) == "LOST")
    forklift.until_well()
    assert forklift.status["resources"]["fork"] == "LOWERED"


def test_a_lost_goal_is_known_after_the_resource_manager_was_killed_too(forklift: Forklift) -> None:
    goal = forklift.start("drive", "target=5", "speed=1")
    forklift.signal("skill/drive", signal.SIGKILL)
    forklift.until(lambda: forklift.recorded_endings(goal) == ["LOST"])
    forklift.signal("resource_manager", signal.SIGKILL)
    assert forklift.command("status").code == FAILED
    forklift.until_well()
    assert forklift.ending(goal) == "LOST"
