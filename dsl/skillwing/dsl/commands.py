"""The language's commands: `skillwing check` and `skillwing generate`.

Exit codes: 0 all is well, 1 problems were found, 2 the command itself was wrong (no such file, for instance).
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NoReturn

import msgspec
import typer

from skillwing.dsl.checker import Checked
from skillwing.dsl.checker import check as check_source
from skillwing.dsl.diagnostics import Diagnostic, render, summary
from skillwing.dsl.generator import foreign, outdated, write
from skillwing.dsl.generator import generate as generate_modules

PROBLEMS = 1
MISUSE = 2


def check(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Skillset files.", show_default=False)],
    strict: Annotated[bool, typer.Option("--strict", help="Let warnings fail, too.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the problems as JSON.")] = False,
) -> None:
    """Check skillset files and show every problem in them."""
    sources = {file: _read(file) for file in files}
    checked = {file: check_source(text, str(file)) for file, text in sources.items()}
    if as_json:
        report = [_as_json(diagnostic) for outcome in checked.values() for diagnostic in outcome.diagnostics]
        typer.echo(msgspec.json.format(msgspec.json.encode(report)).decode())
    else:
        for file, outcome in checked.items():
            _show(outcome, sources[file])
            typer.echo(f"{file}: {summary(outcome.diagnostics)}")
    failed = any(outcome.skillset is None or (strict and outcome.diagnostics) for outcome in checked.values())
    raise typer.Exit(PROBLEMS if failed else 0)


def generate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset file.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Directory of the package.", show_default=False)],
    check_only: Annotated[
        bool, typer.Option("--check", help="Write nothing; fail if the directory is not up to date.")
    ] = False,
) -> None:
    """Generate the Python package of a skillset: types, manager classes, client."""
    source = _read(file)
    outcome = check_source(source, str(file))
    if outcome.skillset is None:
        _show(outcome, source)
        typer.echo(f"{file}: {summary(outcome.diagnostics)}; nothing was generated.")
        raise typer.Exit(PROBLEMS)
    modules = generate_modules(outcome.skillset, file.name)
    if not check_only:
        try:
            if theirs := foreign(modules, output):
                _misuse(f"`{theirs[0]}` was not generated and would be overwritten. Choose another directory.")
            write(modules, output)
        except OSError as error:
            _misuse(f"`{output}` cannot be written: {error.strerror}.")
        typer.echo(f"{output}: {len(modules)} files from {file}.")
        return
    stale = outdated(modules, output)
    for path in stale:
        typer.echo(f"{path} is not what {file} generates; run `skillwing generate {file} -o {output}`.")
    if not stale:
        typer.echo(f"{output}: up to date.")
    raise typer.Exit(PROBLEMS if stale else 0)


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        _misuse(f"`{file}` is not a text file in UTF-8.")
    except OSError as error:
        _misuse(f"`{file}` cannot be read: {error.strerror}.")


def _misuse(sentence: str) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(MISUSE)


def _show(outcome: Checked, source: str) -> None:
    for diagnostic in outcome.diagnostics:
        headline, _, rest = render(diagnostic, source).partition("\n")
        typer.secho(headline, fg="red" if diagnostic.severity == "error" else "yellow", bold=True)
        typer.echo(f"{rest}\n")


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
