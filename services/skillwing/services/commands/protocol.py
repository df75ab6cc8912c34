"""`skillwing protocol`: keys and messages between processes, for people and for programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import load
from skillwing.services.errors import InvalidOptionError
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import make_console, print_json, print_table
from skillwing.services.wire.channels import CHANNELS, keys_in
from skillwing.services.wire.messages import classes_of


def protocol(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="Skillset whose keys and schema hash to print.")
    ] = None,
    schema: Annotated[bool, typer.Option("--json-schema", help="Print all messages and keys as JSON Schema.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Print the wire protocol: the page docs/protocol.md, or the schema hash and all keys of one skillset.

    Exit codes: 0 printed, 2 broken file.
    """
    if file is None and as_json:
        raise InvalidOptionError("json", "`--json` is for the keys of a FILE. Name one, or say `--json-schema`.")
    if file is not None and schema:
        raise InvalidOptionError("json-schema", "The messages are the same for every skillset. Leave out the FILE.")
    if file is not None:
        _print_keys(file, as_json=as_json)
    elif schema:
        from skillwing.services.protocol_page.schema import json_schema  # noqa: PLC0415 - as below

        print_json(json_schema())
    else:
        from skillwing.services.protocol_page.page import protocol_page  # noqa: PLC0415 - plays an exchange, on all managers

        typer.echo(protocol_page(), nl=False)


def _print_keys(file: Path, *, as_json: bool) -> None:
    skillset = load(file)
    if as_json:
        from skillwing.services.protocol_page.schema import channels_of  # noqa: PLC0415 - as above

        print_json(channels_of(skillset))
        return
    console = make_console()
    console.print(f"skillset {skillset.name}, schema {skillset.schema_hash}\n", markup=False)
    rows = [
        (key, channel.kind, _names(channel.message), _names(channel.reply))
        for channel in CHANNELS
        for key in keys_in(skillset, channel)
    ]
    print_table(console, ("KEY", "KIND", "MESSAGE", "REPLY"), rows)


def _names(kind: object) -> str:
    return "-" if kind is None else " | ".join(cls.__name__ for cls in classes_of(kind))
