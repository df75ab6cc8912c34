"""The yard and its two drones on mocks at one router with keys: what several robots share, and who may share it."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from command_line import Command

from skillwing.services.history.files import read_records
from skillwing.services.terminal.exit_codes import OK, REFUSED

pytestmark = [pytest.mark.slow, pytest.mark.timeout(400)]

YARD = Path(__file__).parents[2] / "examples" / "yard"
PATIENCE = 60.0
ROBOTS = ("left", "right", "yard")


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
            mocked = ("--mock", "--robot-name", robot, "--script", str(YARD / f"{robot}.mock.toml"))
            given = ("--robot", str(YARD)) if robot == "yard" else mocked
            options = ("--detach", "--colocate", "--run-dir", str(folder / robot))
            options += () if robot == "yard" else ("--no-record",)
            said = skillwing("up", *given, "--router", endpoint, "--keys", str(keys), *options)
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


def wait_until_free(skillwing: Command) -> None:
    """The watch reads the positions of both drones, and the judge believes it: each place becomes free."""
    deadline = time.monotonic() + PATIENCE
    while set(skillwing("resources", "--robot", "yard", "--json").json["states"].values()) != {"FREE"}:
        assert time.monotonic() < deadline


@pytest.mark.usefixtures("by_alice")
@pytest.mark.parametrize(("words", "asker"), [((), "alice"), (("--on-board",), "left.mission")])
def test_both_drones_visit_the_pad_by_a_mission_of_a_client(
    site: Site, skillwing: Command, words: tuple[str, ...], asker: str
) -> None:
    wait_until_free(skillwing)
    said = skillwing("mission", "run", str(YARD / "survey.xml"), "speed=2", *words, "--json")
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
