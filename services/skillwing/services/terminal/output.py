"""Output of commands: tables and colours on a terminal, plain columns in a pipe, JSON on request."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO, cast

import msgspec
import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from skillwing.services.disk import FULL
from skillwing.services.history.wording import time_text
from skillwing.services.protocol import Ending, Record, RecordKind, Terminal

PIPE_WIDTH = 200
NO_MANAGER = "its manager does not run; the resource manager ends the goal as LOST"
DOES_NOT_ANSWER = "its manager does not answer: one of its hooks blocks it, or it is stopped"


class LossyOutput:
    """Output that loses what its stream does not take. A system must not end because of its log.

    A full disk may have room again. After a reader or a terminal that is gone, everything later goes nowhere.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    @property
    def encoding(self) -> str:
        return self._stream.encoding

    def isatty(self) -> bool:
        return self._stream.isatty()

    def fileno(self) -> int:
        return self._stream.fileno()

    def write(self, text: str) -> int:
        with self._lossy():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with self._lossy():
            self._stream.flush()

    @contextmanager
    def _lossy(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            if error.errno not in FULL:
                with Path(os.devnull).open("wb") as nowhere, suppress(OSError):
                    os.dup2(nowhere.fileno(), self._stream.fileno())


def make_console(*, lossy: bool = False) -> Console:
    """Standard output; in a pipe without colours and line breaks of our own. lossy: it survives a full disk,
    and a reader or terminal that is gone.

    Emoji codes stay text: `:100:` is a place in a file.
    """
    console = Console(highlight=False, emoji=False)
    if not console.is_terminal:
        console = Console(highlight=False, emoji=False, width=PIPE_WIDTH, no_color=True)
    if lossy:
        console.file = cast(TextIO, LossyOutput(sys.stdout))
    return console


def print_json(value: Any) -> None:
    """Print messages, structures and plain values as indented JSON."""
    typer.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def make_table(headings: Sequence[str], right: Collection[str] = ()) -> Table:
    """An empty table in the style of all commands. right: headings of columns of numbers."""
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


def print_records(console: Console, records: Iterable[Record], known: Mapping[str, Record]) -> None:
    """Print timeline records, a line each. known: records by id, for the names of causes."""
    rows = [(time_text(each.t), each.subject, _change(each), each.text, _cause(each, known)) for each in records]
    print_table(console, ("TIME", "CHANGE OF", "TO", "WHY", "CAUSE"), rows)


def state_text(state: str) -> Text:
    """A resource's state: green for a good one, red for a bad one."""
    good = {"AVAILABLE", "OK", "VALID", "NORMAL", "GOOD"}
    bad = {"FAILED", "CRITICAL", "LOST", "DIVERGED", "UNAVAILABLE", "INVALID"}
    return Text(state, style="green" if state in good else "red" if state in bad else "")


def end_text(terminal: Terminal) -> Text:
    """The end of a goal in the timeline's colours: label, reason and output."""
    succeeded = terminal.ending is Ending.SUCCEEDED and terminal.success
    style = "green" if succeeded else "bright_black" if terminal.ending is Ending.INTERRUPTED else "red"
    text = Text(terminal.label, style=f"bold {style}")
    if terminal.reason:
        text.append(f"  {terminal.reason}", style="default")
    if terminal.output:
        text.append(f"  {value_text(terminal.output)}", style="default")
    return text


def value_text(value: Any) -> str:
    """A value of the skillset in one line: short numbers, structures as name=value."""
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


def relative_path(path: Path) -> str:
    """A path as people write it: relative to the working directory if it lies below it."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)


def _change(record: Record) -> Text:
    return state_text(record.after) if record.kind is RecordKind.RESOURCE else Text(record.after)


def _cause(record: Record, known: Mapping[str, Record]) -> str:
    """The cause in words if it is known, else its id."""
    cause = None if record.cause is None else known.get(record.cause)
    return f"{cause.subject} {cause.after}" if cause else record.cause or ""
