"""`skillwing access-control`: the rules of a site for a router of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from skillwing.dsl.whole_files import write_whole
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.zenoh_rules import access_control as rules_of


def access_control(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; - for the terminal.")],
    keys: Annotated[Path, typer.Option("--keys", metavar="DIR", help="Folder of `skillwing keys init`.")] = Path(
        "keys"
    ),
) -> None:
    """Write the access control of a site as configuration of Zenoh, for a `zenohd` of your own. See docs/keys.md.

    Exit codes: 0 written, 2 a folder without keys.
    """
    site = KeyStore(keys).site()
    content = msgspec.json.format(msgspec.json.encode({"access_control": rules_of(site)})).decode()
    if str(file) == "-":
        typer.echo(content)
        return
    write_whole(file, f"{content}\n")
    typer.echo(f"{file} has the rules for {len(site.robots)} robots and {len(site.people)} people and stations.")
