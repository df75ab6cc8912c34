"""A recorder in a container: a directory for each flight, also when it dies in between, and reports from elsewhere."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_CRASHED, EXIT_OK
from skillwing.services.telemetry import recorded_life
from skillwing.services.telemetry.recorded_life import MARK, RUNS, begin_or_go_on, main
from skillwing.services.telemetry.run_facts import RunFacts, read_facts, write_facts

NOW = datetime(2026, 11, 21, 23, 11, 17, tzinfo=UTC)


@pytest.fixture
def container(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """What a container gives to its process: a directory, and the environment."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SKILLWING_ROBOT", ROBOT.name)
    monkeypatch.setenv("SKILLWING_RUN_DIR", "")
    return monkeypatch


def test_one_that_died_goes_on_in_its_own_directory(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    first = begin_or_go_on(tmp_path, mark, NOW)
    assert first == tmp_path / "20261121-231117-up"
    assert begin_or_go_on(tmp_path, mark, NOW + timedelta(minutes=1)) == first


def test_one_that_died_while_it_wrote_the_name_begins_anew(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    mark.touch()
    assert begin_or_go_on(tmp_path, mark, NOW) == tmp_path / "20261121-231117-up"
    assert begin_or_go_on(tmp_path, mark, NOW + timedelta(minutes=1)) == tmp_path / "20261121-231117-up"


@pytest.mark.parametrize(("code", "goes_on"), [(EXIT_OK, False), (EXIT_CRASHED, True)])
def test_only_what_was_told_to_end_is_over(container: pytest.MonkeyPatch, code: int, goes_on: bool) -> None:
    def host(_arguments: list[str]) -> int:
        return code

    container.setattr(recorded_life, "host", host)
    assert main(["--process", "recorder"]) == code
    assert MARK.exists() is goes_on


def test_a_run_tells_what_was_run(container: pytest.MonkeyPatch) -> None:
    seen: list[Path] = []

    def host(_arguments: list[str]) -> int:
        seen.extend(RUNS.iterdir())
        return EXIT_OK

    container.setattr(recorded_life, "host", host)
    container.setenv("SKILLWING_WORLD", "inspection")
    container.setenv("SKILLWING_SEED", "3")
    assert main(["--process", "recorder"]) == EXIT_OK
    (run,) = seen
    facts = read_facts(run)
    assert (facts.robot, facts.judge) == (ROBOT.name, ROBOT.judge)
    assert facts.options["world"] == "inspection" and facts.options["seed"] == 3


def test_a_value_that_means_nothing_is_told_in_a_sentence(
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
