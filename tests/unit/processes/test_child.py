"""Messages about a process that died too often."""

from __future__ import annotations

import threading
from errno import ENOMEM
from pathlib import Path

import pytest

from skillwing.services.processes import launcher as launcher_module
from skillwing.services.processes.child import Child, ProcessExit
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.restart_policy import EXITS_IN_A_ROW


def given_up(log: Path) -> ProcessExit:
    child = Child("skill/refill", ["refill"], log, restart="always")

    def die() -> ProcessExit:
        child.start(0.0)
        child.process.wait()
        return child.exited(0.0)

    *_, last = (die() for _ in range(EXITS_IN_A_ROW))
    child.kill()
    assert last.final
    return last


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import sys\ncount = (1,\n", "SyntaxError: '(' was never closed ({file}:2)"),
        ("def fill():\n    raise ValueError('dry')\n\nfill()\n", "ValueError: dry ({file}:2)"),
        ("import sys\nsys.exit('no water')\n", "no water;"),
    ],
)
def test_its_last_words_name_the_line_and_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, words: str
) -> None:
    file = tmp_path / "refill.py"
    file.write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    log = tmp_path / "logs" / "refill.log"
    outlook = given_up(log).outlook
    assert f"its last log line: {words.format(file=file)}" in outlook
    assert outlook.endswith(f"Its log: {log}")


@pytest.mark.parametrize("talks", [False, True])
def test_a_router_that_is_ended_again_and_again_comes_back(tmp_path: Path, talks: bool) -> None:
    """The router is ended after each new name. A node that ends by itself would never stop doing so."""
    child = Child("any", ["this"], tmp_path / "log", restart="always", talks=talks)

    def end() -> ProcessExit:
        child.start(0.0)
        child.process.wait()
        return child.exited(0.0)

    *_, last = (end() for _ in range(EXITS_IN_A_ROW))
    child.kill()
    assert last.final == talks


def test_a_full_disk_keeps_nobody_from_being_started_again() -> None:
    """A file on which nothing fits, as the log."""
    child = Child("skill/refill", ["this"], Path("/dev/full"), restart="always")
    child.start(0.0)
    child.process.wait()
    child.start(1.0)
    assert child.state().restarts == 1
    child.kill()


def test_it_keeps_to_one_core_for_its_matrices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "import os\nprint(*(os.environ[name] for name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS')))\n"
    (tmp_path / "refill.py").write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    child = Child("skill/refill", ["refill"], tmp_path / "log", restart="never")
    child.start(0.0)
    child.process.wait()
    child.kill()
    assert (tmp_path / "log").read_text(encoding="utf-8") == "1 1\n"


def test_a_long_log_is_moved_aside_and_the_process_goes_on_in_the_same_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("skillwing.services.processes.child.LOG_BYTES", 10)
    log = tmp_path / "x.log"
    child = Child("x", ["none"], log, restart="never")
    child.shorten_log()
    with log.open("ab", buffering=0) as file:
        file.write(b"short")
        child.shorten_log()
        assert log.read_bytes() == b"short"
        file.write(b" and long")
        child.shorten_log()
        file.write(b"again")
    assert log.read_bytes() == b"again"
    assert (tmp_path / "x.log.1").read_bytes() == b"short and long"


def test_the_exit_by_a_signal_without_a_name_has_a_sentence() -> None:
    assert str(ProcessExit("skill/refill", 7, None, 40, ())) == "skill/refill was killed by signal 40."


def test_a_process_for_which_the_machine_has_no_room_is_started_again_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launcher_module, "LONGEST_PAUSE", 0.01)
    seen: list[str] = []
    launcher = Launcher(
        "tank", "tank", tmp_path, restarts=True, on_change=lambda: seen.append(child.state().last_words)
    )
    child = Child("skill/refill", ["this"], tmp_path / "refill.log", restart="always")
    child.start(0.0)
    begin, again, tries = child.start, threading.Event(), list[float]()

    def start(now: float) -> None:
        tries.append(now)
        if len(tries) == 1:
            raise OSError(ENOMEM, "Cannot allocate memory")
        begin(now)
        again.set()

    monkeypatch.setattr(child, "start", start)
    launcher._watch(child)
    (watch,) = [thread for thread in threading.enumerate() if thread.name == "watch skill/refill"]
    started_again = again.wait(60.0)
    launcher.stop()
    watch.join(60.0)
    child.kill()
    assert started_again
    assert [words for words in seen if "cannot be started now: Cannot allocate memory." in words]
