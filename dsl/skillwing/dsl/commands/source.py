"""Common steps of commands on a skillset file: read it, show its problems.

Exit codes: 0 no problem, 1 problems were found, 2 wrong usage, such as a missing file.
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
    """A folder given by an option. An empty name, as of an unset variable, is rejected."""
    if not text:
        raise typer.BadParameter("it is empty. Name a folder, or `.` for the current one.")
    return Path(text)


class UnreadableError(Exception):
    """A file cannot be read. `str()` is a sentence for the user."""


def read(file: Path) -> str:
    """Read a file, or standard input for `-`, with line feeds as line ends. End the command on an error."""
    try:
        return text_of(file)
    except UnreadableError as error:
        usage_error(str(error))


def text_of(file: Path) -> str:
    """Read a file as `read` does, for commands that continue with other files. Raises UnreadableError."""
    try:
        return text_in(sys.stdin.buffer.read() if file == STANDARD_INPUT else file.read_bytes())
    except ValueError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error}. Save it as UTF-8.") from None
    except IsADirectoryError:
        raise UnreadableError(f"`{file}` is a folder. Name a file in it.") from None
    except OSError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error.strerror}. Name one that can.") from error


def usage_error(sentence: str) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(MISUSE)


def show(outcome: Checked, source: str) -> None:
    for diagnostic in outcome.diagnostics:
        headline, _, rest = render(diagnostic, source).partition("\n")
        typer.secho(headline, fg="red" if diagnostic.severity == "error" else "yellow", bold=True)
        typer.echo(f"{rest}\n")


def write(path: Path, text: str, *, make_folder: bool = False) -> None:
    """Write a file. End the command on an error."""
    try:
        if make_folder:
            path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        usage_error(f"`{path}` cannot be written: {error.strerror}.")
