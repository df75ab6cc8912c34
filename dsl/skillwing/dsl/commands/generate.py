"""`skillwing generate`: the Python package of a skillset."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.source import PROBLEMS, misuse, read, show
from skillwing.dsl.diagnostics.diagnostic import summary
from skillwing.dsl.generating.package import foreign, outdated, write
from skillwing.dsl.generating.package import generate as generate_modules


def generate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset file.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Directory of the package.", show_default=False)],
    check_only: Annotated[
        bool, typer.Option("--check", help="Write nothing; fail if the directory is not up to date.")
    ] = False,
) -> None:
    """Generate the Python package of a skillset: types, manager classes, client."""
    source = read(file)
    outcome = check_source(source, str(file))
    if outcome.skillset is None:
        show(outcome, source)
        typer.echo(f"{file}: {summary(outcome.diagnostics)}; nothing was generated.")
        raise typer.Exit(PROBLEMS)
    modules = generate_modules(outcome.skillset, file.name)
    if not check_only:
        try:
            if theirs := foreign(modules, output):
                misuse(f"`{theirs[0]}` was not generated and would be overwritten. Choose another directory.")
            write(modules, output)
        except OSError as error:
            misuse(f"`{output}` cannot be written: {error.strerror}.")
        typer.echo(f"{output}: {len(modules)} files from {file}.")
        return
    stale = outdated(modules, output)
    for path in stale:
        typer.echo(f"{path} is not what {file} generates; run `skillwing generate {file} -o {output}`.")
    if not stale:
        typer.echo(f"{output}: up to date.")
    raise typer.Exit(PROBLEMS if stale else 0)
