"""Fork server: a process that has imported the code of managers, and forks a host of nodes for each order.

    python -m skillwing.services.processes.fork_server

The import is three quarters of the start of a manager, and a fork has it for nothing. Forks also share its memory. The
server has no thread and no session of Zenoh, because neither survives a fork. Orders arrive at its standard input, a
Unix socket. It ends when that closes; its forks do not.
"""

from __future__ import annotations

import gc
import importlib
import os
import select
import socket
import struct
import sys
from contextlib import suppress
from pathlib import Path

import msgspec
from setproctitle import setproctitle

from skillwing.services.disk import discard_unwritten

IMPORTED = (
    "skillwing.services.managers.data_manager",
    "skillwing.services.managers.resource_manager",
    "skillwing.services.managers.skill_manager",
    "skillwing.services.mocking.system",
)
"""Modules that most processes of a system need, beside the host of nodes."""
HOST = "skillwing.services.processes.node_host"
"""The module that forks run."""
SIZE = struct.Struct("!I")
"""Length of an order, before the order."""
PID = struct.Struct("!i")
"""Answer to an order: the id of the fork, 0 if there is none. With it comes a descriptor of the process."""
STATUS = struct.Struct("!i")
"""Wait status of a fork, on the pipe that came with the order."""
_STREAMS = 3
"""Standard streams of a fork: the first descriptors of an order."""


class Order(msgspec.Struct, frozen=True):
    """A host to fork. environment: of the process. title: its command line, for the tables of processes."""

    arguments: list[str]
    environment: dict[str, str]
    title: str


class Fork:
    """A fork that lives. process: its descriptor (`pidfd_open(2)`), readable at its end. report: for its status."""

    def __init__(self, pid: int, process: int, report: int) -> None:
        self.pid = pid
        self.process = process
        self._report = report

    def ended(self) -> None:
        """Report the status of a fork that has ended."""
        _, status = os.waitpid(self.pid, 0)
        with suppress(OSError):  # nobody waits for it any more
            os.write(self._report, STATUS.pack(status))
        self.close()

    def close(self) -> None:
        os.close(self.process)
        os.close(self._report)


class Server:
    """The forks that live, and the socket at which orders arrive."""

    def __init__(self, link: socket.socket) -> None:
        self._link = link
        self._forks: dict[int, Fork] = {}
        self._ready = select.poll()
        self._ready.register(link, select.POLLIN)

    def serve(self) -> Order | None:
        """Fork for each order. Returns None when the other end is closed, and in each fork its order."""
        while True:
            for descriptor, _ in self._ready.poll():
                if descriptor != self._link.fileno():
                    self._ready.unregister(descriptor)
                    self._forks.pop(descriptor).ended()
                elif (received := _receive(self._link)) is None:
                    return None
                elif self._forks_for(*received):
                    return received[0]

    def _forks_for(self, order: Order, streams: list[int], report: int) -> bool:
        """Fork for an order, and answer it once the fork is the ordered process. True in the fork."""
        placed, in_place = os.pipe()
        try:
            pid = os.fork()
        except OSError:  # the system has no room for it
            pid = None
        if pid == 0:
            # Each descriptor that stays open here would hide an end from the launcher.
            self._link.close()
            os.close(report)
            os.close(placed)
            for other in self._forks.values():
                other.close()
            _take_place(order, streams)
            os.close(in_place)
            return True
        os.close(in_place)
        os.read(placed, 1)  # until the fork closes its end, or is gone
        os.close(placed)
        for stream in streams:
            os.close(stream)
        if pid is None:
            os.close(report)
            self._link.sendall(PID.pack(0))
            return False
        fork = Fork(pid, os.pidfd_open(pid), report)
        self._forks[fork.process] = fork
        self._ready.register(fork.process, select.POLLIN)
        socket.send_fds(self._link, [PID.pack(pid)], [fork.process])
        return False


def _receive(link: socket.socket) -> tuple[Order, list[int], int] | None:
    """The next order, its standard streams, and the pipe for its status; None if the other end is closed."""
    head, descriptors, _, _ = socket.recv_fds(link, SIZE.size, _STREAMS + 1)
    if len(descriptors) <= _STREAMS:
        return None
    (size,) = SIZE.unpack(head)
    packed = bytearray()
    while len(packed) < size:
        if not (part := link.recv(size - len(packed))):
            return None
        packed += part
    return msgspec.msgpack.decode(packed, type=Order), descriptors[:_STREAMS], descriptors[_STREAMS]


def _take_place(order: Order, streams: list[int]) -> None:
    """Become the ordered process: its session, streams and environment."""
    os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    setproctitle(order.title)  # first: it looks for the place of the title below the environment
    os.environ.clear()
    os.environ.update(order.environment)


def main() -> int:
    """Serve until the launcher is gone; in a fork, host its nodes. Returns the exit code."""
    link = socket.socket(fileno=os.dup(sys.stdin.fileno()))
    host = importlib.import_module(HOST)
    for module in IMPORTED:
        importlib.import_module(module)
    threads = len(list(Path("/proc/self/task").iterdir()))
    if threads > 1:
        raise RuntimeError(f"The fork server has {threads} threads. One of its imports has started them.")
    # The memory of the imports stays shared: the garbage collection of a fork does not write to it.
    gc.collect()
    gc.freeze()
    order = Server(link).serve()
    if order is None:
        return 0
    sys.argv = [str(host.__file__), *order.arguments]
    return host.main()


if __name__ == "__main__":
    ended_with = main()
    discard_unwritten()
    sys.exit(ended_with)
