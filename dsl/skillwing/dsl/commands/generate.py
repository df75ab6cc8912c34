"""`skillwing generate`: the Python package of a robot, from its skillset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.source import PROBLEMS, folder_named, read, show, usage_error
from skillwing.dsl.diagnostics.diagnostic import summary
from skillwing.dsl.generating.package import RobotFolder, is_generated, script_copy, skillset_copy
from skillwing.dsl.generating.package import generate as generate_files
from skillwing.dsl.generating.skeletons import skeletons
from skillwing.dsl.model import Skillset
from skillwing.dsl.packages import name_problem


def generate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset file.", show_default=False)],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            parser=folder_named,
            help="Folder of the robot's package.",
            show_default=False,
        ),
    ],
    check_only: Annotated[
        bool, typer.Option("--check", help="Write nothing; fail if DIR/generated is not up to date.")
    ] = False,
    no_skeletons: Annotated[
        bool, typer.Option("--no-skeletons", help="Only DIR/generated; skills without a file get no manager.")
    ] = False,
) -> None:
    """Generate a robot's package: types, managers, clients, mocks and processes from its skillset. See docs/robots.md.

    Each run rewrites DIR/generated. DIR/skills/SKILL.py and DIR/robot.py are written once and then yours.
    """
    source = read(file)
    if is_generated(file):
        usage_error(f"`{file}` is a generated copy. Name the original skillset.")
    outcome = check_source(source, str(file))
    if outcome.skillset is None:
        show(outcome, source)
        typer.echo(f"{file}: {summary(outcome.diagnostics)}; nothing was generated.")
        raise typer.Exit(PROBLEMS)
    if problem := place_problem(output):
        usage_error(problem)
    try:
        if check_only:
            _check(outcome.skillset, file, source, RobotFolder(output))
        else:
            once: Mapping[str, str] = {}
            if not no_skeletons:
                once = skeletons(outcome.skillset, output.resolve().name)
            write_package(outcome.skillset, file, source, RobotFolder(output), once)
    except OSError as error:
        usage_error(f"`{output}` cannot be written: {error.strerror}.")


def write_package(skillset: Skillset, file: Path, source: str, folder: RobotFolder, once: Mapping[str, str]) -> None:
    """Bring a robot's package up to date and print what was written. Raises OSError.

    once: files that are written only if they do not exist, by their path from the package.
    """
    if theirs := folder.foreign(_products(skillset, file, source, folder)):
        usage_error(f"`{theirs[0]}` was not generated and would be overwritten. Choose another directory.")
    fresh = folder.write_once(once)
    products = _products(skillset, file, source, folder)
    folder.write(products)
    typer.echo(f"{folder.generated}: {len(products)} files from {file}.")
    if fresh:
        typer.echo(f"Written once, and yours from now on: {', '.join(str(path) for path in fresh)}.")
    _print_orphans(skillset, file, folder)


def _check(skillset: Skillset, file: Path, source: str, folder: RobotFolder) -> None:
    stale = folder.outdated(_products(skillset, file, source, folder))
    for path in stale:
        typer.echo(f"{path} is not what {file} generates; run `skillwing generate {file} -o {folder.path}`.")
    if not stale:
        typer.echo(f"{folder.generated}: up to date.")
    _print_orphans(skillset, file, folder)
    raise typer.Exit(PROBLEMS if stale else 0)


def _products(skillset: Skillset, file: Path, source: str, folder: RobotFolder) -> dict[str, str]:
    files = generate_files(skillset, file, folder.path, folder.managed(skillset))
    copies = {**skillset_copy(skillset, file, folder.path, source), **script_copy(skillset, file, folder.path)}
    return {**files, **copies}


def _print_orphans(skillset: Skillset, file: Path, folder: RobotFolder) -> None:
    for path in folder.orphans(skillset):
        typer.echo(f"{path} manages a skill that {file} does not have. Remove it, or rename it with its classes.")


def place_problem(output: Path) -> str | None:
    """The reason why a package cannot be written there; None if it can."""
    if is_generated(output / "__init__.py"):
        return f"`{output}` is the generated part of a package. Name the package: `-o {output.parent}`."
    if output.is_file():
        return f"`{output}` is a file. Name the folder of the robot's package."
    return name_problem(output)
