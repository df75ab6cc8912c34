"""A Rerun viewer in a window of its own, as a child of the process that opens it.

    python -m skillwing.services.telemetry.viewer_window PROGRAM ARGUMENT ...

runs the viewer for as long as its own standard input is open. It stands between the two because nobody can tell the
viewer that the process which opened it was killed.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from skillwing.services.processes.lifetime import EXIT_OK, Lifetime

START_TIMEOUT = 15.0
TRIAL = 1.5
"""Seconds after its first answer in which a viewer that cannot open its window ends."""
STOP_TIMEOUT = 3.0
MEMORY_LIMIT = "2GB"


def has_screen() -> bool:
    """A window can be opened here."""
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


class ViewerWindow:
    """The viewer's process; `url` is where recordings are sent. It ends with this object, or when it is closed.

    The viewer's own program is started, not the `rerun` script around it, which would leave it behind when killed.
    Opening one that does not come up is no error: `is_open` then tells, and its log says why.
    """

    def __init__(self, log: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = int(probe.getsockname()[1])
        self.log = log
        self._process: subprocess.Popen[bytes] | None = None
        self._answered = False

    @property
    def url(self) -> str:
        return f"rerun+http://127.0.0.1:{self._port}/proxy"

    @property
    def is_open(self) -> bool:
        return self._answered and self._runs()

    def __enter__(self) -> Self:
        program = _program()
        if program is None:
            return self
        options = ["--bind", "127.0.0.1", "--port", str(self._port), "--memory-limit", MEMORY_LIMIT]
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, program, *options, "--hide-welcome-screen"],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        try:
            self._wait_for_answer(time.monotonic() + START_TIMEOUT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(TRIAL)
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def wait_until_closed(self) -> None:
        """Return when the user has closed the window."""
        if self._process is not None:
            self._process.wait()

    def _runs(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def _wait_for_answer(self, deadline: float) -> None:
        while self._runs() and time.monotonic() < deadline and not self._answered:
            try:
                socket.create_connection(("127.0.0.1", self._port), 0.2).close()
                self._answered = True
            except OSError:
                time.sleep(0.1)

    def _end(self) -> None:
        process = self._process
        if process is None:
            return
        assert process.stdin is not None
        process.stdin.close()
        try:
            process.wait(2 * STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        finally:
            # Its session is the viewer's too, and the viewer may have outlived it.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def _program() -> str | None:
    """The viewer's own program inside the installed package; None without one."""
    package = importlib.util.find_spec("rerun_cli")
    if package is None or not package.submodule_search_locations:
        return None
    program = Path(package.submodule_search_locations[0]) / ("rerun.exe" if sys.platform == "win32" else "rerun")
    return str(program) if program.exists() else None


def main(command: list[str]) -> int:
    """Run `command` until it ends, or until standard input does."""
    lifetime = Lifetime(parent_pipe=True)
    viewer = subprocess.Popen(command, stdin=subprocess.DEVNULL)

    def follow() -> None:
        viewer.wait()
        lifetime.end()

    threading.Thread(target=follow, name="viewer", daemon=True).start()
    lifetime.wait()
    viewer.terminate()
    try:
        viewer.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        viewer.kill()
        viewer.wait()
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
