"""A Rerun viewer, in a window of its own or for browsers, as a child of the process that opens it.

    python -m skillwing.services.viewer.viewer PROGRAM ARGUMENT ...

runs the viewer while its own standard input is open. This process in between is needed because the viewer cannot notice
that its opener was killed.
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
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Literal, Self, TypeAlias
from urllib.parse import quote

from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.lifetime import EXIT_OK, Lifetime

START_TIMEOUT = 15.0
TRIAL = 1.5
"""Seconds after its first answer in which a viewer without a window ends."""
STOP_TIMEOUT = 3.0
MEMORY_LIMIT = "2GB"
"""Memory of a window; it drops the oldest data first."""
SERVER_MEMORY_LIMIT = "1GB"
"""Memory for browsers that connect later."""
LOOPBACK = "127.0.0.1"
STREAM_PORT, PAGE_PORT = 9876, 9090
"""Rerun's default ports, for browsers, so that they can be forwarded to another machine. Others if they are taken."""
UNINSTALLED = "Rerun is not installed. Install it with: pip install 'skillwing[viewer]'.\n"

ViewerKind: TypeAlias = Literal["none", "native", "web"]


def has_screen() -> bool:
    """True on a machine where a window can open."""
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True


class Viewer:
    """The viewer's process. It ends with this object, or when its window is closed.

    shows: recordings to open; without them it waits for data. url: address for recordings. page: address for browsers,
    None for a window. It listens on loopback only. It starts the viewer's own program, because the `rerun` script
    around it leaves the program behind when killed. A viewer that does not open is no error: `is_open` is False, and
    its log has the reason.
    """

    def __init__(self, kind: Literal["native", "web"], log: Path, shows: Sequence[Path] = ()) -> None:
        port = free_port(STREAM_PORT if kind == "web" else 0)
        self.url = stream_address(f"{LOOPBACK}:{port}")
        self.log = log
        self.page: str | None = None
        self._options = ["--bind", LOOPBACK, "--port", str(port)]
        self._ports = [port]
        if kind == "web":
            page = free_port(PAGE_PORT)
            self.page = page_address(f"{LOOPBACK}:{page}", f"{LOOPBACK}:{port}")
            self._ports.append(page)
            self._options += web_options(page)
        else:
            self._options += ["--memory-limit", MEMORY_LIMIT, "--hide-welcome-screen"]
        self._options += [str(each.absolute()) for each in shows]
        self._process: subprocess.Popen[bytes] | None = None
        self._answered = False

    @property
    def is_open(self) -> bool:
        return self._answered and self._runs()

    def __enter__(self) -> Self:
        program = find_program()
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with self.log.open("ab") as log:
            if program is None:
                log.write(UNINSTALLED.encode())
                return self
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, program, *self._options],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        try:
            self._wait_for_answer(time.monotonic() + START_TIMEOUT)
            if self.page is None:
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
        """Wait until the user closes the window."""
        if self._process is not None:
            self._process.wait()

    def _runs(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def _wait_for_answer(self, deadline: float) -> None:
        while self._runs() and time.monotonic() < deadline and not self._answered:
            self._answered = all(answers(port, 0.2) for port in self._ports)
            if not self._answered:
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
            # The viewer is in the same session, and may still run.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def free_port(preferred: int = 0) -> int:
    """A free port of loopback: the preferred one if it is free."""
    for port in (preferred, 0):
        with socket.socket() as probe, contextlib.suppress(OSError):
            # The viewer sets it, too: a port that an earlier viewer has just left counts as free.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((LOOPBACK, port))
            return int(probe.getsockname()[1])
    raise OSError("no port of the loopback interface is free")


def stream_address(stream: str) -> str:
    """Address of the recordings of a viewer that listens at `HOST:PORT`."""
    return f"rerun+http://{stream}/proxy"


def page_address(page: str, stream: str) -> str:
    """Address for a browser that reaches the viewer's page and its stream at `HOST:PORT` each.

    It asks for dark colours: in light ones the names of the behaviour tree are pale.
    """
    return f"http://{page}/?theme=dark&url={quote(stream_address(stream), safe='')}"


def web_options(page_port: int) -> list[str]:
    """Options with which the viewer's program serves browsers."""
    return ["--serve-web", "--web-viewer-port", str(page_port), "--server-memory-limit", SERVER_MEMORY_LIMIT]


def find_program() -> str | None:
    """The viewer's own program inside the installed package; None without one."""
    package = importlib.util.find_spec("rerun_cli")
    if package is None or not package.submodule_search_locations:
        return None
    program = Path(package.submodule_search_locations[0]) / ("rerun.exe" if sys.platform == "win32" else "rerun")
    return str(program) if program.exists() else None


def required_program() -> str:
    """The viewer's own program; raises InvalidOptionError if it is not installed."""
    program = find_program()
    if program is None:
        raise InvalidOptionError("viewer", UNINSTALLED.strip())
    return program


def answers(port: int, within: float) -> bool:
    """True for a port of loopback that answers within so many seconds."""
    try:
        socket.create_connection((LOOPBACK, port), within).close()
    except OSError:
        return False
    return True


def stop(program: subprocess.Popen[bytes]) -> None:
    """End the viewer's program; kill it after a timeout."""
    program.terminate()
    try:
        program.wait(STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()


def main(command: list[str]) -> int:
    """Run `command` until it ends, or until standard input does."""
    lifetime = Lifetime(parent_pipe=True)
    viewer = subprocess.Popen(command, stdin=subprocess.DEVNULL)

    def follow() -> None:
        viewer.wait()
        lifetime.end()

    threading.Thread(target=follow, name="viewer", daemon=True).start()
    lifetime.wait()
    stop(viewer)
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
