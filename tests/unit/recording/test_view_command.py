"""`skillwing view`, with a stand-in for the viewer that records its arguments."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.services.commands import view as view_command
from skillwing.services.commands.view import recordings_of
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import OK
from skillwing.services.viewer.viewer import Viewer

LISTENS = """
import socket, sys, threading
from pathlib import Path
Path(__file__).with_name("asked").write_text("\\n".join(sys.argv[1:]))
ports = [int(sys.argv[at + 1]) for at, word in enumerate(sys.argv) if word in ("--port", "--web-viewer-port")]
doors = [socket.create_server(("127.0.0.1", port)) for port in ports]
threading.Event().wait()
"""
WITHOUT_SCREEN = "import sys\nsys.exit('no display')"


def viewer(monkeypatch: pytest.MonkeyPatch, folder: Path, code: str) -> None:
    path = folder / "viewer"
    path.write_text(f"#!{sys.executable}\n{code}", encoding="utf-8")
    path.chmod(0o755)
    monkeypatch.setattr("skillwing.services.viewer.viewer.find_program", lambda: str(path))
    for preferred in ("STREAM_PORT", "PAGE_PORT"):  # other tests prefer them at the same moment
        monkeypatch.setattr(f"skillwing.services.viewer.viewer.{preferred}", 0)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Folder of a run whose recorder was started again several times."""
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("recording", "recording-10", "recording-2"):
        (folder / f"{name}.rrd").touch()
    return folder


def test_recordings_come_in_the_order_in_which_they_were_made(run: Path) -> None:
    assert [each.name for each in recordings_of(run)] == ["recording.rrd", "recording-2.rrd", "recording-10.rrd"]
    assert recordings_of(run / "recording-2.rrd") == (run / "recording-2.rrd",)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("", r"holds no `recording\.rrd`. Name the directory"),
        ("viewer", r"holds no `recording\.rrd`. Name the directory"),
        ("missing", "There is no folder .*missing`. Name the directory"),
        ("other.rrd", r"There is no folder .*other\.rrd`. Name the directory"),
    ],
)
def test_what_was_not_recorded_is_refused(tmp_path: Path, name: str, sentence: str) -> None:
    (tmp_path / "viewer").touch()
    with pytest.raises(InvalidOptionError, match=sentence):
        recordings_of(tmp_path / name)


def closed(_window: Viewer) -> None:
    """Return at once, as if the user closed the viewer."""


def interrupted(_window: Viewer) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("end", [closed, interrupted])
def test_every_recording_is_shown_to_a_browser_with_its_address(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: Callable[[Viewer], None]
) -> None:
    viewer(monkeypatch, tmp_path, LISTENS)
    monkeypatch.setattr(Viewer, "wait_until_closed", end)
    shown = CliRunner().invoke(cli.app, ["view", str(run), "--viewer", "web"])
    assert shown.exit_code == OK
    asked = (tmp_path / "asked").read_text(encoding="utf-8").splitlines()
    assert asked[-3:] == [str(each) for each in recordings_of(run)]
    page = asked[asked.index("--web-viewer-port") + 1]
    assert f"http://127.0.0.1:{page}/?theme=dark&url=" in shown.stdout


def test_without_a_screen_a_browser_is_recommended(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    viewer(monkeypatch, tmp_path, WITHOUT_SCREEN)
    with pytest.raises(SkillwingError, match=r"`--viewer web` shows the run in a browser\. Its last line: no display"):
        view_command.view(run, "native")


def test_without_rerun_it_says_what_to_install(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("skillwing.services.viewer.viewer.find_program", lambda: None)
    with pytest.raises(InvalidOptionError, match="pip install"):
        view_command.view(run, "web")
