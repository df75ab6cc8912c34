"""The router process, at which the processes of a system meet.

    python -m skillwing.services.processes.router --listen tcp/127.0.0.1:0

Its first line on standard output is its endpoint. It ends on SIGTERM and SIGINT. With `--parent-pipe` it also ends with
its standard input, that is, when its parent is gone.
"""

from __future__ import annotations

import argparse
import socket
import sys

import zenoh

from skillwing.services.bus.zenoh_session import EndpointError, open_router
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK, EXIT_UNREACHABLE, Lifetime
from skillwing.services.processes.proc_files import listener, port_of

LOOPBACK = "tcp/127.0.0.1:0"
ATTEMPTS = 20


def start_router(listen: str = LOOPBACK) -> tuple[zenoh.Session, str]:
    """Open a router at `tcp/HOST:PORT` and return it with its endpoint; port 0 means any free port.

    Raises EndpointError for an endpoint at which it cannot listen.
    """
    protocol, _, address = listen.partition("/")
    host, _, port = address.rpartition(":")
    if protocol != "tcp" or not host or not port.isdecimal():
        raise EndpointError(listen, "an endpoint is written tcp/HOST:PORT")
    if port != "0":
        return open_router(listen), listen
    for attempt in range(1, ATTEMPTS + 1):
        # Another process may take the port before this one listens there. Then try the next port.
        endpoint = f"tcp/{host}:{_free_port(host, listen)}"
        try:
            return open_router(endpoint), endpoint
        except EndpointError:
            if attempt == ATTEMPTS:
                raise
    raise AssertionError("unreachable")


def _free_port(host: str, listen: str) -> int:
    try:
        family, kind, _, _, address = socket.getaddrinfo(host.strip("[]"), 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.bind(address)
            return int(probe.getsockname()[1])
    except OSError as error:
        raise EndpointError(listen, error.strerror or str(error)) from error


def main(arguments: list[str] | None = None) -> int:
    """Run a router until the process has to end; returns the exit code."""
    parser = argparse.ArgumentParser(prog="router", description="Route a system's messages.")
    parser.add_argument("--listen", default=LOOPBACK, metavar="tcp/HOST:PORT", help="default: %(default)s")
    parser.add_argument("--parent-pipe", action="store_true", help="end when standard input ends")
    options = parser.parse_args(arguments)
    lifetime = Lifetime(parent_pipe=options.parent_pipe)
    try:
        session, endpoint = start_router(options.listen)
    except EndpointError as error:
        port = port_of(options.listen)
        taken = listener(port) if port else None
        sys.stderr.write(f"{error}\n" if taken is None else f"{error} {taken.who} listens there.\n")
        # A taken port may be free at the next start.
        return EXIT_CONFIGURATION if taken is None else EXIT_UNREACHABLE
    with session:
        sys.stdout.write(f"{endpoint}\n")
        sys.stdout.flush()
        lifetime.wait()
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
