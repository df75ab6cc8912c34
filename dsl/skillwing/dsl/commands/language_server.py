"""`skillwing language-server`: the language server for editors."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from skillwing.dsl.commands.source import usage_error


def language_server(
    tcp: Annotated[
        int | None,
        typer.Option("--tcp", metavar="PORT", min=1, max=65535, help="Listen on this loopback port, for debugging."),
    ] = None,
) -> None:
    """Serve an editor over standard input and output: problems, completion, hover, definitions, renaming, format. See
    docs/editor.md."""
    try:
        from skillwing.dsl.editor.server import server  # noqa: PLC0415 - the protocol's library is an extra
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in {"pygls", "lsprotocol"}:
            raise
        usage_error("The language server needs the extra `editor`. Run `pip install 'skillwing[editor]'`.")
    if tcp is None:
        server.start_io()
        return
    typer.echo(f"Listening on 127.0.0.1:{tcp}.", err=True)
    try:
        server.start_tcp("127.0.0.1", tcp)
    except OSError as error:
        usage_error(f"Port {tcp} cannot be opened: {os.strerror(error.errno or 0)}.")
