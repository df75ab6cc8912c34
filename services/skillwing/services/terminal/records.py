"""Timeline records in the terminal, a line each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime

from rich.console import Console
from rich.text import Text

from skillwing.services.protocol import Record, RecordKind
from skillwing.services.terminal.output import print_table, state_text

UNIX_TIMES = 1e9
"""Seconds from which a robot time has to be Unix time; simulated worlds begin at 0."""


def print_records(console: Console, records: Iterable[Record], known: Mapping[str, Record]) -> None:
    """known: records by id, in which causes are looked up."""
    rows = [(time_text(each.t), each.subject, _change(each), each.text, _cause(each, known)) for each in records]
    print_table(console, ("TIME", "CHANGE OF", "TO", "WHY", "CAUSE"), rows)


def time_text(t: float) -> str:
    """Robot time: seconds of a simulated world, or date and time."""
    if t < UNIX_TIMES:
        return f"{t:.2f} s"
    return datetime.fromtimestamp(t).astimezone().isoformat(sep=" ", timespec="milliseconds").partition("+")[0]


def clock_text(t: float) -> str:
    """Robot time where one looks on: seconds of a simulated world, or the time of day."""
    return f"{t:.1f} s" if t < UNIX_TIMES else datetime.fromtimestamp(t).astimezone().strftime("%H:%M:%S")


def _change(record: Record) -> Text:
    return state_text(record.after) if record.kind is RecordKind.RESOURCE else Text(record.after)


def _cause(record: Record, known: Mapping[str, Record]) -> str:
    """What made it happen: in words, if that is known as well."""
    cause = None if record.cause is None else known.get(record.cause)
    return f"{cause.subject} {cause.after}" if cause else record.cause or ""
