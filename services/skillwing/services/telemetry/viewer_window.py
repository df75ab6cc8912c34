"""A Rerun viewer in a window of its own, as a child of the process that opens it."""

from __future__ import annotations

import importlib.util
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Self

START_TIMEOUT = 15.0
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
    Opening one that does not come up is no error: `is_open` then tells.
    """

    def __init__(self, log: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = int(probe.getsockname()[1])
        self._log = log
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def url(self) -> str:
        return f"rerun+http://127.0.0.1:{self._port}/proxy"

    @property
    def is_open(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def __enter__(self) -> Self:
        program = _program()
        if program is None:
            return self
        arguments = ["--bind", "127.0.0.1", "--port", str(self._port), "--memory-limit", MEMORY_LIMIT]
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                [program, *arguments, "--hide-welcome-screen"],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        deadline = time.monotonic() + START_TIMEOUT
        while self.is_open and time.monotonic() < deadline and not self._answers():
            time.sleep(0.1)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        process = self._process
        if process is None:
            return
        process.terminate()
        try:
            process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def wait_until_closed(self) -> None:
        """Return when the user has closed the window."""
        if self._process is not None:
            self._process.wait()

    def _answers(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self._port), 0.2).close()
        except OSError:
            return False
        return True


def _program() -> str | None:
    """The viewer's own program inside the installed package; None without one."""
    package = importlib.util.find_spec("rerun_cli")
    if package is None or not package.submodule_search_locations:
        return None
    program = Path(package.submodule_search_locations[0]) / ("rerun.exe" if sys.platform == "win32" else "rerun")
    return str(program) if program.exists() else None
