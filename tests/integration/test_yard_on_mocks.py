"""Two mocked drones and the yard that they share, with real processes at one router: `examples/yard/survey.xml`."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Command
from quick_yard import PATIENCE, ROBOTS, YARD, up_words, wait_until_free
from running_system import shown_phase, until

from skillwing.services.processes.run_state import read_run_state
from skillwing.services.terminal.exit_codes import FAILED, OK, REFUSED

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]


@pytest.fixture(scope="module")
def yard(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Command]:
    folder = tmp_path_factory.mktemp("yard")
    router: tuple[str, ...] = ()
    try:
        for robot in ROBOTS:
            options = ("--detach", "--colocate", "--no-record", "--run-dir", str(folder / robot))
            said = skillwing("up", *up_words(robot, folder), *router, *options)
            assert said.code == OK, said.error
            state = read_run_state(ROBOTS[0])
            assert state is not None
            router = ("--router", state.endpoint)
        yield skillwing
    finally:
        for robot in reversed(ROBOTS):
            skillwing("down", "--robot", robot)


def test_both_drones_visit_the_pad_one_after_the_other(yard: Command) -> None:
    wait_until_free(yard)
    said = yard("mission", "run", str(YARD / "survey.xml"), "speed=2", "--json")
    assert said.code == OK, said.error
    assert said.json["phase"] == "SUCCEEDED"
    for robot in ROBOTS[:2]:
        assert yard("resources", "--robot", robot, "--json").json["states"]["flight_status"] == "ON_GROUND"
    wait_until_free(yard)


VISIT = """
<root BTCPP_format="4" main_tree_to_execute="visit">
  <BehaviorTree ID="visit">
    <Fallback>
      <WithLease patience="60">
        <hold_pad robot="yard" holder="me"/>
        <Sequence robot="me"><takeoff height="4"/><land/></Sequence>
      </WithLease>
      <land robot="me"/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="rescue"><land/></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="visit"><MetadataFields><Metadata robots="me yard"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


def test_missions_of_both_drones_run_on_board_side_by_side_and_wait_for_the_pad(yard: Command, tmp_path: Path) -> None:
    """A third lease holds the pad until both missions run."""
    wait_until_free(yard)
    file = tmp_path / "visit.xml"
    file.write_text(VISIT, encoding="utf-8")
    assert yard("start", "hold_pad", "holder=nobody", "--robot", "yard").code == OK
    run = (sys.executable, "-m", "skillwing.services.terminal.cli", "mission", "run", str(file), "--on-board", "--json")
    missions = [
        subprocess.Popen([*run, "--robot", f"me={robot}"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for robot in ROBOTS[:2]
    ]
    until(lambda: all(shown_phase(yard, robot) == "RUNNING" for robot in ROBOTS[:2]), "both missions")
    assert shown_phase(yard, "yard") is None
    said = yard("mission", "abort", "--robot", "yard")
    assert said.code == FAILED
    assert said.error == "No mission runs here. One runs at `left` and `right`: choose with `--robot left`.\n"
    assert yard("interrupt", "hold_pad", "--robot", "yard").code == OK
    assert [(mission.communicate(timeout=PATIENCE), mission.returncode)[1] for mission in missions] == [OK, OK]


def test_a_place_is_lent_once(yard: Command) -> None:
    wait_until_free(yard)
    assert yard("start", "hold_way", "holder=left", "--robot", "yard").code == OK
    assert yard("start", "hold_pad", "holder=right", "--robot", "yard").code == REFUSED
    assert yard("interrupt", "hold_way", "--robot", "yard").code == OK
    assert yard("start", "hold_pad", "holder=right", "--robot", "yard").code == REFUSED
    wait_until_free(yard)
