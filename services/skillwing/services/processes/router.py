"""The router process, at which the processes of a system meet.

    python -m skillwing.services.processes.router --listen tcp/127.0.0.1:0
    python -m skillwing.services.processes.router --listen tls/0.0.0.0:7447 --keys DIR

Its first line on standard output is its endpoint. It ends on SIGTERM and SIGINT. With `--parent-pipe` it also ends with
its standard input, that is, when its parent is gone. The environment may give SKILLWING_KEYS, and SKILLWING_INSECURE=1.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import zenoh

from skillwing.services.access.exposure import EXPOSED, exposed, require_protected
from skillwing.services.bus.identity import KEYS_VARIABLE, WHO
from skillwing.services.bus.zenoh_session import EndpointError, open_router
from skillwing.services.errors import InvalidOptionError, KeysError
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK, EXIT_UNREACHABLE, Lifetime
from skillwing.services.processes.proc_files import listener, port_of

if TYPE_CHECKING:
    from skillwing.services.access.router_keys import RouterKeys

LOOPBACK = "tcp/127.0.0.1:0"
LOOPBACK_WITH_KEYS = "tls/127.0.0.1:0"
INSECURE_VARIABLE = "SKILLWING_INSECURE"
ATTEMPTS = 20
REMINDER_PERIOD = 60.0
"""Seconds between two looks at the end of the certificate."""


def start_router(
    listen: str = LOOPBACK, keys: Path | None = None, upper: str | None = None
) -> tuple[zenoh.Session, str]:
    """Open a router at `tcp/HOST:PORT`, or with keys at `tls/...`, and return it with its endpoint.

    Port 0 means any free port. keys: folder of a site (`KeyStore`). upper: endpoint of the router above it, None for
    none. Raises EndpointError for an endpoint at which it cannot listen, and KeysError.
    """
    protocol, _, address = listen.partition("/")
    host, _, port = address.rpartition(":")
    own = None if keys is None else _keys_in(keys)
    identity, rules = (None, None) if own is None else (own.identity, own.rules)

    def open_at(endpoint: str) -> zenoh.Session:
        session = open_router(endpoint, identity, rules, upper)
        # The name in the key is that of the asker's certificate: the rules allow no other.
        session.declare_queryable(f"robot/*/{WHO}/*", zenoh.handlers.Callback(confirm, indirect=False))
        return session

    def confirm(query: zenoh.Query) -> None:
        """Tell an asker that its name is known, and its role in the robot."""
        key = str(query.key_expr).removeprefix("robot/")
        robot, name = key.partition("/")[0], key.rpartition("/")[2]
        query.reply(query.key_expr, ("" if own is None else own.role(robot, name)).encode())

    if port != "0":
        return open_at(listen), listen
    for attempt in range(1, ATTEMPTS + 1):
        # Another process may take the port before this one listens there. Then try the next port.
        endpoint = f"{protocol}/{host}:{_free_port(host, listen)}"
        try:
            return open_at(endpoint), endpoint
        except EndpointError:
            if attempt == ATTEMPTS:
                raise
    raise AssertionError("unreachable")


def _keys_in(folder: Path) -> RouterKeys:
    from skillwing.services.access.router_keys import read_router_keys  # noqa: PLC0415 - half of the start of a router

    return read_router_keys(folder)


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
    folder = os.environ.get(KEYS_VARIABLE)
    parser.add_argument("--keys", type=Path, metavar="DIR", default=Path(folder) if folder else None)
    parser.add_argument("--insecure", action="store_true", help="without keys also where strangers reach it")
    options = parser.parse_args(arguments)
    insecure = options.insecure or os.environ.get(INSECURE_VARIABLE) == "1"
    lifetime = Lifetime(parent_pipe=options.parent_pipe)
    try:
        run_router(options.listen, options.keys, lambda *_: lifetime.wait(), insecure=insecure)
    except (InvalidOptionError, KeysError) as error:
        sys.stderr.write(f"{error}\n")
        return EXIT_CONFIGURATION
    except EndpointError as error:
        sys.stderr.write(f"{error}\n")
        # A taken port may be free at the next start.
        return EXIT_UNREACHABLE if error.is_taken else EXIT_CONFIGURATION
    return EXIT_OK


def run_router(
    listen: str,
    keys: Path | None,
    wait: Callable[[zenoh.Session, str], None],
    *,
    insecure: bool,
    upper: str | None = None,
    lasting: bool = False,
) -> None:
    """Print the endpoint of a router and run it until `wait` returns, called with both.

    lasting: refuse a certificate in its last day. A router that is started again while robots work must not.
    Raises as `start_router` does, and InvalidOptionError for an address that strangers reach.
    """
    require_protected(listen, keys, insecure=insecure)
    if keys is not None and lasting:
        _require_lasting(keys)
    try:
        session, endpoint = start_router(listen, keys, upper)
    except EndpointError as error:
        port = port_of(listen)
        taken = listener(port) if port else None
        if taken is None:
            raise
        raise EndpointError(error.endpoint, error.reason, f"{taken.who} listens there.") from error
    with session:
        if exposed(listen):
            sys.stderr.write(f"{EXPOSED.format(endpoint=listen)}\n")
        sys.stdout.write(f"{endpoint}\n")
        sys.stdout.flush()
        with nullcontext() if keys is None else _reminding(keys):
            wait(session, endpoint)


def _require_lasting(keys: Path) -> None:
    from skillwing.services.access.identity_files import require_router_certificate  # noqa: PLC0415 - as in `_keys_in`

    require_router_certificate(keys)


@contextmanager
def _reminding(keys: Path) -> Iterator[None]:
    """Write reminders of the end of the router's certificate to standard error meanwhile."""
    from skillwing.services.access.certificate_watch import RouterWatch  # noqa: PLC0415 - as in `_keys_in`

    watch, over = RouterWatch(keys), threading.Event()

    def remind() -> None:
        if text := watch.reminder():
            with suppress(OSError):  # the log may be on a full disk
                sys.stderr.write(f"{text}\n")
                sys.stderr.flush()

    def follow() -> None:
        while not over.wait(REMINDER_PERIOD):
            remind()

    remind()
    threading.Thread(target=follow, name="certificate", daemon=True).start()
    try:
        yield
    finally:
        over.set()


if __name__ == "__main__":
    sys.exit(main())
