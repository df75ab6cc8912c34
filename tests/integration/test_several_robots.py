"""Two robots at one router, with real processes: their commands from elsewhere, and the end of the shared router."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Command

from skillwing.services.client.connection import find_target
from skillwing.services.client.sync import connect
from skillwing.services.errors import NoSystemError, SeveralSystemsError
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.protocol import State
from skillwing.services.terminal.exit_codes import NO_SYSTEM, OK, REFUSED, USAGE

pytestmark = pytest.mark.slow

PATIENCE = 60.0
SHUTTLE = """
skillset shuttle {
    resource bay { initial FREE  FREE -> USED  USED -> FREE }
    skill go {
        input { to: float64 in 0.0..9.0 = 1.0 }
        effect { take: bay -> USED  give: bay -> FREE }
        precondition { free: resource=(bay == FREE)  success take }
        result { success THERE: apply=give }
    }
}
"""


@pytest.fixture(scope="module")
def robots(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Mocked robots `first`, which owns the router, and `second`; neither has the name of a table. The endpoint."""
    folder = tmp_path_factory.mktemp("shuttle")
    file = folder / "shuttle.skillset"
    file.write_text(SHUTTLE, encoding="utf-8")
    options = ("--detach", "--no-record", "--colocate")
    said = skillwing("mock", str(file), "--robot-name", "first", "--run-dir", str(folder / "1"), *options)
    assert said.code == OK, said.error
    state = read_run_state("first")
    assert state is not None
    words = ("--robot-name", "second", "--router", state.endpoint, "--run-dir", str(folder / "2"))
    said = skillwing("mock", str(file), *words, *options)
    assert said.code == OK, said.error
    assert "`skillwing down --robot second`" in said.out
    try:
        yield state.endpoint
    finally:
        skillwing("down", "--robot", "second")
        assert skillwing("down", "--robot", "first", "--force").code == OK


@pytest.fixture
def elsewhere(robots: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> str:
    """A place without run states, as another machine is."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("SKILLWING_CONNECT", robots)
    monkeypatch.delenv("SKILLWING_ROBOT", raising=False)
    return robots


@pytest.mark.usefixtures("elsewhere")
def test_a_name_is_enough_for_every_command_from_elsewhere(skillwing: Command) -> None:
    assert skillwing("start", "go", "--follow", "--robot", "second").code == OK
    assert skillwing("resources", "--robot", "second").code == OK
    status = skillwing("status", "--robot", "second", "--json")
    assert (status.code, status.json["robot"], status.json["resources"]) == (OK, "second", {"bay": "FREE"})
    assert set(status.json["processes"]) == {"resource_manager", "data_manager", "skill/go", "mocked_world"}
    assert skillwing("ready", "go", "--robot", "second").code == OK
    assert skillwing("top", "--once", "--robot", "second").code == OK
    assert skillwing("doctor", "--robot", "second", "--json").json is not None


def test_a_name_is_enough_for_a_script(elsewhere: str) -> None:
    with connect("second", endpoint=elsewhere, schema=None) as client:
        handle = client.interface.start("go")
        client.wait_until(lambda: handle.state is State.TERMINATED, "the end", PATIENCE)
        assert handle.terminal is not None
        assert handle.terminal.label == "S_THERE"


@pytest.mark.usefixtures("elsewhere")
def test_a_robot_that_is_not_there_is_named_with_those_that_are(skillwing: Command) -> None:
    said = skillwing("status", "--robot", "third")
    assert said.code == NO_SYSTEM
    assert "No robot `third`" in said.error
    assert "`first` and `second`" in said.error


@pytest.mark.usefixtures("elsewhere")
def test_of_several_robots_elsewhere_one_has_to_be_chosen(skillwing: Command) -> None:
    with pytest.raises(SeveralSystemsError):
        find_target()
    said = skillwing("status")
    assert (said.code, "--robot first" in said.error) == (USAGE, True)


def test_of_several_robots_here_one_has_to_be_chosen(robots: str, skillwing: Command) -> None:
    assert skillwing("status").code == USAGE
    assert find_target("second").endpoint == robots
    with pytest.raises(NoSystemError):
        find_target("third")


def test_the_owner_of_a_shared_router_is_not_stopped_without_a_word(robots: str, skillwing: Command) -> None:
    said = skillwing("down", "--robot", "first")
    assert said.code == REFUSED
    assert "also that of `second`" in said.error
    assert "--force" in said.error
    assert skillwing("status", "--robot", "first").code == OK
    assert find_target("second").endpoint == robots


BOTH = """<root BTCPP_format="4" main_tree_to_execute="both">
  <BehaviorTree ID="both">
    <Sequence>
      <ParallelAll>
        <go robot="left" to="2"/>
        <SubTree ID="there and back" robot="right"/>
      </ParallelAll>
      <ResourceIs robot="left" resource="bay" states="FREE"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="there and back"><Sequence><go to="3"/><go to="0"/></Sequence></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="both"><MetadataFields><Metadata robots="left right" needs="left.bay: FREE"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


@pytest.mark.usefixtures("robots")
def test_one_mission_commands_both_robots(skillwing: Command, tmp_path: Path) -> None:
    file = tmp_path / "both.xml"
    file.write_text(BOTH, encoding="utf-8")
    assert skillwing("mission", "run", str(file)).code == NO_SYSTEM
    words = ("--robot", "left=first", "--robot", "right=second")
    said = skillwing("mission", "check", str(file), *words)
    assert said.out.strip() == "both: fits left (shuttle), right (shuttle)"
    said = skillwing("mission", "run", str(file), *words, "--json")
    assert said.code == OK, said.error
    assert said.json["phase"] == "SUCCEEDED"
    said = skillwing("mission", "run", str(file), "--robot", "first")
    assert (said.code, "--robot left=NAME --robot right=NAME" in said.error) == (USAGE, True)


def test_ctrl_c_has_to_be_repeated_for_a_shared_router(
    skillwing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    file = tmp_path / "shuttle.skillset"
    file.write_text(SHUTTLE, encoding="utf-8")
    command = [sys.executable, "-m", "skillwing.services.terminal.cli", "mock", str(file), "--no-record", "--colocate"]
    with subprocess.Popen(
        [*command, "--robot-name", "owner", "--run-dir", str(tmp_path / "1")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        env={**os.environ, "COLUMNS": "200"},
    ) as process:
        try:
            assert process.stdout is not None
            lines = iter(process.stdout.readline, "")
            assert any("Start a skill" in line for line in lines)
            state = read_run_state("owner")
            assert state is not None
            words = ("--robot-name", "guest", "--router", state.endpoint, "--run-dir", str(tmp_path / "2"))
            said = skillwing("mock", str(file), *words, "--detach", "--no-record", "--colocate")
            assert said.code == OK, said.error
            process.send_signal(signal.SIGINT)
            warning = next(line for line in lines if "also that of" in line)
            assert "`guest`" in warning
            assert "Ctrl-C again" in warning
            assert process.poll() is None
            assert skillwing("down", "--robot", "owner").code == REFUSED
            assert skillwing("down", "--robot", "owner", "--force").code == OK
            assert "`guest` is without a router now." in "".join(lines)
        finally:
            process.kill()
            skillwing("down", "--robot", "guest")
