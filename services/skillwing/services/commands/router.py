"""`skillwing router`: a router by itself, for several robots and stations."""

from __future__ import annotations

from typing import Annotated

import typer

from skillwing.services.access.exposure import require_protected
from skillwing.services.processes.router import LOOPBACK_WITH_KEYS, run_router
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.system_options import InsecureOption, KeysOption


def router(
    listen: Annotated[
        str,
        typer.Option("--listen", metavar="tcp/HOST:PORT", help="Address; with --keys tls/HOST:PORT."),
    ] = "tcp/127.0.0.1:7447",
    keys: KeysOption = None,
    insecure: InsecureOption = False,
) -> None:
    """Run a router until Ctrl-C, and print its address.

    Robots join it: `up --router tcp/HOST:PORT`, with keys `up --router tls/HOST:PORT --keys DIR`. It serves every robot
    of the folder of keys. After a change of that folder, restart it: robots and stations find it again.

    Exit codes: 0 it was told to stop, 1 it could not start, 2 wrong options.
    """
    if keys is not None and listen == "tcp/127.0.0.1:7447":
        listen = LOOPBACK_WITH_KEYS.replace(":0", ":7447")
    require_protected(listen, keys, insecure=insecure)
    raise typer.Exit(FAILED if run_router(listen, keys, insecure=insecure) else OK)
