"""Missions on board over several robots, with real processes: one launcher runs it, and all robots show it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command_line import Command
from running_system import PATIENCE, goal_runs, process_id, shown_phase, until

from skillwing.services.processes.run_state import read_run_state
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, NO_SYSTEM, OK, REFUSED, USAGE

pytestmark = pytest.mark.slow

CLI = (sys.executable, "-m", "skillwing.services.terminal.cli")
SHUTTLE = """
skillset shuttle {
    resource bay { initial FREE  FREE -> USED  USED -> FREE }
    skill go {
        input { to: float64 in 0.0..9.0 = 1.0 }
        effect { take: bay -> USED  give: bay -> FREE }
        precondition { free: resource=(bay == FREE)  success take }
        interrupt { apply=give }
        result { success THERE: apply=give }
    }
    skill wait {
        interrupt { }
        result { success DONE }
    }
}
"""
SCRIPT = """
[skill.wait]
delay = 600.0
"""
TREE = """
<root BTCPP_format="4" main_tree_to_execute="both">
  <BehaviorTree ID="both">
    <ParallelAll>
      <Sequence robot="left"><go to="2"/>{middle}</Sequence>
      <go robot="right"/>
    </ParallelAll>
  </BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="both"><MetadataFields><Metadata robots="left right"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


@pytest.fixture(scope="module")
def robots(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Mocked robots `first`, which owns the router, and `second`. The folder of their runs."""
    folder = tmp_path_factory.mktemp("shuttles")
    file, script = folder / "shuttle.skillset", folder / "slow.mock.toml"
    file.write_text(SHUTTLE, encoding="utf-8")
    script.write_text(SCRIPT, encoding="utf-8")
    router: tuple[str, ...] = ()
    try:
        for name in ("first", "second"):
            words = ("--robot-name", name, "--script", str(script), "--run-dir", str(folder / name), *router)
            said = skillwing("mock", str(file), *words, "--detach", "--no-record", "--colocate")
            assert said.code == OK, said.error
            state = read_run_state("first")
            assert state is not None
            router = ("--router", state.endpoint)
        yield folder
    finally:
        for name in ("second", "first"):
            skillwing("down", "--robot", name)


@pytest.fixture
def tree(tmp_path: Path) -> Callable[[str], str]:
    def write(middle: str = "") -> str:
        file = tmp_path / "both.xml"
        file.write_text(TREE.format(middle=middle), encoding="utf-8")
        return str(file)

    return write


NAMED = ("--robot", "left=first", "--robot", "right=second")


def started(*words: str) -> subprocess.Popen[str]:
    """A command that shows a mission on board, from its first progress on."""
    command = subprocess.Popen(
        [*CLI, "mission", "run", *words, "--on-board"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    assert command.stdout is not None
    lines: list[str] = []
    for line in command.stdout:
        lines.append(line)
        if "RUNNING" in line:
            return command
    raise AssertionError("".join(lines))


@pytest.mark.parametrize(("words", "runs_it"), [((), "first"), (("--robot", "second"), "second")])
def test_the_launcher_of_one_robot_runs_the_mission_on_both(
    robots: Path, skillwing: Command, tree: Callable[[str], str], words: tuple[str, ...], runs_it: str
) -> None:
    said = skillwing("mission", "run", tree(""), *NAMED, *words, "--on-board", "--json")
    assert said.code == OK, said.error
    assert said.json["phase"] == "SUCCEEDED"
    assert list((robots / runs_it / "trees").glob("both*.xml"))
    until(lambda: process_id(runs_it, "mission") is None, "the end of its process")


def test_a_mission_on_board_is_shown_and_aborted_at_each_of_its_robots(
    robots: Path, skillwing: Command, tree: Callable[[str], str]
) -> None:
    del robots
    command = started(tree("<wait/>"), *NAMED)
    command.send_signal(signal.SIGINT)
    assert command.wait(PATIENCE) == INTERRUPTED
    for robot in ("first", "second"):
        assert shown_phase(skillwing, robot) == "RUNNING"
    assert process_id("first", "mission")
    assert process_id("second", "mission") is None
    busy = skillwing("mission", "run", tree(""), *NAMED, "--robot", "second", "--on-board")
    assert (busy.code, "runs here already" in busy.error) == (REFUSED, True)
    assert skillwing("mission", "abort", "--robot", "second").code == OK
    until(lambda: process_id("first", "mission") is None, "the end of its process")
    for robot in ("first", "second"):
        assert skillwing("start", "go", "--follow", "--robot", robot).code == OK, "for those who come next"


def test_a_mission_that_is_busy_elsewhere_is_refused_before_its_first_goal(
    robots: Path, skillwing: Command, tree: Callable[[str], str], tmp_path: Path
) -> None:
    del robots
    alone = tmp_path / "alone.xml"
    alone.write_text('<root BTCPP_format="4"><BehaviorTree ID="alone"><wait/></BehaviorTree></root>', encoding="utf-8")
    command = started(str(alone), "--robot", "second")
    busy = skillwing("mission", "run", tree(""), *NAMED, "--on-board")
    assert busy.code == REFUSED
    assert "Another mission runs at `second`." in busy.error
    assert skillwing("mission", "abort", "--robot", "second").code == OK
    assert command.wait(PATIENCE) == FAILED


def test_what_cannot_work_is_refused_with_words(robots: Path, skillwing: Command, tree: Callable[[str], str]) -> None:
    del robots
    mission = tree("")
    absent = skillwing("mission", "run", mission, "--robot", "left=first", "--robot", "right=third", "--on-board")
    assert absent.code == NO_SYSTEM
    elsewhere = skillwing("mission", "run", mission, *NAMED, "--robot", "third", "--on-board")
    assert elsewhere.code == USAGE
    assert "The launcher of one of these robots runs it." in elsewhere.error
    twice = skillwing("mission", "run", mission, "--robot", "left=first", "--robot", "right=first", "--on-board")
    assert twice.code == USAGE
    assert "Robot `first` cannot be `left` and `right` of the mission at once." in twice.error
    unknown = skillwing("mission", "run", mission, *NAMED, "--robot", "up=first", "--on-board")
    assert (unknown.code, "There is no robot `up`" in unknown.error) == (USAGE, True)
    wrong = skillwing("mission", "run", tree("<goo/>"), *NAMED, "--on-board")
    assert (wrong.code, "did you mean `go`?" in wrong.error) == (USAGE, True)


def test_a_mission_whose_process_is_killed_leaves_both_robots_usable(
    robots: Path, skillwing: Command, tree: Callable[[str], str]
) -> None:
    del robots
    command = started(tree("<wait/>"), *NAMED)
    os.kill(until(lambda: process_id("first", "mission"), "the mission's process"), signal.SIGKILL)
    said, _ = command.communicate(timeout=PATIENCE)
    assert command.returncode == FAILED
    assert "its process has ended: mission was killed by SIGKILL." in said
    until(lambda: not goal_runs(skillwing, "second", "go"), "the end of the goal of the dead mission")
    again = skillwing("mission", "run", tree(""), *NAMED, "--on-board")
    assert again.code == OK, again.error
