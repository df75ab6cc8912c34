from __future__ import annotations

import os
from pathlib import Path

import pytest
from msgspec.structs import replace

from skillwing.dsl import load
from skillwing.m600.robot import SKILLSET
from skillwing.services.client import target
from skillwing.services.client.connection import find_target, open_connection
from skillwing.services.errors import NoSystemError, SeveralSystemsError, SkillwingError
from skillwing.services.processes import run_state
from skillwing.services.processes.run_state import (
    Announcement,
    RunState,
    read_run_state,
    remove_run_state,
    reserved,
    running_systems,
    runtime_dir,
    started,
    write_run_state,
)
from skillwing.services.terminal.system_runner import require_not_running


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


@pytest.mark.parametrize("before", [None, state(pid_started="1")], ids=["nothing", "a stale file"])
def test_who_looks_while_a_system_comes_up_does_not_hide_it(
    before: RunState | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def comes_up_meanwhile(found: RunState | None) -> bool:
        write_run_state(state())
        return False

    if before is not None:
        write_run_state(before)
    with monkeypatch.context() as patched:
        patched.setattr(run_state, "_is_current", comes_up_meanwhile)
        assert read_run_state("m600") is None
    assert read_run_state("m600") == state()


def test_a_system_whose_file_is_gone_makes_itself_known_again() -> None:
    announcement = Announcement(state())
    remove_run_state("m600")
    announcement.update(())
    assert read_run_state("m600") == state()
    announcement.end()
    announcement.update(())
    assert read_run_state("m600") is None


def test_a_runtime_folder_that_is_gone_ends_no_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of a user may be removed after the last login session, while a system runs on."""
    announcement = Announcement(state())
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    announcement.update(())
    announcement.end()


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
    with pytest.raises(SeveralSystemsError, match=r'`--robot a` in a command, `connect\("a"\)` in a script'):
        find_target(None)
    assert find_target("b").robot == "b"
    with pytest.raises(NoSystemError, match="`c`"):
        find_target("c")


def test_a_system_that_runs_without_its_router_is_said_to_run() -> None:
    write_run_state(replace(state("right"), endpoint="tcp/127.0.0.1:1", skillset=str(SKILLSET)))
    with (
        pytest.raises(NoSystemError, match=rf"`right` runs \(process {os.getpid()}\), but its router does not answer"),
        open_connection(find_target("right"), client="cli"),
    ):
        pass


def test_a_typed_client_finds_its_own_robot_among_several(tmp_path: Path) -> None:
    hashes: dict[str, str] = {}
    for name in ("rover", "sprayer"):
        file = tmp_path / f"{name}.skillset"
        file.write_text(f"skillset {name} {{ skill go {{ result {{ success DONE }} }} }}", encoding="utf-8")
        hashes[name] = load(file).schema_hash
        write_run_state(replace(state(name), skillset=str(file)))
    write_run_state(replace(state("gone"), skillset=str(tmp_path / "gone.skillset")))
    assert find_target(schema=hashes["sprayer"]).robot == "sprayer"
    assert find_target("rover", schema=hashes["sprayer"]).robot == "rover"
    write_run_state(replace(state("sprayer2"), skillset=str(tmp_path / "sprayer.skillset")))
    with pytest.raises(NoSystemError, match=r'connect\("sprayer"\)'):
        find_target(schema=hashes["sprayer"])


def test_who_runs_already_is_named_with_what_stops_it() -> None:
    write_run_state(state("rover"))
    with pytest.raises(SkillwingError, match="`skillwing down --robot rover`, or take another name"):
        require_not_running("rover", ", or take another name")


def test_a_robot_is_run_by_one_process_at_a_time() -> None:
    with reserved("m600"):
        with pytest.raises(SkillwingError, match="`skillwing down --robot m600`"), reserved("m600"):
            pass
        with reserved("another"):
            pass
    with reserved("m600"):
        pass


def test_of_several_robots_at_a_router_a_generated_client_means_the_one_with_its_skillset(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    present = {"rover": "rover", "second": "m600"}
    monkeypatch.setattr(target, "find_robots", lambda endpoint, robot: present)
    monkeypatch.setattr(target, "_told_target", lambda *found: found)
    assert target.find_target_at("tcp/x:1", table="m600") == ("tcp/x:1", "second", "m600")
    present["third"] = "m600"
    with pytest.raises(SeveralSystemsError, match="are at tcp/x:1: `second` and `third`"):
        target.find_target_at("tcp/x:1", table="m600")
