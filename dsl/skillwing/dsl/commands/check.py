"""`skillwing check`: every problem of skillset files."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.source import PROBLEMS, STANDARD_INPUT, UnreadableError, read, show, usage_error
from skillwing.dsl.diagnostics.codes import CODES, page_on
from skillwing.dsl.diagnostics.diagnostic import Diagnostic, summary
from skillwing.dsl.diagnostics.sarif import sarif_log
from skillwing.dsl.suggest import closest


class ReportFormat(StrEnum):
    """Output format of problems."""

    TEXT = "text"
    JSON = "json"
    SARIF = "sarif"


def check(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE", help="Skillset files; `-` for standard input.", show_default=False),
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Let warnings fail, too.")] = False,
    form: Annotated[ReportFormat, typer.Option("--format", help="How to print the problems.")] = ReportFormat.TEXT,
    as_json: Annotated[bool, typer.Option("--json", help="Short for `--format json`.")] = False,
    explain: Annotated[
        str | None, typer.Option("--explain", metavar="CODE", help="Show the page on a code, such as SW042.")
    ] = None,
) -> None:
    """Check skillset files and show all their problems. See docs/errors/README.md."""
    if explain is not None:
        _explain(explain)
        return
    if not files:
        usage_error("Name the files to check, or `-` for standard input.")
    sources, unreadable = _read(files)
    checked = {name: check_source(text, name) for name, text in sources.items()}
    found = [diagnostic for outcome in checked.values() for diagnostic in outcome.diagnostics]
    match ReportFormat.JSON if as_json else form:
        case ReportFormat.JSON:
            _print_json([_as_json(diagnostic) for diagnostic in found])
        case ReportFormat.SARIF:
            _print_json(sarif_log(found, version("skillwing"), page_on))
        case ReportFormat.TEXT:
            for name, outcome in checked.items():
                show(outcome, sources[name])
                typer.echo(f"{name}: {summary(outcome.diagnostics)}")
                if not outcome.exact:
                    typer.echo(f"{name}: {_NOT_EXACT}")
            _point_to_pages(found)
    if unreadable:
        raise _together(unreadable)
    failed = any(outcome.skillset is None or (strict and outcome.diagnostics) for outcome in checked.values())
    raise typer.Exit(PROBLEMS if failed else 0)


_NOT_EXACT = "too large to be played through: states of *several* resources that never come together may be missed."


def _read(files: Sequence[Path]) -> tuple[dict[str, str], list[UnreadableError]]:
    """The texts of the readable files, by name, and an error for each other file."""
    sources: dict[str, str] = {}
    unreadable: list[UnreadableError] = []
    for file in files:
        try:
            sources[_name(file)] = read(file)
        except UnreadableError as error:
            unreadable.append(error)
    return sources, unreadable


def _together(errors: Sequence[UnreadableError]) -> UnreadableError:
    """One error for several files."""
    if len(errors) == 1:
        return errors[0]
    texts = [str(error) for error in errors]
    return UnreadableError("\n".join(texts), errors[0].place, texts)


def _name(file: Path) -> str:
    return "<stdin>" if file == STANDARD_INPUT else str(file)


def _point_to_pages(found: Sequence[Diagnostic]) -> None:
    if found:
        typer.echo(f"More on a code: `skillwing check --explain {found[0].code}`.")


def _explain(code: str) -> None:
    name = code.upper()
    if name not in CODES:
        guess = closest(name, CODES)
        advice = f"Did you mean `{guess}`?" if guess else "docs/errors lists them; they look like `SW042`."
        usage_error(f"There is no code `{code}`. {advice}")
    from rich.console import Console  # noqa: PLC0415 - slow to import, and only wanted here
    from rich.markdown import Markdown  # noqa: PLC0415

    page = page_on(name)
    console = Console()
    if console.is_terminal:
        console.print(Markdown(page))
    else:
        typer.echo(page, nl=False)


def _print_json(value: object) -> None:
    typer.echo(msgspec.json.format(msgspec.json.encode(value)).decode())


def _as_json(diagnostic: Diagnostic) -> dict[str, object]:
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "title": diagnostic.title,
        "message": diagnostic.message,
        "help": diagnostic.help,
        **diagnostic.span._asdict(),
        "related": diagnostic.related and {"message": diagnostic.related[1], **diagnostic.related[0]._asdict()},
    }
