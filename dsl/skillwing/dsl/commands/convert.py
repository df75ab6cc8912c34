"""`skillwing convert`: a skillset of any dialect in the skillset language."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.source import PROBLEMS, read, show, usage_error, write
from skillwing.dsl.diagnostics.diagnostic import summary
from skillwing.dsl.printing.formatting import UnformattableError
from skillwing.dsl.printing.source import to_source


def convert(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Skillset file, for instance NAME.rl.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Where to write; default standard output.", show_default=False
        ),
    ] = None,
) -> None:
    """Write a skillset in the skillset language, with the same meaning and without its comments. See docs/onera.md.

    Exit codes: 0 written, 1 the file has errors, 2 a file cannot be read or written.
    """
    source = read(file)
    outcome = check_source(source, str(file))
    if outcome.skillset is None:
        show(outcome, source)
        typer.echo(f"{file}: {summary(outcome.diagnostics)}; nothing was written.")
        raise typer.Exit(PROBLEMS)
    try:
        text = to_source(outcome.skillset)
    except UnformattableError:
        usage_error(f"`{file}` uses a word of the skillset language as a name where that is ambiguous. Rename it.")
    if output is None:
        typer.echo(text, nl=False)
        return
    if output.exists():
        usage_error(f"`{output}` exists. Choose another file, or remove it first.")
    write(output, text)
    typer.echo(f"{output}: written from {file}.")
