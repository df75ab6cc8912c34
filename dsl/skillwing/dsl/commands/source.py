"""Common steps of commands on a skillset file: read it, show its problems.

Exit codes: 0 no problem, 1 problems were found, 2 wrong usage, such as a missing file.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import typer

from skillwing.dsl.checking.checker import Checked
from skillwing.dsl.diagnostics.diagnostic import render
from skillwing.dsl.text_files import text_in
from skillwing.dsl.whole_files import write_whole

PROBLEMS = 1
MISUSE = 2


STANDARD_INPUT = Path("-")


def folder_named(text: str) -> Path:
    """A folder given by an option. An empty name, as of an unset variable, is rejected."""
    if not text:
        raise typer.BadParameter("it is empty. Name a folder, or `.` for the current one.")
    return Path(text)


class UsageError(Exception):
    """Wrong usage of a command. `str()` is for people: one sentence with the problem, one with the remedy.

    place: the file of the problem, if there is one. problems: the text for each problem, if there are several.
    """

    def __init__(self, text: str, place: str | None = None, problems: Sequence[str] = ()) -> None:
        self.place = place
        self.problems = tuple(problems)
        super().__init__(text)


class UnreadableError(UsageError):
    """A file that cannot be read."""


def read(file: Path) -> str:
    """Read a file, or standard input for `-`, with line feeds as line ends. Raises UnreadableError."""
    try:
        return text_in(sys.stdin.buffer.read() if file == STANDARD_INPUT else file.read_bytes())
    except ValueError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error}. Save it as UTF-8.", str(file)) from None
    except IsADirectoryError:
        raise UnreadableError(f"`{file}` is a folder. Name a file in it.", str(file)) from None
    except OSError as error:
        raise UnreadableError(f"`{file}` cannot be read: {error.strerror}. Name one that can.", str(file)) from error


def usage_error(sentence: str) -> NoReturn:
    """End the command with a UsageError."""
    raise UsageError(sentence)


def show(outcome: Checked, source: str) -> None:
    for diagnostic in outcome.diagnostics:
        headline, _, rest = render(diagnostic, source).partition("\n")
        typer.secho(headline, fg="red" if diagnostic.severity == "error" else "yellow", bold=True)
        typer.echo(f"{rest}\n")


def write(path: Path, text: str, *, make_folder: bool = False) -> None:
    """Write a file whole. End the command on an error: the file of before stays."""
    try:
        if make_folder:
            path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text)
    except OSError as error:
        usage_error(f"`{path}` cannot be written: {error.strerror}.")
