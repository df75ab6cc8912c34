"""`skillwing timeline`: the changes in a run with their causes, or their picture, from the run's files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import SkillsetError, UnknownNameError, load
from skillwing.dsl.model import Resource, Skillset
from skillwing.services.errors import InvalidOptionError
from skillwing.services.history.files import GOALS_FILE, TIMELINE_FILE, iterate
from skillwing.services.history.history import History
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.recording_state import missing_sentences, read_state
from skillwing.services.protocol import GoalStatus, Record, RecordKind
from skillwing.services.recording.run_facts import missing_run_file, read_facts, version_note
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import make_console, print_json, print_records
from skillwing.services.viewer_extra import viewer_module

KINDS = tuple(kind.value for kind in RecordKind)
LONGEST_RUN = 1e8
"""Seconds; robot time that is larger counts from 1970."""
DEFAULT_KINDS = tuple(kind for kind in KINDS if kind != RecordKind.DATA)
"""Kinds of records by default. Data become stale and fresh by the dozen when a process starts."""
PICTURE = ".png"
MOST_RECORDS, MOST_GOALS = 100_000, 20_000
"""Records and goals that are shown of a long run: the last ones."""


def timeline(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run's directory.", show_default=False)],
    about: Annotated[
        list[str] | None, typer.Option("--about", metavar="NAME", help="Only this skill, resource, ...; repeatable.")
    ] = None,
    kinds: Annotated[
        list[str] | None,
        typer.Option("--kind", metavar="KIND", help=f"Of {', '.join(KINDS)}; repeatable. Default: all but data."),
    ] = None,
    causes: Annotated[bool, typer.Option("--causes", help="Show the causes of those records, too.")] = False,
    png: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the run into a picture instead.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the changes in a run, in order, with their causes; or draw them. See docs/recordings.md.

    Each goal has one ending: what a manager published about a goal that it had lost is left out. JSON has it, too.

    Exit codes: 0 shown, 2 no such run, an unknown name, or a file that cannot be written.
    """
    if png is not None and png.suffix.lower() != PICTURE:
        raise typer.BadParameter(f"`{png}` is no picture that can be drawn. End it with {PICTURE}.")
    skillset = None if png is None else _skillset_of(run)
    history = _history_of(run, skillset)
    records = history.records
    if not records:
        raise missing_run_file(run, TIMELINE_FILE)
    if png is not None:
        _draw(history, run, png, () if skillset is None else skillset.resources)
        return
    known = {record.id: record for record in records}
    late = set() if as_json else {record.id for record in records} - {record.id for record in history.timeline}
    shown = [record for record in _chosen(records, about or [], kinds or []) if record.id not in late]
    if causes:
        wanted = _with_causes(shown, known)
        shown = [record for record in records if record.id in wanted]
    if as_json:
        print_json(shown)
    else:
        print_records(make_console(), shown, known)


def _with_causes(shown: Iterable[Record], known: Mapping[str, Record]) -> set[str]:
    """Ids of these records and of all their causes. Chains join, and each record is looked at once."""
    wanted: set[str] = set()
    for record in shown:
        each: Record | None = record
        while each is not None and each.id not in wanted:
            wanted.add(each.id)
            each = known.get(each.cause or "")
    return wanted


def _history_of(run: Path, skillset: Skillset | None) -> History:
    """The history of a run; of a long one the last part, with a sentence on standard error."""
    history = RecentHistory(skillset, records=MOST_RECORDS, goals=MOST_GOALS, longest_chain=MOST_RECORDS)
    for record in iterate(run, TIMELINE_FILE, Record):
        history.add_record(record)
    for status in iterate(run, GOALS_FILE, GoalStatus):
        history.add_status(status)
    for sentence in missing_sentences(read_state(run), -math.inf, math.inf):
        typer.echo(sentence, err=True)
    if history.forgotten_until is not None:
        typer.echo(
            f"The run is long: its last {MOST_RECORDS} records are shown. {run}/timeline*.jsonl has all.", err=True
        )
    return history


def _chosen(records: Sequence[Record], about: list[str], kinds: list[str]) -> list[Record]:
    subjects = {record.subject for record in records}
    for name in about:
        if name not in subjects:
            raise UnknownNameError("subject", name, sorted(subjects))
    for kind in kinds:
        if kind not in KINDS:
            raise UnknownNameError("kind", kind, KINDS)
    wanted = kinds or (KINDS if about else DEFAULT_KINDS)
    return [record for record in records if record.kind in wanted and (not about or record.subject in about)]


def _skillset_of(run: Path) -> Skillset | None:
    """The skillset of a run, for resources that never changed; None if it is unknown, or gone."""
    try:
        facts = read_facts(run)
        skillset = load(Path(facts.skillset))
    except (InvalidOptionError, SkillsetError, OSError):
        return None
    if (remark := version_note(facts, skillset)) is not None:
        typer.echo(remark, err=True)
    return skillset


def _draw(history: History, run: Path, png: Path, resources: Sequence[Resource]) -> None:
    picture = viewer_module("skillwing.services.report.timeline_picture", "--png")
    # Unix time is unreadable on an axis.
    long = history.first > LONGEST_RUN
    shown, clock = (history.part(history.first), picture.RUN_TIME) if long else (history, picture.ROBOT_TIME)
    picture.draw_timeline(shown, png, title=run.resolve().name, resources=resources, clock=clock)
    typer.echo(f"The timeline is drawn: {png}")
