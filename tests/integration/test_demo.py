"""The demo as its users start it, with real processes, and what can go wrong with it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from skillwing.services.history.files import TIMELINE_FILE
from skillwing.services.history.report import read_report
from skillwing.services.terminal import cli
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, USAGE

PATIENCE = 30.0
DEMO = (sys.executable, "-m", "skillwing.services.terminal.cli", "demo", "--no-viewer")
COLOCATED = pytest.mark.parametrize("demo", [("--colocate",)], indirect=True, ids=["colocated"])


class Demo:
    """A demo in a runtime directory of its own, by which all of its processes are known."""

    def __init__(self, directory: Path, *layout: str) -> None:
        self.run_dir = directory / "run"
        self.said: list[str] = []
        self._mark = str(directory / "runtime")
        self.process = subprocess.Popen(
            [
                *(sys.executable, "-m", "skillwing.services.terminal.cli", "demo", "--no-viewer"),
                *layout,
                "--run-dir",
                self.run_dir,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, "XDG_RUNTIME_DIR": self._mark},
            text=True,
        )

    def until(self, text: str) -> None:
        """Read what the demo prints up to a line with `text`."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(line)
            if text in line:
                return
        pytest.fail(f"the demo ended without saying `{text}`:\n{''.join(self.said)}")

    def end(self) -> int:
        """Read what it still prints; returns its exit code."""
        out, _ = self.process.communicate(timeout=2 * PATIENCE)
        self.said.append(out)
        assert "Traceback" not in self.output
        return self.process.returncode

    @property
    def output(self) -> str:
        return "".join(self.said)

    def processes(self) -> list[psutil.Process]:
        """All that live of the demo and what it started."""
        return [process for process in psutil.process_iter() if self._is_ours(process)]

    def child(self, name: str) -> psutil.Process:
        return next(each for each in self.processes() if name in each.cmdline() and "--alive" in each.cmdline())

    def _is_ours(self, process: psutil.Process) -> bool:
        with contextlib.suppress(psutil.Error):
            return process.environ().get("XDG_RUNTIME_DIR") == self._mark
        return False


@pytest.fixture
def demo(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Demo]:
    """A process for each manager, or with COLOCATED one for most of them, which starts in half the time."""
    demo = Demo(tmp_path, *getattr(request, "param", ()))
    yield demo
    for process in demo.processes():
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
    demo.process.wait()
    if demo.process.stdout is not None:
        demo.process.stdout.close()


@pytest.mark.slow
def test_without_its_simulator_the_flight_ends_and_the_report_says_why(demo: Demo) -> None:
    demo.until("mapping RUNNING")
    demo.child("sim").kill()
    assert demo.end() == FAILED
    assert demo.processes() == []
    assert "sim was killed by SIGKILL. It is not started again" in demo.output
    report = read_report(demo.run_dir)
    assert report.result != "success"
    assert [entry.name for entry in report.processes if entry.state == "died"] == ["sim"]
    assert "**sim was killed by SIGKILL. It is not" in (demo.run_dir / "report.md").read_text(encoding="utf-8")


@pytest.mark.slow
@COLOCATED
def test_called_off_while_it_starts_it_leaves_a_report_and_no_process(demo: Demo) -> None:
    demo.until("Starting")
    demo.process.send_signal(signal.SIGINT)
    assert demo.end() == INTERRUPTED
    assert demo.processes() == []
    assert "Called off by Ctrl-C or a signal." in demo.output
    report = read_report(demo.run_dir)
    assert report.result == "unfinished"
    assert {entry.state for entry in report.processes} <= {"stopped", "not started"}


@pytest.mark.slow
@COLOCATED
def test_a_reader_who_leaves_ends_the_flight(demo: Demo) -> None:
    demo.until("Starting")
    assert demo.process.stdout is not None
    demo.process.stdout.close()
    assert demo.process.wait(2 * PATIENCE) == FAILED
    assert demo.processes() == []
    assert "the output pipe is closed" in (demo.run_dir / "report.md").read_text(encoding="utf-8")


@pytest.mark.slow
@COLOCATED
def test_when_it_is_killed_all_of_its_processes_end(demo: Demo) -> None:
    demo.until("mapping RUNNING")
    processes = demo.processes()
    assert len(processes) > 10
    demo.process.kill()
    assert psutil.wait_procs(processes, timeout=PATIENCE)[1] == []
    assert demo.processes() == []


# --- what it refuses -------------------------------------------------------------------------------------------------


def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Error output of a demo with wrong arguments."""
    monkeypatch.setattr("sys.argv", ["skillwing", "demo", "--no-viewer", *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == USAGE
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--seed", "-1"),
        ("--seed", "4294967296"),
        ("--seed", "one"),
        ("--speed", "0.01"),
        ("--speed", "inf"),
        ("--speed", "nan"),
        ("--fault-at", "-1"),
        ("--fault-at", "inf"),
    ],
)
def test_a_number_out_of_range_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], option: str, value: str
) -> None:
    assert option in refused(monkeypatch, capsys, option, value)


def test_a_viewer_and_none_contradict(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert "Leave one of them out" in refused(monkeypatch, capsys, "--viewer", "web")


def test_a_directory_that_cannot_hold_the_run_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    blocked = tmp_path / "file"
    blocked.touch()
    assert "Nothing can be written" in refused(monkeypatch, capsys, "--run-dir", str(blocked / "run"))


def test_a_run_is_not_written_over_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    (tmp_path / TIMELINE_FILE).touch()
    assert "holds a run already" in refused(monkeypatch, capsys, "--run-dir", str(tmp_path))
