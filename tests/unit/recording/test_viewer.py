"""The viewer's process, with a stand-in for the viewer that listens and has no window."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import psutil
import pytest

from skillwing.services.viewer.viewer import PAGE_PORT, Viewer, free_port

PATIENCE = 20.0
LISTEN = """
import socket, sys
ports = [sys.argv[at + 1] for at, word in enumerate(sys.argv) if word in ("--port", "--web-viewer-port")]
first, *others = [socket.create_server(("127.0.0.1", int(port))) for port in ports]
while True:
    first.accept()
"""
OPEN = """
import sys, threading
from pathlib import Path
from skillwing.services.viewer import viewer
viewer.find_program = lambda: sys.argv[1]
with viewer.Viewer("native", Path(sys.argv[2])) as window:
    print(window.is_open, flush=True)
    threading.Event().wait()
"""


def program(directory: Path, code: str) -> str:
    path = directory / "viewer"
    path.write_text(f"#!{sys.executable}\n{code}", encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def processes_of(path: str) -> list[psutil.Process]:
    return [each for each in psutil.process_iter(["cmdline"]) if path in (each.info["cmdline"] or ())]


def test_a_viewer_ends_with_its_window(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = program(tmp_path, LISTEN)
    monkeypatch.setattr(f"{Viewer.__module__}.find_program", lambda: path)
    with Viewer("native", tmp_path / "viewer.log") as window:
        assert window.is_open
        assert len(processes_of(path)) == 2
    assert not window.is_open
    assert processes_of(path) == []


@pytest.mark.parametrize("before", ["import sys", LISTEN.replace("while True:\n    ", "")], ids=["at once", "later"])
def test_a_viewer_that_cannot_open_a_window_is_not_open_and_its_log_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, before: str
) -> None:
    """The real one listens before it looks for a screen."""
    path = program(tmp_path, f"{before}\nsys.exit('no display')")
    monkeypatch.setattr(f"{Viewer.__module__}.find_program", lambda: path)
    with Viewer("native", tmp_path / "viewer.log") as window:
        assert not window.is_open
    assert "no display" in window.log.read_text(encoding="utf-8")


def test_a_viewer_that_its_user_closes_ends_the_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = program(tmp_path, LISTEN)
    monkeypatch.setattr(f"{Viewer.__module__}.find_program", lambda: path)
    with Viewer("native", tmp_path / "viewer.log") as window:
        viewer = max(processes_of(path), key=lambda each: each.create_time())
        viewer.terminate()
        window.wait_until_closed()
        assert not window.is_open


def test_a_viewer_does_not_outlive_its_opener(tmp_path: Path) -> None:
    path = program(tmp_path, LISTEN)
    command = [sys.executable, "-c", OPEN, path, str(tmp_path / "viewer.log")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as opener:
        assert opener.stdout is not None
        assert opener.stdout.readline() == "True\n"
        viewers = [each for each in processes_of(path) if each.pid != opener.pid]
        assert len(viewers) == 2
        opener.kill()
        assert psutil.wait_procs(viewers, timeout=PATIENCE)[1] == []


def test_for_a_browser_it_serves_a_page_on_loopback_that_knows_where_the_run_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = program(tmp_path, LISTEN)
    monkeypatch.setattr(f"{Viewer.__module__}.find_program", lambda: path)
    with Viewer("web", tmp_path / "viewer.log") as viewer:
        assert viewer.is_open
        page = urlsplit(viewer.page or "")
        assert page.hostname == "127.0.0.1"
        assert parse_qs(page.query)["url"] == [viewer.url]
        viewers = processes_of(path)
        heard = {each.laddr for process in viewers for each in process.net_connections() if each.status == "LISTEN"}
        assert {place.ip for place in heard} == {"127.0.0.1"}
        assert {place.port for place in heard} == {page.port, urlsplit(viewer.url).port}
    assert processes_of(path) == []


def test_a_port_that_is_taken_is_left_to_who_has_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert free_port(port) not in (0, port)
    assert free_port(port) == port
    assert free_port(PAGE_PORT) != 0


def test_without_rerun_its_log_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{Viewer.__module__}.find_program", lambda: None)
    with Viewer("web", tmp_path / "viewer.log") as viewer:
        assert not viewer.is_open
    assert "pip install 'skillwing[viewer]'" in (tmp_path / "viewer.log").read_text(encoding="utf-8")
