"""Entries as rows of a journal's tables, and back."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import Any, TypeVar

import msgspec

from skillwing.services.core.bounded_dict import GOALS_REMEMBERED
from skillwing.services.core.incarnations import INCARNATIONS_REMEMBERED
from skillwing.services.core.snapshot import (
    DatumEntry,
    Entry,
    FinishedGoal,
    GrantEntry,
    HistoryBucket,
    ManagerEntry,
    ResourceEntry,
    Snapshot,
)
from skillwing.services.journal.schema import Identity
from skillwing.services.protocol import GoalVerdict, Granted, Record

HISTORY_KEPT = 5000
"""Timeline records that a journal holds, and those of up to `TRIM_EVERY` more."""
TRIM_EVERY = 100
"""Goals or records between two deletions of the oldest ones; a deletion takes longer than storing a goal."""
_TRIM_GOALS = """
DELETE FROM goals WHERE bucket = :bucket AND n <= (
    SELECT n FROM goals WHERE bucket = :bucket ORDER BY n DESC LIMIT 1 OFFSET :kept
)
"""
MANAGERS_KEPT = 2 * INCARNATIONS_REMEMBERED

T = TypeVar("T")


def insert_entry(connection: sqlite3.Connection, entry: Entry) -> None:
    """Change the tables as the entry says, and delete the oldest rows of those that would grow for ever."""
    execute = connection.execute
    match entry:
        case ResourceEntry():
            row = (entry.resource, entry.state, entry.change_set, entry.record)
            execute("INSERT OR REPLACE INTO resources VALUES (?, ?, ?, ?)", row)
        case GrantEntry(granted=granted):
            row = (granted.goal_id, entry.skill, _text(entry.inputs), entry.manager, entry.incarnation, _text(granted))
            execute("INSERT INTO grants VALUES (NULL, ?, ?, ?, ?, ?, ?)", row)
        case FinishedGoal():
            execute("DELETE FROM grants WHERE goal_id = ?", (entry.goal_id,))
            row = (entry.goal_id, entry.skill, entry.token, entry.bucket, _text(entry.verdict))
            number = execute("INSERT INTO goals VALUES (NULL, ?, ?, ?, ?, ?)", row).lastrowid or 0
            if number % TRIM_EVERY == 0:
                for bucket in HistoryBucket:
                    execute(_TRIM_GOALS, {"bucket": bucket, "kept": GOALS_REMEMBERED})
        case ManagerEntry():
            row = (entry.manager, entry.incarnation)
            number = execute("INSERT INTO managers VALUES (NULL, ?, ?)", row).lastrowid or 0
            execute("DELETE FROM managers WHERE n <= ?", (number - MANAGERS_KEPT,))
        case DatumEntry():
            execute("INSERT OR REPLACE INTO data VALUES (?, ?, ?)", (entry.name, _text(entry.value), entry.t))


def insert_records(connection: sqlite3.Connection, records: Sequence[Record]) -> None:
    """Add the timeline records of a step to the history, and delete the oldest ones of a full history.

    A step is one row. Its number counts records: it is that of the step's last one.
    """
    insert = "INSERT INTO history SELECT coalesce(max(n), 0) + ?, ? FROM history"
    number = connection.execute(insert, (len(records), _text(records))).lastrowid or 0
    if number // TRIM_EVERY != (number - len(records)) // TRIM_EVERY:
        connection.execute("DELETE FROM history WHERE n <= ?", (number - HISTORY_KEPT,))


def select_identity(connection: sqlite3.Connection) -> Identity:
    return Identity(*connection.execute("SELECT robot, skillset, schema FROM journal").fetchone())


def select_snapshot(connection: sqlite3.Connection, records: int) -> Snapshot | None:
    """Snapshot in the tables, with the latest `records` of the history; None if nothing was ever written.

    Raises sqlite3.DatabaseError and msgspec.MsgspecError for content that no journal has.
    """
    select = connection.execute
    last_token, step, epoch, t = select("SELECT last_token, step, epoch, t FROM journal").fetchone()
    if t is None:
        return None
    rows = select("SELECT records FROM history ORDER BY n DESC LIMIT ?", (records,)).fetchall()
    history = [record for (row,) in reversed(rows) for record in _value(row, tuple[Record, ...])]
    return Snapshot(
        resources=tuple(ResourceEntry(*row) for row in select("SELECT * FROM resources")),
        grants=tuple(
            GrantEntry(skill, _value(inputs, dict[str, Any]), manager, incarnation, _value(granted, Granted))
            for skill, inputs, manager, incarnation, granted in select(
                "SELECT skill, inputs, manager, incarnation, granted FROM grants ORDER BY n"
            )
        ),
        goals=tuple(
            FinishedGoal(goal_id, skill, token, _value(verdict, GoalVerdict))
            for goal_id, skill, token, verdict in select("SELECT goal_id, skill, token, verdict FROM goals ORDER BY n")
        ),
        managers=tuple(ManagerEntry(*row) for row in select("SELECT manager, incarnation FROM managers ORDER BY n")),
        data=tuple(DatumEntry(name, _value(value, Any), t) for name, value, t in select("SELECT * FROM data")),
        last_token=last_token,
        step=step,
        epoch=epoch,
        records=tuple(history[-records:]),
        t=t,
    )


def _text(value: object) -> str:
    return msgspec.json.encode(value).decode()


def _value(text: str, kind: Any) -> Any:
    return msgspec.json.decode(text, type=kind)
