"""What a command that runs a system is told of the journal."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.services.errors import InvalidOptionError
from skillwing.services.journal.journal import set_aside
from skillwing.services.names import JOURNAL_FILE

ResumeOption = Annotated[bool, typer.Option("--resume", help="Go on from the journal in --run-dir.")]
DurableOption = Annotated[
    bool, typer.Option("--durable", help="Keep the journal safe from power loss: an fsync for each change.")
]


def make_room_for_journal(run_dir: Path, *, resume: bool) -> None:
    """Set the journal of an earlier run aside, or make sure that there is one to go on from.

    Raises InvalidOptionError.
    """
    journal = run_dir / JOURNAL_FILE
    if not resume:
        set_aside(journal)
    elif not journal.is_file():
        text = f"There is no journal in {run_dir} to go on from. Name the directory of a run with --run-dir."
        raise InvalidOptionError("resume", text)


def journal_words(*, resume: bool, durable: bool) -> list[str]:
    """These options as a command line says them."""
    return [*(["--resume"] if resume else []), *(["--durable"] if durable else [])]
