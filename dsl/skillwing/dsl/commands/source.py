"""What every command on a skillset file does: read it, show what is wrong with it.

Exit codes: 0 all is well, 1 problems were found, 2 the command itself was wrong (no such file, for instance).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NoReturn

import typer

from skillwing.dsl.checking.checker import Checked
from skillwing.dsl.diagnostics.diagnostic import render
from skillwing.dsl.text_files import text_in

PROBLEMS = 1
MISUSE = 2


STANDARD_INPUT = Path("-")


def folder_named(text: str) -> Path:
    """A folder that an option names; an empty name, as of a variable that is not set, is none."""
    if not text:
        raise typer.BadParameter("it is empty. Name a folder, or `.` for the current one.")
    return Path(text)


class UnreadableError(Exception):
    """A file cannot be read; `str()` is the sentence that says so."""


def read(file: Path) -> str:
    """The text of a file, or of standard input for `-`; line ends become line feeds. Ends the command if it fails."""
    try:
        return text_of(file)
    except UnreadableError as error:
        misuse(str(error))


def text_of(file: Path) -> str:
    """As `read`, for a command that goes on with other files; raises UnreadableError."""
    try:
        return text_in(sys.stdin.buffer.read() if file == STANDARD_INPUT else file.read_bytes())
    except ValueError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error}. Save it as UTF-8.") from None
    except IsADirectoryError:
        raise UnreadableError(f"`{file}` is a folder. Name a file in it.") from None
    except OSError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error.strerror}. Name one that can.") from error


def misuse(sentence: str) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(MISUSE)


def show(outcome: Checked, source: str) -> None:
    for diagnostic in outcome.diagnostics:
        headline, _, rest = render(diagnostic, source).partition("\n")
        typer.secho(headline, fg="red" if diagnostic.severity == "error" else "yellow", bold=True)
        typer.echo(f"{rest}\n")
