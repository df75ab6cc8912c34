"""`skillwing timeline`: what happened in a run, why, and its picture; read from the run's files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import UnknownNameError
from skillwing.services.commands.connection import JsonOption
from skillwing.services.commands.output import make_console, print_json
from skillwing.services.commands.records import print_records
from skillwing.services.errors import InvalidOptionError
from skillwing.services.protocol import Record, RecordKind
from skillwing.services.telemetry.history import History
from skillwing.services.telemetry.journal import TIMELINE_FILE, read_goals, read_records
from skillwing.services.telemetry.run_facts import lacking

KINDS = tuple(kind.value for kind in RecordKind)
LONGEST_FLIGHT = 1e8
"""Seconds; robot time that is larger counts from 1970."""
DEFAULT_KINDS = tuple(kind for kind in KINDS if kind != RecordKind.DATA)
"""Data turn stale and fresh by the dozen when a process starts."""


def timeline(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run's directory.", show_default=False)],
    about: Annotated[
        list[str] | None, typer.Option("--about", metavar="NAME", help="Only this skill, resource, ...; repeatable.")
    ] = None,
    kinds: Annotated[
        list[str] | None,
        typer.Option("--kind", metavar="KIND", help=f"Of {', '.join(KINDS)}; repeatable. Default: all but data."),
    ] = None,
    causes: Annotated[bool, typer.Option("--causes", help="Show what led to those records, too.")] = False,
    png: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the run into a picture instead.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show what changed in a run, in order, and what made it change; or draw it.

    Exit codes: 0 shown, 2 no such run, or an unknown name.
    """
    records = sorted(read_records(run), key=lambda record: record.t)
    if not records:
        raise lacking(run, TIMELINE_FILE)
    if png is not None:
        _draw(run, records, png)
        return
    known = {record.id: record for record in records}
    shown = _chosen(records, about or [], kinds or [])
    if causes:
        wanted = {each.id for record in shown for each in _chain(record, known)}
        shown = [record for record in records if record.id in wanted]
    if as_json:
        print_json(shown)
    else:
        print_records(make_console(), shown, known)


def _chosen(records: list[Record], about: list[str], kinds: list[str]) -> list[Record]:
    subjects = {record.subject for record in records}
    for name in about:
        if name not in subjects:
            raise UnknownNameError("subject", name, sorted(subjects))
    for kind in kinds:
        if kind not in KINDS:
            raise UnknownNameError("kind", kind, KINDS)
    wanted = kinds or (KINDS if about else DEFAULT_KINDS)
    return [record for record in records if record.kind in wanted and (not about or record.subject in about)]


def _chain(record: Record, known: dict[str, Record]) -> list[Record]:
    """A record and its causes, as far as they are known."""
    chain = [record]
    while (cause := known.get(chain[-1].cause or "")) is not None and cause not in chain:
        chain.append(cause)
    return chain


def _draw(run: Path, records: list[Record], png: Path) -> None:
    try:
        from skillwing.services.telemetry.timeline_picture import draw_timeline  # noqa: PLC0415 - drawing is optional
    except ModuleNotFoundError as missing:
        text = f"{missing.name} is not installed. To draw timelines: pip install 'skillwing[viewer]'."
        raise InvalidOptionError("--png", text) from missing
    history = History.of(records, read_goals(run))
    # Where robot time is Unix time nobody wants to read it off an axis.
    shown = history.part(history.first) if history.first > LONGEST_FLIGHT else history
    draw_timeline(shown, png, title=run.resolve().name)
    typer.echo(f"The timeline is drawn: {png}")
