"""What can be wrong with a journal."""

from __future__ import annotations

from pathlib import Path

from skillwing.services.errors import PassingError, SkillwingError


class JournalError(SkillwingError):
    """Root of these errors. path: of the journal."""

    def __init__(self, path: Path, message: str) -> None:
        self.path = path
        super().__init__(message)


class NoJournalError(JournalError):
    """There is no journal in that place."""


class JournalRefusedError(JournalError):
    """The file is damaged, no journal, too new, or that of another robot or skillset. It is left as it is."""


class JournalUnreadableError(JournalError, PassingError):
    """It cannot be read just now: somebody has it locked, or the disk fails. Nothing is said about what is in it."""


class JournalWriteError(JournalError, PassingError):
    """Nothing can be written, for the disk is full, say. What was to be written has not happened."""


class JournalTakenError(JournalError):
    """Another process goes on from this journal, and this one may not write to it any more."""
