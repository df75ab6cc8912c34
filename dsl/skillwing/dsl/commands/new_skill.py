"""`skillwing new-skill`: a new skill, with a manager that rejects its goals, a test, and a to-do list."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl.checking.checker import check as check_source
from skillwing.dsl.commands.generate import place_problem, write_package
from skillwing.dsl.commands.source import PROBLEMS, read, show, usage_error
from skillwing.dsl.diagnostics.diagnostic import has_errors, summary
from skillwing.dsl.generating.new_skill import body_maker, checklist, skill_test, with_skill
from skillwing.dsl.generating.package import RobotFolder, is_generated
from skillwing.dsl.generating.skeletons import skeletons
from skillwing.dsl.model import Skillset
from skillwing.dsl.naming import is_usable
from skillwing.dsl.packages import import_name, project_of, tests_folder
from skillwing.dsl.suggest import closest
from skillwing.dsl.whole_files import write_whole


def new_skill(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the skill.", show_default=False)],
    skillset: Annotated[
        Path, typer.Option("--skillset", "-s", metavar="FILE", help="Skillset file.", show_default=False)
    ],
    robot: Annotated[
        Path | None,
        typer.Option(
            "--robot", "-r", metavar="DIR", help="The robot's package; default the folder of FILE if it is one."
        ),
    ] = None,
    tree: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Tree (.xml, .rlc) over other skills that the skill runs; its ports are inputs."
        ),
    ] = None,
) -> None:
    """Add a skill to a skillset, with its manager and its test, and print what is left to do. See docs/robots.md.

    The file stays valid and keeps its comments. Existing files are not overwritten. Until the manager is written it
    rejects its goals, and the test passes.
    """
    source = read(skillset)
    before = _checked(skillset, source)
    if problem := _name_problem(name, before) or _file_problem(skillset):
        usage_error(problem)
    folder = robot or (skillset.parent if (skillset.parent / "robot.py").is_file() else None)
    if folder is not None and (problem := place_problem(folder) or _robot_problem(folder, skillset)):
        usage_error(problem)
    if tree is not None and folder is None:
        usage_error(f"The manager of a tree needs a robot's package. Make it: `skillwing generate {skillset} -o DIR`.")
    test = Path(f"test_{name}.py")
    body = None if tree is None else body_maker("tree")(tree, name, before)
    extended = with_skill(source, name, str(skillset), None if body is None else body.block)
    outcome = check_source(extended, str(skillset))
    after = outcome.skillset
    if after is None:
        # What the words and classes of the language leave open as a name, only the checker knows.
        first = next(each for each in outcome.diagnostics if has_errors([each]))
        usage_error(f"`{name}` cannot be the name of a skill here: {first.message} Choose another one.")
    own: Mapping[str, str] = {} if body is None else body.files(after, folder)
    try:
        write_whole(skillset, extended)
        typer.echo(f"{skillset}: `{name}` was added.")
        if folder is not None:
            test = tests_folder(folder, [skill.name for skill in before.skills]) / test
            files = {**skeletons(after, folder.resolve().name, skills=[name]), **own}
            package = import_name(folder)[0]
            first_test = skill_test(name, package) if body is None else body.test(package)
            tests = {os.path.relpath(test, folder): first_test}
            if test.is_relative_to(folder):  # a package, so that modules of two robots may have one name
                tests["tests/__init__.py"] = ""
            write_package(after, skillset, extended, RobotFolder(folder), {**files, **tests})
    except OSError as error:
        usage_error(f"`{error.filename}` cannot be written: {error.strerror}.")
    typer.echo("")
    if body is not None and tree is not None:
        file = f"{folder}/skills/{name}{tree.suffix}"
        typer.echo(f"`{name}` runs {file}. Next: its units and ranges in {skillset}, then {test}.")
        return
    for line in checklist(after.skill(name), skillset, folder, test, folder is not None and _makes_all(folder)):
        typer.echo(line)


def _makes_all(folder: Path) -> bool:
    """True if the project has a `make generate`."""
    project = project_of(folder)
    makefile = None if project is None else project / "Makefile"
    return makefile is not None and makefile.is_file() and "\ngenerate:" in makefile.read_text("utf-8")


def _checked(file: Path, source: str) -> Skillset:
    """The skillset before the change. Shows its problems and exits if it has errors."""
    outcome = check_source(source, str(file))
    if outcome.skillset is None:
        show(outcome, source)
        typer.echo(f"{file}: {summary(outcome.diagnostics)}; nothing was added.")
        raise typer.Exit(PROBLEMS)
    return outcome.skillset


def _name_problem(name: str, skillset: Skillset) -> str | None:
    if not name.isidentifier() or not name.isascii():
        return f"`{name}` is no name: write letters, digits and underscores, as in `take_sample`."
    if not is_usable(name):
        return f"`{name}` cannot be used in Python, into which skills are generated. Choose another name."
    if any(skill.name == name for skill in skillset.skills):
        return f"There is a skill `{name}` already. Choose another name, or change that one."
    return None


def _robot_problem(folder: Path, skillset: Path) -> str | None:
    """The problem with a folder that is no robot's package. A new package is made by `skillwing generate`."""
    if RobotFolder(folder).exists:
        return None
    beside = folder.parent.iterdir() if folder.parent.is_dir() else ()
    guess = closest(folder.name, [each.name for each in beside if RobotFolder(each).exists])
    advice = f"Make it: `skillwing generate {skillset} -o {folder}`."
    if guess:
        advice = f"Did you mean `{folder.with_name(guess)}`?"
    return f"There is no robot's package `{folder}`. {advice}"


def _file_problem(file: Path) -> str | None:
    if file.suffix == ".rl":
        return (
            f"`{file}` is in the .rl notation, which is only read. Turn it into the other: `skillwing convert {file}`."
        )
    if is_generated(file):
        return f"`{file}` is a generated copy. Name the original skillset."
    return None
