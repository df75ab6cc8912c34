"""`skillwing docs`: the reference page of a skillset."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import parse
from skillwing.dsl.commands.source import PROBLEMS, read, usage_error, write
from skillwing.dsl.printing.reference.page import reference_page


def docs(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset file.", show_default=False)],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="File to write instead of printing.", show_default=False),
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Write nothing; fail if -o is not up to date.")] = False,
) -> None:
    """Write the reference page of a skillset in Markdown. Comments above its elements become descriptions. See
    docs/tools.md."""
    source = read(file)
    page = reference_page(parse(source, str(file)), source, file.name)
    if output is None:
        if check:
            usage_error("`--check` compares with a page that exists. Name it: `--check -o FILE.md`.")
        typer.echo(page, nl=False)
    elif not check:
        write(output, page)
        typer.echo(f"{output}: written from {file}.")
    elif output.is_file() and read(output) == page:
        typer.echo(f"{output}: up to date.")
    else:
        typer.echo(f"{output} is not what {file} says; run `skillwing docs {file} -o {output}`.")
        raise typer.Exit(PROBLEMS)
