"""What commands print: tables and colours on a terminal, plain columns in a pipe, JSON on request."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import msgspec
import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from skillwing.services.protocol import Ending, Terminal

WIDTH_OF_A_PIPE = 200
DOES_NOT_ANSWER = "its manager does not answer: one of its hooks blocks it, or it is stopped"


def make_console() -> Console:
    """Standard output, without colours and line breaks of our own if nobody looks at it.

    `:100:` stays what it is, the place in a file; rich would make a picture of it.
    """
    console = Console(highlight=False, emoji=False)
    if console.is_terminal:
        return console
    return Console(highlight=False, emoji=False, width=WIDTH_OF_A_PIPE, no_color=True)


def print_json(value: Any) -> None:
    """Print messages, structures and plain values as indented JSON."""
    typer.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def make_table(headings: Sequence[str], right: Collection[str] = ()) -> Table:
    """An empty table under its headings, as all commands print them. right: headings of columns of numbers."""
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 3, 0, 0))
    for heading in headings:
        table.add_column(heading, justify="right" if heading in right else "left")
    return table


def print_table(console: Console, headings: Sequence[str], rows: Iterable[Sequence[str | Text]]) -> None:
    """Print rows under their headings."""
    table = make_table(headings)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def state_text(state: str) -> Text:
    """A resource's state, in the colour of how glad one is to read it."""
    good = {"AVAILABLE", "OK", "VALID", "NORMAL", "GOOD"}
    bad = {"FAILED", "CRITICAL", "LOST", "DIVERGED", "UNAVAILABLE", "INVALID"}
    return Text(state, style="green" if state in good else "red" if state in bad else "")


def end_text(terminal: Terminal) -> Text:
    """How a goal ended, in the timeline's colours, with the reason, what failed, and the output."""
    succeeded = terminal.ending is Ending.SUCCEEDED and terminal.success
    style = "green" if succeeded else "bright_black" if terminal.ending is Ending.INTERRUPTED else "red"
    text = Text(terminal.label, style=f"bold {style}")
    if terminal.reason:
        text.append(f"  {terminal.reason}", style="default")
    if terminal.output:
        text.append(f"  {value_text(terminal.output)}", style="default")
    return text


def value_text(value: Any) -> str:
    """A value of the skillset in one line: numbers short, structures as name=value."""
    match value:
        case None:
            return "-"
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:.3f}".rstrip("0").rstrip(".")
        case dict():
            return " ".join(f"{name}={value_text(item)}" for name, item in value.items())
        case list() | tuple():
            return ",".join(value_text(item) for item in value)
        case _:
            return str(value)
