"""A recorder in a container: a directory for each flight, also when it dies in between, and reports from elsewhere."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services import robot as robots
from skillwing.services.processes import node_host
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_CRASHED, EXIT_OK
from skillwing.services.recording.container_recorder import MARK, RUNS, begin_or_go_on, main
from skillwing.services.recording.run_facts import RunFacts, read_facts, write_facts
from skillwing.services.robot import Robot

NOW = datetime(2026, 11, 21, 23, 11, 17, tzinfo=UTC)


@pytest.fixture
def container(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """Directory and environment of a container's process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SKILLWING_ROBOT", ROBOT.name)
    monkeypatch.setenv("SKILLWING_RUN_DIR", "")
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    yield monkeypatch
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_one_that_died_goes_on_in_its_own_directory(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    first = begin_or_go_on(tmp_path, mark, NOW)
    assert first == tmp_path / "20261121-231117-up"
    assert begin_or_go_on(tmp_path, mark, NOW + timedelta(minutes=1)) == first


def test_a_recorder_that_died_while_writing_its_name_restarts(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    mark.touch()
    assert begin_or_go_on(tmp_path, mark, NOW) == tmp_path / "20261121-231117-up"
    assert begin_or_go_on(tmp_path, mark, NOW + timedelta(minutes=1)) == tmp_path / "20261121-231117-up"


@pytest.mark.parametrize(("code", "goes_on"), [(EXIT_OK, False), (EXIT_CRASHED, True)])
def test_only_a_stopped_recording_is_over(container: pytest.MonkeyPatch, code: int, goes_on: bool) -> None:
    def host(_arguments: list[str]) -> int:
        return code

    container.setattr(node_host, "main", host)
    assert main(["--process", "recorder"]) == code
    assert MARK.exists() is goes_on


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_stop_before_the_recording_ends_it(container: pytest.MonkeyPatch, number: int) -> None:
    """The next flight is another one, also if this one had died before."""

    def find(_name: str) -> Robot:
        signal.raise_signal(number)
        return ROBOT

    container.setattr(robots, "find_robot", find)
    MARK.write_text("20261121-231117-up")
    assert main(["--process", "recorder"]) == EXIT_OK
    assert not MARK.exists()


def test_few_modules_are_imported_before_it_can_be_stopped() -> None:
    code = "import sys; import skillwing.services.recording.container_recorder; print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    early = {"zenoh", "msgspec", "skillwing.dsl"} & set(modules)
    assert early == set(), "Import these within the functions of container_recorder.py that need them."


@pytest.mark.parametrize("value", [None, ""])
def test_where_no_robot_is_named_nothing_begins(
    container: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], value: str | None
) -> None:
    container.delenv("SKILLWING_ROBOT") if value is None else container.setenv("SKILLWING_ROBOT", value)
    assert main(["--process", "recorder"]) == EXIT_CONFIGURATION
    assert "No robot is named." in capsys.readouterr().err
    assert not MARK.exists()


def test_the_robot_of_the_command_line_counts_as_it_does_for_the_host(container: pytest.MonkeyPatch) -> None:
    container.delenv("SKILLWING_ROBOT")
    container.setattr(node_host, "main", lambda _arguments: EXIT_OK)
    assert main(["--process", "recorder", "--robot", ROBOT.name]) == EXIT_OK
    (run,) = RUNS.iterdir()
    assert read_facts(run).robot == ROBOT.name


def test_a_run_tells_what_was_run(container: pytest.MonkeyPatch) -> None:
    seen: list[Path] = []

    def host(_arguments: list[str]) -> int:
        seen.extend(RUNS.iterdir())
        return EXIT_OK

    container.setattr(node_host, "main", host)
    container.setenv("SKILLWING_WORLD", "inspection")
    container.setenv("SKILLWING_SEED", "3")
    assert main(["--process", "recorder"]) == EXIT_OK
    (run,) = seen
    facts = read_facts(run)
    assert (facts.robot, facts.judge) == (ROBOT.name, ROBOT.judge)
    assert facts.schema == ROBOT.load_skillset().schema_hash
    assert facts.options["world"] == "inspection" and facts.options["seed"] == 3


def test_a_meaningless_value_is_reported_in_a_sentence(
    container: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    container.setenv("SKILLWING_SEED", "x")
    assert main(["--process", "recorder"]) == EXIT_CONFIGURATION
    assert "SKILLWING_SEED is `x`" in capsys.readouterr().err


def test_a_run_from_another_machine_is_read_with_the_skillset_that_is_here(tmp_path: Path) -> None:
    write_facts(tmp_path, RunFacts(robot=ROBOT.name, skillset="/in/a/container/m600.skillset"))
    assert read_facts(tmp_path).skillset == str(ROBOT.skillset)
    write_facts(tmp_path, RunFacts(robot="unheard-of", skillset="/in/a/container/other.skillset"))
    assert read_facts(tmp_path).skillset == "/in/a/container/other.skillset"
