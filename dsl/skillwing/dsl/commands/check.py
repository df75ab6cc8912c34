"""`skillwing check`: every problem of skillset files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.source import PROBLEMS, read, show
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, summary


def check(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Skillset files.", show_default=False)],
    strict: Annotated[bool, typer.Option("--strict", help="Let warnings fail, too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the problems as JSON.")] = False,
) -> None:
    """Check skillset files and show every problem in them."""
    sources = {file: read(file) for file in files}
    checked = {file: check_source(text, str(file)) for file, text in sources.items()}
    if as_json:
        report = [_as_json(diagnostic) for outcome in checked.values() for diagnostic in outcome.diagnostics]
        typer.echo(msgspec.json.format(msgspec.json.encode(report)).decode())
    else:
        for file, outcome in checked.items():
            show(outcome, sources[file])
            typer.echo(f"{file}: {summary(outcome.diagnostics)}")
    failed = any(outcome.skillset is None or (strict and outcome.diagnostics) for outcome in checked.values())
    raise typer.Exit(PROBLEMS if failed else 0)


def _as_json(diagnostic: Diagnostic) -> dict[str, object]:
    span = diagnostic.span
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "title": diagnostic.title,
        "message": diagnostic.message,
        "help": diagnostic.help,
        "file": span.file,
        "line": span.line,
        "column": span.column,
        "end_line": span.end_line,
        "end_column": span.end_column,
    }
