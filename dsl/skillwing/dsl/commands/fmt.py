"""`skillwing fmt`: skillset files in one style."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl.commands.source import PROBLEMS, STANDARD_INPUT, read, write
from skillwing.dsl.printing.formatting import UnformattableError, format_source

_COLOURS = {"+": "green", "-": "red", "@": "cyan"}


def fmt(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="Skillset files; `-` is standard input.", show_default=False),
    ],
    check: Annotated[bool, typer.Option("--check", help="Write nothing; fail if a file is not in the style.")] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Write nothing; show what would change.")] = False,
) -> None:
    """Format skillset files in the one style. Their meaning and all comments stay. See docs/tools.md."""
    sources = {file: read(file) for file in files}
    failed = False
    for file, source in sources.items():
        try:
            formatted = format_source(source, str(file))
        except UnformattableError as error:
            typer.echo(f"{error} It was left as it is.", err=True)
            failed = True
            continue
        changes = formatted != source
        failed |= changes and (check or diff)
        if diff:
            _show_changes(file, source, formatted)
        elif check and changes:
            typer.echo(f"{file} is not in the style; run `skillwing fmt {file}`.")
        elif check:
            continue
        elif file == STANDARD_INPUT:
            typer.echo(formatted, nl=False)
        elif changes:
            write(file, formatted)
            typer.echo(f"{file}: formatted.")
    raise typer.Exit(PROBLEMS if failed else 0)


def _show_changes(file: Path, source: str, formatted: str) -> None:
    before, after = source.splitlines(), formatted.splitlines()
    for line in difflib.unified_diff(before, after, str(file), f"{file} (formatted)", lineterm=""):
        typer.secho(line, fg=_COLOURS.get(line[:1]))
