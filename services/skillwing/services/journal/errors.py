"""Errors of a journal."""

from __future__ import annotations

from pathlib import Path

from skillwing.services.errors import PassingError, SkillwingError


class JournalError(SkillwingError):
    """Root of these errors. path: of the journal."""

    def __init__(self, path: Path, message: str) -> None:
        self.path = path
        super().__init__(message)


class NoJournalError(JournalError):
    """No journal in that place."""


class JournalRefusedError(JournalError):
    """A file that is damaged, no journal, of another format, robot or skillset. It is left as it is."""


class JournalUnreadableError(JournalError, PassingError):
    """A file that cannot be read now, because it is locked or the disk fails. Its content may be good."""


class JournalWriteError(JournalError, PassingError):
    """A failed write, say on a full disk. The step that was to be written has not happened."""


class JournalTakenError(JournalError):
    """A journal that another process has taken over; this one may not write to it any more."""
