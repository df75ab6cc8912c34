"""Journal that a resource manager writes, and from which its successor continues."""

from __future__ import annotations

import logging
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from itertools import count
from pathlib import Path

import msgspec

from skillwing.services.core.snapshot import Entry, GrantEntry, Snapshot
from skillwing.services.journal.checkpoints import Checkpoints
from skillwing.services.journal.errors import (
    JournalError,
    JournalTakenError,
    JournalUnreadableError,
    JournalWriteError,
    NoJournalError,
)
from skillwing.services.journal.rows import HISTORY_KEPT, insert_entry, insert_records, select_identity, select_snapshot
from skillwing.services.journal.schema import Identity, check_form, check_owner, create, damaged, is_empty
from skillwing.services.protocol import NO_TOKEN, Record

RECORDS_TO_RESUME = 200
"""Number of timeline records that a successor reads."""
ROOM = 4 << 20
"""Bytes reserved at the start, about the final size of a journal, so that a disk that fills up later does no harm."""
PATIENCE = 1.0
"""Seconds to wait for a lock of another process."""
_FILES = ("", "-wal", "-shm")
_MAGIC = b"SQLite format 3\x00"
_PASSING = frozenset(
    {
        sqlite3.SQLITE_BUSY,
        sqlite3.SQLITE_LOCKED,
        sqlite3.SQLITE_NOMEM,
        sqlite3.SQLITE_IOERR,
        sqlite3.SQLITE_FULL,
        sqlite3.SQLITE_CANTOPEN,
        sqlite3.SQLITE_PROTOCOL,
    }
)
"""SQLite errors of a file that may be in good order."""
_NO_ROOM = frozenset({sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR})

log = logging.getLogger(__name__)


class Journal:
    """One resource manager's hold on a journal. A hold that begins later ends this one.

    path: of the file, which is created if missing; None for a journal in memory. durable: safe from power loss too, at
    the price of an fsync for each change. Otherwise the journal is safe from the death of the process only.

    Raises JournalRefusedError for a file that may not be used, JournalUnreadableError and JournalWriteError if the file
    cannot be read or written now.
    """

    def __init__(self, path: Path | None, identity: Identity, *, durable: bool = False) -> None:
        self.path = path or Path(":memory:")
        self._on_disk = path is not None
        self._identity = identity
        self._durable = durable
        self._checkpoints = Checkpoints(self.path) if self._on_disk else None
        self._connection = self._open()

    def snapshot(self) -> Snapshot | None:
        """Sum of all entries so far; None for an empty journal.

        Raises JournalRefusedError and JournalUnreadableError.
        """
        with _reading(self.path):
            return select_snapshot(self._connection, RECORDS_TO_RESUME)

    def begin_epoch(self, epoch: str) -> None:
        """Name the series of the numbers of steps that are written from now on.

        Raises JournalWriteError and JournalTakenError; then nothing is written.
        """
        self._check_place()
        with self._writing():
            renamed = self._connection.execute("UPDATE journal SET epoch = ? WHERE owner = ?", (epoch, self._owner))
        if not renamed.rowcount:
            raise self._taken()

    def write(self, entries: Sequence[Entry], records: Sequence[Record], now: float, step: int) -> None:
        """Write the entries of a step, its timeline records and its number, all or nothing.

        Raises JournalWriteError and JournalTakenError; then nothing is written.
        """
        self._check_place()
        with self._writing():
            try:
                self._write(entries, records, now, step)
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode & 0xFF not in _NO_ROOM:
                    raise
                # The log has grown while no checkpoint was complete. It fits into the reserved room if it begins again.
                self._restart_log()
                self._write(entries, records, now, step)
        if self._checkpoints is not None:
            self._checkpoints.note_write()

    def check_hold(self) -> None:
        """Raise an error unless this hold still stands.

        JournalTakenError: it has ended. JournalUnreadableError: that is unknown. JournalWriteError: the file is
        no longer in its place.
        """
        self._check_place()
        with _reading(self.path):
            (owner,) = self._connection.execute("SELECT owner FROM journal").fetchone()
        if owner != self._owner:
            raise self._taken()

    def set_aside(self) -> Path | None:
        """Begin again with a journal that holds the last token and step only. Returns the new path of the old one.

        Returns None for a journal in memory. Raises JournalRefusedError, JournalUnreadableError and JournalWriteError.
        """
        with _reading(self.path):
            numbers = self._connection.execute("SELECT last_token, step FROM journal").fetchone()
        self.close()
        with self._writing():
            moved = set_aside(self.path)
        self._connection = self._open()
        with self._writing():
            self._connection.execute("UPDATE journal SET last_token = ?, step = ?", numbers)
        return moved

    def close(self) -> None:
        """Idempotent."""
        if self._checkpoints is not None:
            self._checkpoints.finish()
        self._connection.close()

    def _write(self, entries: Sequence[Entry], records: Sequence[Record], now: float, step: int) -> None:
        connection = self._connection
        token = max((each.granted.token for each in entries if isinstance(each, GrantEntry)), default=NO_TOKEN)
        with _transaction(connection):
            update = "UPDATE journal SET t = ?, step = ?, last_token = max(last_token, ?) WHERE owner = ?"
            if not connection.execute(update, (now, step, token, self._owner)).rowcount:
                raise self._taken()
            for entry in entries:
                insert_entry(connection, entry)
            if records:
                insert_records(connection, records)

    def _restart_log(self) -> None:
        if self._checkpoints is not None:
            self._checkpoints.finish()
        self._connection.execute("PRAGMA wal_checkpoint(RESTART)")

    def _check_place(self) -> None:
        """Raise JournalWriteError if the file was deleted or moved: no successor would read what is written to it."""
        if self._on_disk and _file_at(self.path) != self._file:
            text = f"The journal {self.path} was deleted or moved away. Move it back, or restart the system without it."
            raise JournalWriteError(self.path, text)

    def _open(self) -> sqlite3.Connection:
        try:
            connection = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
        except sqlite3.OperationalError as error:
            raise self._unwritten(error) from error
        try:
            with _reading(self.path):
                if not is_empty(connection):
                    check_form(connection, self.path)
                    check_owner(select_identity(connection), self._identity, self.path)
            self._configure(connection)
            self._file = _file_at(self.path) if self._on_disk else None
            return connection
        except BaseException:
            connection.close()
            raise

    def _configure(self, connection: sqlite3.Connection) -> None:
        """Configure SQLite, create missing tables, and take the journal over from earlier holds."""
        with self._writing():
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute(f"PRAGMA synchronous = {'FULL' if self._durable else 'NORMAL'}")
            with _transaction(connection):
                if is_empty(connection):
                    create(connection, self._identity)
                    if self._on_disk:
                        _take_room(connection)
                (self._owner,) = connection.execute("UPDATE journal SET owner = owner + 1 RETURNING owner").fetchone()

    def _taken(self) -> JournalTakenError:
        return JournalTakenError(self.path, f"Another process goes on from the journal {self.path}. End this one.")

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn errors of SQLite and of the disk into JournalWriteError."""
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            raise self._unwritten(error) from error

    def _unwritten(self, error: sqlite3.Error | OSError) -> JournalWriteError:
        text = (
            f"The journal {self.path} cannot be written: {error}. Make room on its disk, and see who may write there."
        )
        return JournalWriteError(self.path, text)


def _file_at(path: Path) -> tuple[int, int] | None:
    """Identity of the file, whatever its name; None if there is no file."""
    try:
        found = os.stat(path)  # noqa: PTH116 - `Path.stat` takes three times as long in a process that was idle
    except OSError:
        return None
    return found.st_dev, found.st_ino


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit all writes of the body, or none."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def _take_room(connection: sqlite3.Connection) -> None:
    connection.execute("CREATE TABLE room (bytes BLOB)")
    connection.execute("INSERT INTO room VALUES (zeroblob(?))", (ROOM,))
    connection.execute("DROP TABLE room")


def look_into(path: Path) -> tuple[Identity, Snapshot]:
    """Owner and content of a journal, with all of its history, also while it is written to.

    Raises NoJournalError, JournalRefusedError and JournalUnreadableError.
    """
    if not path.is_file():
        raise NoJournalError(path, f"There is no journal at {path}. Name a run's directory or a journal file.")
    if not _is_database(path):
        raise NoJournalError(path, f"{path} is no journal. Name a run's directory or a journal file.")
    with _reading(path), closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as connection:
        if is_empty(connection):
            raise NoJournalError(path, f"Nothing has been written to {path} yet.")
        check_form(connection, path)
        # One transaction, for the journal may be written to while it is read.
        connection.execute("BEGIN")
        kept = select_snapshot(connection, HISTORY_KEPT)
        if kept is None:
            raise NoJournalError(path, f"Nothing has been written to {path} yet.")
        return select_identity(connection), kept


def _is_database(path: Path) -> bool:
    """False for a file of another kind, named by mistake; true for a journal, even a damaged one."""
    with path.open("rb") as file:
        return file.read(len(_MAGIC)) in (_MAGIC, b"")


def set_aside(path: Path) -> Path | None:
    """Rename a journal to `journal-1.sqlite` or the next number that is free; returns that, None if there is none."""
    if not path.exists():
        return None
    target = next(
        candidate
        for number in count(1)
        if not (candidate := path.with_name(f"{path.stem}-{number}{path.suffix}")).exists()
    )
    for ending in reversed(_FILES):
        file = Path(f"{path}{ending}")
        if file.exists():
            file.rename(f"{target}{ending}")
    return target


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and msgspec into JournalRefusedError or JournalUnreadableError."""
    try:
        yield
    except JournalError:
        raise
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF not in _PASSING:
            raise damaged(path, error) from error
        text = f"The journal {path} cannot be read now: {error}. See who else has it open, and whether its disk works."
        raise JournalUnreadableError(path, text) from error
    except (sqlite3.DatabaseError, msgspec.MsgspecError, TypeError, ValueError) as error:
        raise damaged(path, error) from error
