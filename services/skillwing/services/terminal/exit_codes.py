"""Exit codes, the same for every command, and messages for a user's mistakes."""

from __future__ import annotations

from skillwing.dsl import SkillsetError, UnknownNameError
from skillwing.dsl.commands.source import UsageError
from skillwing.services.disk import FULL, UnwritableError
from skillwing.services.errors import (
    BadRecordingError,
    InvalidInputError,
    InvalidOptionError,
    KeysError,
    NoSystemError,
    NotKnownError,
    RefusedError,
    SeveralSystemsError,
    SkillwingError,
)
from skillwing.services.journal.errors import JournalError
from skillwing.services.protocol import Ending, Terminal

OK = 0
FAILED = 1
"""Exit code: done without success. A goal ended in failure, a process died, or no process answered."""
USAGE = 2
"""Exit code: not done. An unknown name, no name of several systems, a malformed value, or a file of no use."""
NO_SYSTEM = 3
"""Exit code: no running system."""
REFUSED = 4
"""Exit code: refused by the robot. Not validated, not ready, busy, or a transition that is not allowed."""
INTERRUPTED = 130
"""Exit code: ended by Ctrl-C or `kill`, as shells expect."""

_REFUSALS = (Ending.NOT_VALIDATED, Ending.NOT_READY, Ending.BUSY)


def user_message(error: Exception) -> str | None:
    """The message for an error of the user or the robot; None for a fault of the program."""
    match error:
        case SkillwingError() | RefusedError() | SkillsetError() | UnknownNameError() | UsageError():
            return str(error)
        case OSError() if error.errno in FULL:
            where = f"`{error.filename}`" if error.filename is not None else "A file"
            return f"{where} cannot be written: {error.strerror}. Free some room, or name a file on another disk."
        case OSError():
            where = f"`{error.filename}`" if error.filename is not None else "A file or connection"
            return f"{where} cannot be used: {error.strerror or error}. Name one that can."
        case _:
            return None


def exit_code_of(error: Exception) -> int:
    """The exit code of a command that ended with this error."""
    if _disk_is_full(error):
        return FAILED
    match error:
        case SeveralSystemsError():
            return USAGE
        case NoSystemError():
            return NO_SYSTEM
        case RefusedError() | NotKnownError():
            return REFUSED
        case (
            UnknownNameError()
            | KeysError()
            | InvalidInputError()
            | InvalidOptionError()
            | SkillsetError()
            | UsageError()
            | JournalError()
            | BadRecordingError()
            | UnwritableError()
            | OSError()
        ):
            return USAGE
        case _:
            return FAILED


def _disk_is_full(error: Exception) -> bool:
    return (isinstance(error, UnwritableError) and error.full) or (isinstance(error, OSError) and error.errno in FULL)


def exit_code_of_end(terminal: Terminal) -> int:
    """The exit code of a command that waited for the end of a goal."""
    if terminal.ending in _REFUSALS:
        return REFUSED
    return OK if terminal.ending is Ending.SUCCEEDED and terminal.success else FAILED
