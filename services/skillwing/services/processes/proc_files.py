"""Facts about processes from /proc: start time, usage, and the listener of a port."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PROC = Path("/proc")
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
BYTES_PER_PAGE = os.sysconf("SC_PAGE_SIZE")
LISTENING = "0A"
"""State of a listening socket in /proc/net/tcp."""


@dataclass(frozen=True, slots=True)
class Usage:
    """Usage of a process. cpu: seconds of all its threads since its start. memory: resident bytes.

    uptime: seconds since its start. stopped: SIGSTOP or a debugger holds it.
    """

    cpu: float
    memory: int
    uptime: float
    stopped: bool


@dataclass(frozen=True, slots=True)
class Listener:
    """The process that listens at a port. pid and name are None for a process of another user.

    stopped: SIGSTOP or a debugger holds it.
    """

    port: int
    pid: int | None
    name: str | None
    stopped: bool = False

    @property
    def who(self) -> str:
        """The process, as the first words of a sentence."""
        return f"Process {self.pid} (`{self.name}`)" if self.pid is not None else "A process of another user"


def started(pid: int) -> str | None:
    """Start time of a process in the kernel's ticks since boot; None without such a process."""
    found = _stat(pid)
    return None if found is None else found[19]


def usage(pid: int) -> Usage | None:
    """Usage of a process; None without such a process."""
    found = _stat(pid)
    if found is None:
        return None
    since_boot = float((PROC / "uptime").read_text(encoding="ascii").split()[0])
    return Usage(
        cpu=(int(found[11]) + int(found[12])) / TICKS_PER_SECOND,
        memory=int(found[21]) * BYTES_PER_PAGE,
        uptime=max(0.0, since_boot - int(found[19]) / TICKS_PER_SECOND),
        stopped=found[0] in "Tt",
    )


def listener(port: int) -> Listener | None:
    """The process that listens at a TCP port of this machine; None if none does."""
    inodes = set(_listening_sockets(port))
    if not inodes:
        return None
    for pid in (int(path.name) for path in PROC.iterdir() if path.name.isdecimal()):
        if not inodes.isdisjoint(_sockets_of(pid)):
            used = usage(pid)
            return Listener(port, pid, _name_of(pid), stopped=used is not None and used.stopped)
    return Listener(port, None, None)


def port_of(endpoint: str) -> int | None:
    """The port in `tcp/HOST:PORT` or `tls/HOST:PORT`; None for another machine, or a text of another form."""
    host, _, port = endpoint.removeprefix("tcp/").removeprefix("tls/").rpartition(":")
    here = {"localhost", "127.0.0.1", "[::1]", "0.0.0.0", "[::]", socket.gethostname()}
    return int(port) if host in here and port.isdecimal() else None


def _stat(pid: int) -> list[str] | None:
    """The fields of /proc/PID/stat from the state on (`man 5 proc`, number 3); None for a process that has ended."""
    try:
        text = (PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name is in brackets, and may contain spaces and brackets.
    fields = text.rpartition(")")[2].split()
    return None if fields[0] in "ZX" else fields


def _listening_sockets(port: int) -> Iterator[str]:
    """Inodes of the sockets that listen at a port."""
    for table in ("tcp", "tcp6"):
        with contextlib.suppress(OSError):
            for line in (PROC / "net" / table).read_text(encoding="ascii").splitlines()[1:]:
                fields = line.split()
                if fields[3] == LISTENING and int(fields[1].rpartition(":")[2], 16) == port:
                    yield fields[9]


def _sockets_of(pid: int) -> Iterator[str]:
    with contextlib.suppress(OSError):
        for path in (PROC / str(pid) / "fd").iterdir():
            with contextlib.suppress(OSError):
                target = str(path.readlink())
                if target.startswith("socket:["):
                    yield target[len("socket:[") : -1]


def _name_of(pid: int) -> str:
    """The program's name; for Python with its module."""
    try:
        words = (PROC / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return "?"
    program = Path(words[0]).name or "?"
    return f"{program} -m {words[2]}" if words[1:2] == ["-m"] and len(words) > 2 else program
