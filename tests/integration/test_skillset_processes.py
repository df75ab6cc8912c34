"""The bench of real processes: hooks and mocks over Zenoh, and no process left afterwards."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus.reading import message_reader
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.processes.launcher import StartError
from skillwing.services.protocol import Message
from skillwing.services.testing import FakeLayer, SkillsetProcesses

pytest_plugins = ["skillwing.services.testing.fixtures"]
pytestmark = pytest.mark.slow

ROVER = Path(__file__).parents[2] / "examples" / "rover" / "rover.skillset"
TARGET = {"x": 1.0, "y": 2.0, "heading": 0.0}
DATA = {"battery": 80.0, "tilt": 0.0, "sun_current": 2.0}
ODOMETRY = "fl/wheels/odometry"


class Odometry(Message, frozen=True, kw_only=True):
    remaining: float


class DriveTo(SkillHooks[dict[str, Any], dict[str, Any], None]):
    """Skill that arrives when odometry reports no remaining distance."""

    skill = "drive_to"

    def setup(self) -> None:
        self.bus.subscribe(ODOMETRY, message_reader(Odometry, self._on_odometry))

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self.target = goal.inputs["target"]

    def _on_odometry(self, odometry: Odometry) -> None:
        if self.current is not None and odometry.remaining <= 0.0:
            self.terminated(self.current.id, "ARRIVED", {"stopped_at": self.target})


class Wheels(FakeLayer):
    """Functional layer of a rover that has always arrived."""

    def setup(self) -> None:
        self.bus.every(0.1, lambda: self.publish(ODOMETRY, Odometry(remaining=0.0)))


def test_hooks_and_mocks_run_as_processes_and_none_is_left(
    skillset_processes: Callable[..., SkillsetProcesses],
) -> None:
    robot = skillset_processes(ROVER, {"drive_to": f"{__name__}:DriveTo"}, data=DATA, layer=Wheels())
    processes = [psutil.Process(pid) for pid in robot.launcher.pids.values()]
    assert len(processes) == 1 + 2 + 4, "the router, two managers, four skills"
    robot.start_skill("drive_to", target=TARGET).assert_ended("S_ARRIVED", output={"stopped_at": TARGET})

    goal = robot.start_skill("take_sample")
    robot.assert_states(wheels="LOCKED", drill="DOWN")
    robot.set_states(emergency_stop="PRESSED")
    goal.assert_ended("RI", invariant="released")
    assert goal.causes == ["emergency_stop PRESSED", "take_sample.released VIOLATED", "take_sample RI"]
    robot.set_states(emergency_stop="RELEASED")

    goal = robot.start_skill("recharge")
    robot.kill("skill/recharge")
    goal.assert_ended("LOST")
    robot.assert_states(wheels="PARKED", within=10.0)
    robot.restart("skill/recharge")
    robot.start_skill("recharge").assert_ended("S_CHARGED")

    with pytest.raises(UnknownNameError, match="did you mean `skill/turn`"):
        robot.kill("skill/trun")
    robot.close()
    assert psutil.wait_procs(processes, timeout=0)[1] == []
    robot.close()


def test_what_does_not_come_up_says_why_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken.py").write_text("class Broken:\n    pass\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    before = set(psutil.Process().children(recursive=True))
    with pytest.raises(StartError, match="no skill manager"):
        SkillsetProcesses(ROVER, {"drive_to": "broken:Broken"}, run_dir=tmp_path)
    assert set(psutil.Process().children(recursive=True)) == before
