"""The yard and its two drones on mocks at one router with keys: what several robots share, and who may share it."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import Command
from quick_yard import PATIENCE, ROBOTS, YARD, up_words, wait_until_free

from skillwing.services.history.files import read_records
from skillwing.services.terminal.exit_codes import OK, REFUSED

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]

# What a mission of several robots needs: goals and data of all three, and leases of the yard.
VISITS = """
<root BTCPP_format="4" main_tree_to_execute="visits">
  <BehaviorTree ID="visits">
    <ParallelAll>
      <SubTree ID="one drone" robot="left" me="left" home="0,8,4"/>
      <SubTree ID="one drone" robot="right" me="right" home="0,-8,4"/>
    </ParallelAll>
  </BehaviorTree>
  <BehaviorTree ID="one drone">
    <Fallback>
      <Sequence>
        <takeoff height="4"/>
        <WithLease patience="120">
          <hold_pad robot="yard" holder="{me}"/>
          <Sequence><goto_straight target="0,0,4" speed="2"/><goto_straight target="{home}" speed="2"/></Sequence>
          <DataCompare robot="yard" datum="pad_robot" sign="==" value="{me}"/>
        </WithLease>
        <land/>
      </Sequence>
      <land/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="rescue"><land/></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="visits"><MetadataFields><Metadata robots="left right yard"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


@dataclass(frozen=True)
class Site:
    """The address of the router, the folder of its keys, and the run of the yard."""

    endpoint: str
    keys: Path
    run_dir: Path


def make_keys(skillwing: Command, keys: Path) -> None:
    """Keys of the drones and of the yard, whose watch reads them, and of people. Missions of `left` work at both."""
    others = ("--with", "right", "--with", "yard")
    assert skillwing("keys", "init", str(keys), "--robot-name", "left", *others).code == OK
    folder = ("--keys", str(keys))
    assert skillwing("keys", "add-robot", "m600", "--robot-name", "right", *folder).code == OK
    assert skillwing("keys", "add-robot", str(YARD), "--with", "left", "--with", "right", *folder).code == OK
    for name, role in (("alice", "client"), ("vic", "viewer")):
        assert skillwing("keys", "add", name, "--role", role, *folder).code == OK


@pytest.fixture(scope="module")
def site(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("site")
    keys = folder / "keys"
    make_keys(skillwing, keys)
    words = [sys.executable, "-m", "skillwing.services.terminal.cli", "router", "--listen", "tls/127.0.0.1:0"]
    router = subprocess.Popen([*words, "--keys", str(keys)], stdout=subprocess.PIPE, text=True)
    try:
        assert router.stdout is not None
        endpoint = router.stdout.readline().strip()
        for robot in ROBOTS:
            options = ("--detach", "--colocate", "--run-dir", str(folder / robot))
            options += () if robot == "yard" else ("--no-record",)
            said = skillwing("up", *up_words(robot, folder), "--router", endpoint, "--keys", str(keys), *options)
            assert said.code == OK, said.error
        yield Site(endpoint, keys, folder / "yard")
    finally:
        for robot in reversed(ROBOTS):
            skillwing("down", "--robot", robot)
        router.send_signal(signal.SIGINT)
        assert router.wait(PATIENCE) == OK


@pytest.fixture
def by_alice(site: Site, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Commands of a client."""
    monkeypatch.setenv("SKILLWING_KEYS", str(site.keys / "people" / "alice"))
    yield


@pytest.mark.usefixtures("by_alice")
@pytest.mark.parametrize(("words", "asker"), [((), "alice"), (("--on-board",), "left.mission")])
def test_both_drones_visit_the_pad_by_a_mission_of_a_client(
    site: Site, skillwing: Command, tmp_path: Path, words: tuple[str, ...], asker: str
) -> None:
    (tmp_path / "visits.xml").write_text(VISITS, encoding="utf-8")
    wait_until_free(skillwing)
    said = skillwing("mission", "run", str(tmp_path / "visits.xml"), *words, "--json")
    assert said.code == OK, said.error
    assert said.json["phase"] == "SUCCEEDED"
    leases = [record.text for record in read_records(site.run_dir) if record.subject == "hold_pad"]
    assert any(f"asked by {asker}" in text for text in leases), leases
    wait_until_free(skillwing)


def test_a_viewer_runs_no_mission(site: Site, skillwing: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SKILLWING_KEYS", str(site.keys / "people" / "vic"))
    for words in ((), ("--on-board",)):
        said = skillwing("mission", "run", str(YARD / "survey.xml"), *words)
        assert said.code == REFUSED
        assert "`vic` is a viewer" in said.error


@pytest.mark.usefixtures("by_alice")
def test_a_robot_that_was_not_let_in_gets_no_mission_of_its_launcher(skillwing: Command) -> None:
    said = skillwing("mission", "run", str(YARD / "survey.xml"), "--robot", "right", "--on-board")
    assert said.code == REFUSED
    assert "nothing is heard of the resource manager of `left` and `yard`" in said.error
    assert "`--with`" in said.error
