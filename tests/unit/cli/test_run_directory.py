"""Directories of runs: each run has one of its own, and those that cannot be used get a sentence."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.robots import robot_access
from skillwing.services.errors import InvalidOptionError
from skillwing.services.robot import find_robot
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import USAGE
from skillwing.services.terminal.run_directory import claimed, make_run_dir


def test_runs_that_begin_in_one_second_have_directories_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _: make_run_dir(None, "mock"), range(40)))
    assert len(set(made)) == 40
    assert all(path.is_dir() and path.parent == tmp_path / "runs" for path in made)
    assert any(path.name.endswith("-mock-2") for path in made)


def test_a_directory_in_which_a_system_runs_is_refused_until_that_ends(tmp_path: Path) -> None:
    assert make_run_dir(tmp_path / "run", "up") == make_run_dir(tmp_path / "run", "up")
    with (
        claimed(tmp_path / "run"),
        pytest.raises(InvalidOptionError, match="already"),
        claimed(tmp_path / "run"),
    ):
        pass
    with claimed(tmp_path / "run"):
        pass


def test_up_refuses_the_directory_of_a_system_that_runs_and_moves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    journal = tmp_path / "journal.sqlite"
    journal.touch()
    with claimed(tmp_path):
        assert "already" in refusal(["up", "--mock", "--run-dir", str(tmp_path)], tmp_path, monkeypatch, capsys)
    assert journal.exists()


def refusal(
    words: list[str], runtime: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> str:
    """The text of a command that must be refused for a wrong option."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    monkeypatch.setattr("sys.argv", ["skillwing", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    return capsys.readouterr().err


@pytest.mark.parametrize("command", ["up", "demo"])
def test_a_run_directory_without_a_name_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert "without a name" in refusal([command, "--run-dir", ""], tmp_path, monkeypatch, capsys)


def test_a_directory_that_cannot_be_made_is_refused_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    for folder in ("/proc/nope", str(tmp_path / "file"), str(tmp_path / "file" / "run")):
        said = refusal(["up", "--mock", "--run-dir", folder], tmp_path, monkeypatch, capsys)
        assert "cannot be made: " in said
        assert "free" not in said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["router", "--listen", "rubbish"], "`rubbish`, given by `listen`, is no address of a router."),
        (["router", "--keys", "nokeys"], "nokeys holds no keys of a site."),
        (["up", "--mock", "--listen", "rubbish"], "`rubbish`, given by `listen`, is no address of a router."),
        (["up", "--mock", "--listen", "tls/127.0.0.1:0", "--keys", "nokeys"], "There is no folder nokeys."),
        (["up", "--mock", "--keys", "keys"], "key.pem cannot be read: The file is empty."),
        (["up", "--mock", "--detach", "--keys", "keys"], "key.pem cannot be read: The file is empty."),
    ],
)
def test_a_wrong_address_or_key_is_refused_before_anything_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    store = KeyStore.init(tmp_path / "keys", [])
    store.add_robot(robot_access(find_robot("m600")))
    (store.router_folder / "key.pem").write_bytes(b"")
    assert sentence in refusal(words, tmp_path / "runtime", monkeypatch, capsys)
    assert not (tmp_path / "runs").exists()
