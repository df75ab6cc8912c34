"""Tables of a journal, and checks whether a file may be used."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.journal.errors import JournalRefusedError

FORMAT = 4
"""Format version. Increase it with the protocol version, and for each change that another version cannot read."""
APPLICATION_ID = 0x534B574A
"""`SKWJ`: type of the file, for tools."""
ELSEWHERE = "Name another file, or move this one away to start afresh."

TABLES = """
CREATE TABLE journal (
    robot TEXT, skillset TEXT, schema TEXT, owner INTEGER, last_token INTEGER, step INTEGER, epoch TEXT, t REAL
) STRICT;
CREATE TABLE resources (name TEXT PRIMARY KEY, state TEXT, change_set INTEGER, record TEXT) STRICT;
CREATE TABLE grants (
    n INTEGER PRIMARY KEY, goal_id TEXT UNIQUE, skill TEXT, inputs TEXT, manager TEXT, incarnation TEXT, granted TEXT
) STRICT;
CREATE TABLE goals (n INTEGER PRIMARY KEY, goal_id TEXT, skill TEXT, token INTEGER, bucket TEXT, verdict TEXT) STRICT;
CREATE TABLE managers (n INTEGER PRIMARY KEY, manager TEXT, incarnation TEXT) STRICT;
CREATE TABLE data (name TEXT PRIMARY KEY, value TEXT, t REAL) STRICT;
CREATE TABLE history (n INTEGER PRIMARY KEY, records TEXT) STRICT;
"""


@dataclass(frozen=True, slots=True)
class Identity:
    """Owner of a journal: name of the robot, name of the skillset, and schema hash."""

    robot: str
    skillset: str
    schema: str


def is_empty(connection: sqlite3.Connection) -> bool:
    """True if nothing was ever written to the database."""
    return connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0] == 0


def create(connection: sqlite3.Connection, identity: Identity) -> None:
    """Make the tables, within the transaction that the caller has begun."""
    for statement in TABLES.split(";"):
        connection.execute(statement)
    connection.execute(
        "INSERT INTO journal VALUES (?, ?, ?, 0, 0, 0, '', NULL)", (identity.robot, identity.skillset, identity.schema)
    )
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.execute(f"PRAGMA user_version = {FORMAT}")


def check_form(connection: sqlite3.Connection, path: Path) -> None:
    """Raise JournalRefusedError for a file that is no journal, a damaged one, or one of another format."""
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise JournalRefusedError(path, f"{path} is no journal of a resource manager. {ELSEWHERE}")
    written = connection.execute("PRAGMA user_version").fetchone()[0]
    if written != FORMAT:
        age, remedy = ("a newer", "Upgrade this one") if written > FORMAT else ("an older", "Go on with that one")
        text = f"The journal {path} was written by {age} Skillwing: its format is {written}, this one reads {FORMAT}."
        raise JournalRefusedError(path, f"{text} {remedy}, or move the journal away to start afresh.")
    found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        raise damaged(path, found)


def check_owner(found: Identity, wanted: Identity, path: Path) -> None:
    """Raise JournalRefusedError for the journal of another robot, skillset, or version of the skillset."""
    if found == wanted:
        return
    if found.robot != wanted.robot:
        text = f"The journal {path} is that of the robot `{found.robot}`, and this one is `{wanted.robot}`."
        raise JournalRefusedError(path, f"{text} {ELSEWHERE}")
    if found.skillset != wanted.skillset:
        text = f"The journal {path} is that of the skillset `{found.skillset}`, and this one is `{wanted.skillset}`."
        raise JournalRefusedError(path, f"{text} {ELSEWHERE}")
    raise JournalRefusedError(
        path,
        f"The journal {path} was written with version {found.schema} of the skillset `{found.skillset}`, and this is "
        f"version {wanted.schema}. Go on with the skillset file of then, or move the journal away to start afresh.",
    )


def damaged(path: Path, detail: object) -> JournalRefusedError:
    """The refusal of a file that cannot be read."""
    # SQLite puts a heading such as `*** in database main ***` above what it has found.
    lines = [line for line in str(detail).strip().splitlines() if not line.startswith("***")]
    first = lines[0].rstrip(".") if lines else str(detail).strip()
    text = f"The journal {path} is damaged: {first}. Move it away to start afresh, or put a copy in its place."
    return JournalRefusedError(path, text)
