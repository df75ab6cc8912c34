"""`skillwing router`: a router by itself, for several robots and stations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
import zenoh

from skillwing.services.access.exposure import require_address, require_protected
from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.router import run_router
from skillwing.services.processes.stop_signal import stop_on_signals
from skillwing.services.terminal.shared_router import hold_router
from skillwing.services.terminal.system_options import InsecureOption, KeysOption

PORT = 7447
"""Port of Zenoh's routers."""


def router(
    listen: Annotated[
        str | None,
        typer.Option(
            "--listen",
            metavar="tcp/HOST:PORT",
            help="Address; with --keys tls/HOST:PORT.",
            show_default="tcp/127.0.0.1:7447",
        ),
    ] = None,
    keys: KeysOption = None,
    insecure: InsecureOption = False,
    connect: Annotated[
        str | None, typer.Option(metavar="tcp/HOST:PORT", help="Router above this one, in a tree of routers.")
    ] = None,
) -> None:
    """Run a router until Ctrl-C, and print its address.

    Robots join it: `up --router tcp/HOST:PORT`, with keys `up --router tls/HOST:PORT --keys DIR`. It serves every robot
    of the folder of keys. After a change of that folder, restart it: robots and stations find it again. It reminds of
    the end of its certificate, and does not start in the last day.

    With --connect it is a branch of a tree: robots and stations at all its routers reach each other. See docs/fleet.md.

    While robots use it, the first Ctrl-C only warns. The last line names those that have lost it.

    Exit codes: 0 it was told to stop, 1 it could not listen, 2 wrong options or keys.
    """
    if listen is None:
        listen = f"{'tcp' if keys is None else 'tls'}/127.0.0.1:{PORT}"
    require_protected(listen, keys, insecure=insecure)
    _require_plain(connect, keys)
    with stop_on_signals() as stop:

        def hold(session: zenoh.Session, endpoint: str) -> None:
            hold_router(session, endpoint, stop, connect)

        run_router(listen, keys, hold, insecure=insecure, upper=connect, lasting=True)


def _require_plain(upper: str | None, keys: Path | None) -> None:
    """Raise InvalidOptionError for a router in a tree with keys, or an address that is none."""
    if upper is None:
        return
    if keys is not None or upper.startswith("tls/"):
        text = "A tree of routers has no keys: the rules of a router hold for its own links only."
        raise InvalidOptionError("connect", f"{text} Let all join one router with --keys.")
    require_address(upper, "connect", "tcp/HOST:PORT")
