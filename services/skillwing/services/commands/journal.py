"""`skillwing journal`: contents of the resource manager's journal, of a running or an ended system."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from skillwing.services.client.connection import find_target
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.errors import NoSystemError
from skillwing.services.history.wording import time_text
from skillwing.services.journal.journal import look_into
from skillwing.services.journal.schema import Identity
from skillwing.services.names import JOURNAL_FILE
from skillwing.services.protocol import Ended, GoalVerdict, Lost, NotReady, Record, Terminal, Violated
from skillwing.services.terminal.connection import JsonOption
from skillwing.services.terminal.output import (
    make_console,
    print_json,
    print_records,
    print_table,
    state_text,
    value_text,
)

OUTCOMES = 10
"""Number of ended goals in the output."""


def journal(
    where: Annotated[
        Path | None,
        typer.Argument(metavar="RUN|FILE", help="A run's directory or a journal file; default: the running system's."),
    ] = None,
    last: Annotated[int, typer.Option("--last", "-n", metavar="N", min=0, help="How many changes to show.")] = 20,
    as_json: JsonOption = False,
) -> None:
    """Show a resource manager's journal: states, active grants, ended goals, last changes. See docs/journal.md.

    Exit codes: 0 shown, 2 no journal, or one that is damaged or too new, 3 no place given and no system running.
    """
    identity, kept = look_into(_file(where))
    shown = kept.records[-last:] if last else ()
    if as_json:
        print_json(_facts(identity, kept, shown))
    else:
        _print(make_console(), identity, kept, shown)


def _file(where: Path | None) -> Path:
    if where is None:
        run_dir = find_target(None).run_dir
        if run_dir is None:
            raise NoSystemError("The running system's journal is not on this machine. Name its directory.")
        where = run_dir
    return where / JOURNAL_FILE if where.is_dir() else where


def _facts(identity: Identity, kept: Snapshot, history: Sequence[Record]) -> dict[str, Any]:
    return {
        "robot": identity.robot,
        "skillset": identity.skillset,
        "schema": identity.schema,
        "t": kept.t,
        "step": kept.step,
        "last_token": kept.last_token,
        "resources": {each.resource: {"state": each.state, "record": each.record or None} for each in kept.resources},
        "grants": [
            {
                "goal_id": each.granted.goal_id,
                "skill": each.skill,
                "inputs": each.inputs,
                "manager": each.manager,
                "token": each.granted.token,
            }
            for each in kept.grants
        ],
        "goals": [{"goal_id": each.goal_id, "skill": each.skill, "verdict": each.verdict} for each in kept.goals],
        "history": history,
    }


def _print(console: Console, identity: Identity, kept: Snapshot, history: Sequence[Record]) -> None:
    title = f"{identity.robot or identity.skillset} at {time_text(kept.t)}, after step {kept.step}"
    console.print(Text(title, style="bold"), f"  skillset {identity.skillset}, version {identity.schema}")
    console.print()
    causes = {record.id: record for record in kept.records}
    rows = [(each.resource, state_text(each.state), _of(causes.get(each.record))) for each in kept.resources]
    print_table(console, ("RESOURCE", "STATE", "LAST CHANGE"), rows)
    if kept.grants:
        console.print()
        held = [
            (each.skill, each.granted.goal_id, str(each.granted.token), value_text(dict(each.inputs)))
            for each in kept.grants
        ]
        print_table(console, ("GRANTED", "GOAL", "TOKEN", "INPUTS"), held)
    if kept.goals:
        console.print()
        over = [(each.skill, each.goal_id, _outcome(each.verdict)) for each in kept.goals[-OUTCOMES:]]
        print_table(console, ("OVER", "GOAL", "VERDICT"), over)
    if history:
        console.print()
        print_records(console, history, causes)


def _of(record: Record | None) -> str:
    return "" if record is None else f"{time_text(record.t)}  {record.text}"


def _outcome(verdict: GoalVerdict) -> str:
    match verdict:
        case NotReady(failing=failing):
            return f"not ready: {' '.join(failing.values())}"
        case Violated(invariant=invariant, reason=reason):
            return f"{invariant} violated: {reason}"
        case Lost(reason=reason):
            return f"lost: {reason}"
        case Ended(terminal=Terminal() as outcome):
            return f"{outcome.label}, local outcome of its manager: {outcome.reason}"
        case Ended(held=False, reason=reason):
            return f"ended, but did not hold: {reason}"
        case _:
            return "ended"
