"""How the command line says that something failed: exit codes, the same for every command, and a user's mistakes."""

from __future__ import annotations

from skillwing.dsl import SkillsetError, UnknownNameError
from skillwing.services.errors import (
    BadRecordingError,
    InvalidInputError,
    InvalidOptionError,
    NoSystemError,
    RefusedError,
    SkillwingError,
)
from skillwing.services.journal.errors import JournalError
from skillwing.services.protocol import Ending, Terminal

OK = 0
FAILED = 1
"""It was done, and did not succeed: a goal ended in failure, a process died, nobody answered."""
USAGE = 2
"""It was not done: an unknown name, a malformed value, a broken file, a place where nothing can be written."""
NO_SYSTEM = 3
"""No system is running."""
REFUSED = 4
"""The robot said no: not validated, not ready, busy, or a transition that is not allowed."""

_REFUSALS = (Ending.NOT_VALIDATED, Ending.NOT_READY, Ending.BUSY)


def sentence_on(error: Exception) -> str | None:
    """What to tell a user whose mistake, or whose robot's, this error is; None for a mistake of ours."""
    match error:
        case SkillwingError() | RefusedError() | SkillsetError() | UnknownNameError():
            return str(error)
        case OSError():
            where = f"`{error.filename}`" if error.filename is not None else "A file or connection"
            return f"{where} cannot be used: {error.strerror or error}. Name one that can."
        case _:
            return None


def exit_code_of(error: Exception) -> int:
    """The exit code of a command that ended with this error."""
    match error:
        case NoSystemError():
            return NO_SYSTEM
        case RefusedError():
            return REFUSED
        case (
            UnknownNameError()
            | InvalidInputError()
            | InvalidOptionError()
            | SkillsetError()
            | JournalError()
            | BadRecordingError()
            | OSError()
        ):
            return USAGE
        case _:
            return FAILED


def exit_code_of_end(terminal: Terminal) -> int:
    """The exit code of a command that waited for a goal which ended so."""
    if terminal.ending in _REFUSALS:
        return REFUSED
    return OK if terminal.ending is Ending.SUCCEEDED and terminal.success else FAILED
