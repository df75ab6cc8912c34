"""A mocked rover with keys: skills run, processes and the router are killed, names are taken back."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Command, Said
from running_system import until

from skillwing.dsl import load
from skillwing.services.history.files import read_records
from skillwing.services.history.history import History
from skillwing.services.history.wording import headline
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.processes.run_state import RunState, read_run_state
from skillwing.services.protocol import Ending, Record

ROVER = Path(__file__).parents[2] / "examples" / "rover" / "rover.skillset"
TARGET = 'target={"x": 1, "y": 2, "heading": 0}'
TIMEOUT = 30.0


class Rover:
    """The running rover, and the command line in the hands of its people."""

    def __init__(self, skillwing: Command, keys: Path, run_dir: Path) -> None:
        self.keys, self.run_dir = keys, run_dir
        self._skillwing = skillwing

    def by(self, name: str, *words: str) -> Said:
        """A command of a person; an empty name is somebody without keys."""
        with pytest.MonkeyPatch.context() as patch:
            patch.delenv("SKILLWING_KEYS", raising=False)
            if name:
                patch.setenv("SKILLWING_KEYS", str(self.keys / ("robots/rover" if "." in name else "people") / name))
            return self._skillwing(*words)

    @property
    def state(self) -> RunState:
        state = read_run_state("rover")
        assert state is not None
        return state

    def kill(self, process: str) -> None:
        """Kill a process with -9 and wait until it runs again."""
        before = self._process(process)
        os.kill(before, signal.SIGKILL)
        until(lambda: self._process(process) not in (before, 0), f"{process} again")
        until(lambda: self.by("vic", "status").code == 0, "an answer")

    def _process(self, name: str) -> int:
        return next((each.pid or 0 for each in self.state.processes if each.name == name and each.life == "lives"), 0)


@pytest.fixture(scope="module")
def rover(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rover]:
    folder = tmp_path_factory.mktemp("site")
    keys, run_dir = folder / "keys", folder / "run"
    assert (
        skillwing("keys", "init", str(keys), "--skillset", str(ROVER), "--host", "10.0.0.5", "--days", "20").code == 0
    )
    for name, role in {"vic": "viewer", "alice": "client", "bob": "client", "olga": "operator"}.items():
        assert skillwing("keys", "add", name, "--role", role, "--keys", str(keys)).code == 0
    # ann keeps the folder of an operator, before she gets that of a viewer.
    assert skillwing("keys", "add", "ann", "--role", "operator", "--keys", str(keys)).code == 0
    shutil.copytree(keys / "people" / "ann", keys / "people" / "ann-before")
    assert skillwing("keys", "add", "ann", "--role", "viewer", "--keys", str(keys)).code == 0
    assert skillwing("keys", "add", "dan", "--role", "client", "--days", "1", "--keys", str(keys)).code == 0
    started = skillwing("mock", str(ROVER), "--keys", str(keys), "--run-dir", str(run_dir), "--detach")
    assert started.code == 0, started.error
    try:
        yield Rover(skillwing, keys, run_dir)
    finally:
        skillwing("down")


def test_a_client_runs_a_skill_and_its_name_is_recorded(rover: Rover) -> None:
    done = rover.by("alice", "start", "drive_to", TARGET, "--follow")
    assert done.code == 0, done.error
    assert "tls/127.0.0.1" in rover.by("vic", "status").out


def test_the_end_of_certificates_is_in_the_log(rover: Rover) -> None:
    """Certificates of 20 days have a reminder at once, and then each day."""
    log = (rover.run_dir / "logs" / "up.log").read_text(encoding="utf-8")
    assert log.count("Renew it with `skillwing keys add-robot rover --skillset ") == 1


TURN = """<root BTCPP_format="4" main_tree_to_execute="spin">
  <BehaviorTree ID="spin"><turn heading="0.1"/></BehaviorTree>
</root>"""


def test_a_mission_from_the_ground_names_the_end_of_the_own_certificate(rover: Rover, tmp_path: Path) -> None:
    file = tmp_path / "spin.xml"
    file.write_text(TURN, encoding="utf-8")
    for name, warned in (("dan", True), ("alice", False)):
        said = rover.by(name, "mission", "run", str(file))
        assert said.code == 0, said.error
        assert (f"Your certificate `{name}` ends on" in said.error) == warned


def test_a_viewer_reads_and_is_told_what_it_may_not(rover: Rover) -> None:
    assert rover.by("vic", "resources").code == 0
    assert rover.by("vic", "ready", "turn").code in (0, 1)
    denied = rover.by("vic", "start", "turn", "heading=0.1")
    assert denied.code == 4
    assert denied.error.strip() == "`vic` is a viewer and may not start skills. Ask for a certificate of role client."
    extern = rover.by("alice", "trigger", "carousel", "FULL")
    assert extern.code == 4
    assert "Ask for a certificate of role operator." in extern.error
    assert rover.by("olga", "trigger", "carousel", "FULL").code == 0
    assert rover.by("olga", "trigger", "carousel", "ROOM").code == 0


def test_a_role_that_is_not_that_of_the_certificate_is_told(rover: Rover) -> None:
    """The router knows the present role. The certificate says an earlier one, or the role of a process."""
    words = (("start", "turn", "heading=0.1"), ("trigger", "carousel", "FULL"), ("mission", "abort"))
    deeds = (("start skills", "client"), ("change resources", "operator"), ("abort missions", "client"))
    for (deed, role), each in zip(deeds, words, strict=True):
        denied = rover.by("ann-before", *each)
        assert denied.code == 4, (each, denied.error)
        assert denied.error.strip() == f"`ann` is a viewer and may not {deed}. Ask for a certificate of role {role}."
    assert rover.by("ann-before", "resources").code == 0
    copied = rover.by("skill.turn", "trigger", "carousel", "FULL")
    assert copied.code == 4, copied.error
    assert "`rover.skill.turn` is a skill manager and may not change resources." in copied.error


def test_somebody_without_keys_is_told_what_is_missing(rover: Rover) -> None:
    unknown = rover.by("", "resources")
    assert unknown.code == 2
    assert "asks for a key" in unknown.error
    assert "SKILLWING_KEYS=FOLDER" in unknown.error


def test_killed_managers_and_a_killed_router_come_back(rover: Rover) -> None:
    for process in ("skill/turn", "resource_manager", "router"):
        endpoint = rover.state.endpoint
        rover.kill(process)
        assert rover.state.endpoint == endpoint
        done = rover.by("alice", "start", "turn", "heading=0.1", "--follow")
        assert done.code == 0, (process, done.out, done.error)


def test_the_loss_of_a_killed_manager_names_its_exit_as_its_cause(rover: Rover) -> None:
    """The launcher writes under its own name, and the router lets nobody else tell of exits."""
    assert rover.by("olga", "script", "turn", "forever=true").code == 0
    assert rover.by("alice", "start", "turn", "heading=0.1").code == 0
    until(lambda: "RUNNING" in rover.by("vic", "status").out, "the goal")
    rover.kill("skill/turn")

    def lost() -> Record | None:
        by_manager = (each for each in read_records(rover.run_dir) if each.source == RESOURCE_MANAGER)
        return next((each for each in by_manager if each.after == Ending.LOST), None)

    record = until(lost, "the loss of the goal")
    cause, effect = History.of(read_records(rover.run_dir)).chain(record.id)
    assert (headline(cause), cause.source, headline(effect)) == ("skill/turn KILLED", "launcher", "turn LOST")


def test_doctor_finds_a_healthy_rover_for_everybody(rover: Rover) -> None:
    for name in ("olga", "vic"):
        found = rover.by(name, "doctor", "--json").json
        assert [finding for finding in found["findings"] if finding["serious"]] == []
    missing = rover.by("", "doctor", "--json").json["findings"]
    assert [finding["about"] for finding in missing if finding["serious"]][:1] == ["not_known"]


def test_a_name_is_taken_back_and_another_one_is_let_in(rover: Rover, skillwing: Command, tmp_path: Path) -> None:
    kept = tmp_path / "bob"
    kept.mkdir()
    for file in (rover.keys / "people" / "bob").iterdir():
        (kept / file.name).write_bytes(file.read_bytes())
    assert skillwing("keys", "remove", "bob", "--keys", str(rover.keys)).code == 0
    assert skillwing("keys", "add", "carol", "--role", "viewer", "--keys", str(rover.keys)).code == 0
    rover.kill("router")
    (rover.keys / "people" / "bob").mkdir()
    for file in kept.iterdir():
        (rover.keys / "people" / "bob" / file.name).write_bytes(file.read_bytes())
    refused = rover.by("bob", "resources")
    assert refused.code == 4
    assert "You are not known at tls/127.0.0.1" in refused.error
    assert "does not know your name" in refused.error
    assert rover.by("carol", "resources").code == 0
    assert "bob" not in skillwing("keys", "list", "--json", "--keys", str(rover.keys)).out
    again = skillwing("keys", "add", "bob", "--role", "client", "--keys", str(rover.keys))
    assert again.code == 2
    assert "Choose another name, such as `bob2`." in again.error


def test_keys_that_are_made_again_name_the_earlier_ones(rover: Rover, skillwing: Command) -> None:
    again = skillwing("keys", "add", "vic", "--role", "viewer", "--keys", str(rover.keys))
    assert again.code == 0
    assert "Earlier keys of `vic` stay valid" in again.error
    assert rover.by("vic", "resources").code == 0


def test_the_plain_client_knows_the_rules(rover: Rover) -> None:
    inputs = '{"target": {"x": 1, "y": 2, "heading": 0}}'
    words = [rover.state.endpoint, "rover", "rover", load(ROVER).schema_hash, "drive_to", inputs]
    # A router that was just started again leaves data stale for a moment.
    until(lambda: rover.by("alice", "ready", "drive_to").code == 0, "fresh data")
    for name, code in (("alice", 0), ("vic", 2)):
        keys = str(rover.keys / "people" / name)
        client = [sys.executable, str(ROVER.parents[1] / "plain_client" / "client.py"), *words]
        done = subprocess.run(
            client, env={**os.environ, "SKILLWING_KEYS": keys}, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == code, done.stderr
        assert code == 0 or "Nobody answers on `rover/skill/drive_to/start`" in done.stderr


def test_an_address_that_strangers_reach_is_refused_without_keys(skillwing: Command) -> None:
    for words in (("mock", str(ROVER)), ("up", "--robot", "m600-mocks"), ("router",)):
        refused = skillwing(*words, "--listen", "tcp/0.0.0.0:0")
        assert refused.code == 2
        assert "Give --keys DIR (docs/keys.md), or --insecure." in refused.error


def test_a_mesh_is_refused_with_keys(skillwing: Command, rover: Rover) -> None:
    refused = skillwing("mock", str(ROVER), "--keys", str(rover.keys), "--topology", "mesh", "--robot-name", "other")
    assert refused.code == 2
    assert "Peers of a mesh" in refused.error


def test_rules_are_written_for_a_router_of_ones_own(skillwing: Command, rover: Rover, tmp_path: Path) -> None:
    file = tmp_path / "rules.json5"
    assert skillwing("access-control", str(file), "--keys", str(rover.keys)).code == 0
    assert '"default_permission": "deny"' in file.read_text(encoding="utf-8")


def test_without_a_router_the_words_stay(skillwing: Command, rover: Rover, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SKILLWING_CONNECT", "tls/127.0.0.1:1")
    monkeypatch.setenv("SKILLWING_KEYS", str(rover.keys / "people" / "alice"))
    absent = skillwing("resources", "--robot", "m600")
    assert absent.code == 3
    assert "No router answers at tls/127.0.0.1:1" in absent.error
