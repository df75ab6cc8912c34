from __future__ import annotations

import os
from pathlib import Path

import pytest

from skillwing.services.client.connection import find_target
from skillwing.services.errors import NoSystemError, SkillwingError
from skillwing.services.processes.run_state import (
    RunState,
    read_run_state,
    remove_run_state,
    reserved,
    running_systems,
    runtime_dir,
    started,
    write_run_state,
)


@pytest.fixture(autouse=True)
def own_runtime_dir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)


def state(robot: str = "m600", pid: int | None = None, pid_started: str | None = None) -> RunState:
    return RunState(
        robot=robot,
        endpoint="tcp/127.0.0.1:1",
        skillset="m600.skillset",
        clock="wall",
        pid=pid or os.getpid(),
        pid_started=pid_started or started(os.getpid()) or "",
        run_dir="runs/x",
    )


def test_what_is_written_is_found_until_it_is_removed() -> None:
    assert read_run_state("m600") is None
    write_run_state(state())
    assert read_run_state("m600") == state()
    remove_run_state("m600")
    assert read_run_state("m600") is None
    remove_run_state("m600")


def test_the_directory_is_the_users_own() -> None:
    assert runtime_dir().stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("stale", [state(pid=2**22 + 1), state(pid_started="1")], ids=["no such process", "id reused"])
def test_a_stale_file_counts_for_nothing_and_is_removed(stale: RunState) -> None:
    write_run_state(stale)
    assert read_run_state("m600") is None
    assert list(runtime_dir().glob("*.json")) == []


def test_a_broken_file_counts_for_nothing() -> None:
    (runtime_dir() / "m600.json").write_text('{"robot": 5}', encoding="utf-8")
    assert read_run_state("m600") is None


def test_of_several_systems_one_has_to_be_chosen() -> None:
    with pytest.raises(NoSystemError, match="skillwing up"):
        find_target(None)
    write_run_state(state("a"))
    assert find_target(None).robot == "a"
    write_run_state(state("b"))
    assert [each.robot for each in running_systems()] == ["a", "b"]
    with pytest.raises(NoSystemError, match="--robot"):
        find_target(None)
    assert find_target("b").robot == "b"
    with pytest.raises(NoSystemError, match="`c`"):
        find_target("c")


def test_a_robot_is_run_by_one_process_at_a_time() -> None:
    with reserved("m600"):
        with pytest.raises(SkillwingError, match="runs already"), reserved("m600"):
            pass
        with reserved("another"):
            pass
    with reserved("m600"):
        pass
