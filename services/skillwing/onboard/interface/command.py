"""`skillwing functional-layer`: the topics between robot and skills, for people and for programs."""

from __future__ import annotations

import json
from typing import Annotated

import typer


def functional_layer(
    schema: Annotated[
        bool, typer.Option("--json-schema", help="Print all messages and topics as JSON Schema instead.")
    ] = False,
) -> None:
    """Print the functional layer's topics as the page docs/functional-layer.md: the duties of another vehicle."""
    from skillwing.onboard.interface.page import interface_page, interface_schema  # noqa: PLC0415 - imports all guidance

    typer.echo(json.dumps(interface_schema(), indent=2) if schema else interface_page(), nl=schema)
