"""The command `skillwing`.

Each command is an entry point of the group `skillwing.commands`: its name, and `module:function` (or a `typer.Typer`
for a command with commands of its own). Only the module of the command that is called is imported.
"""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup
from typer.main import get_command

from skillwing.dsl import SkillsetError, UnknownNameError
from skillwing.services.commands.exit_codes import exit_code_of
from skillwing.services.errors import RefusedError, SkillwingError

COMMANDS = "skillwing.commands"
INTERRUPTED = 130
"""What a shell expects of a command that Ctrl-C has ended."""


class LazyGroup(TyperGroup):
    """A group whose commands are entry points."""

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(entry_points(group=COMMANDS).names)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command; raises UnknownNameError, which says what there is."""
        found = entry_points(group=COMMANDS, name=cmd_name)
        if found:
            return _command(next(iter(found)))
        if ctx.resilient_parsing:
            return None
        raise UnknownNameError("command", cmd_name, self.list_commands(ctx))


def _command(entry: EntryPoint) -> Any:
    """The command that an entry point names, or one that says which package it lacks."""
    settings: dict[str, Any] = {}
    try:
        target = entry.load()
    except ImportError as error:
        # It takes any words, to be able to say what is wrong.
        target, settings = _unavailable(entry.name, error), {"ignore_unknown_options": True}
    if isinstance(target, typer.Typer):
        command = get_command(target)
    else:
        single = typer.Typer(add_completion=False)
        single.command(entry.name, context_settings=settings)(target)
        command = get_command(single)
    command.name = entry.name
    return command


def _unavailable(name: str, error: ImportError) -> Any:
    def explain(words: Annotated[list[str] | None, typer.Argument(hidden=True)] = None) -> NoReturn:
        del words
        raise SkillwingError(f"`skillwing {name}` cannot be loaded: {error}. Install `skillwing[all]`.")

    explain.__doc__ = f"(not available here: {error})"
    return explain


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Skillwing: skills of an autonomous robot, from its model to the mission.",
)


@app.callback()
def root() -> None:
    """Without it typer would take a single command for the whole program."""


def main() -> None:
    """Run the command line. A user's mistake is a sentence on standard error and an exit code (docs/cli.md)."""
    try:
        app()
    except (SkillwingError, RefusedError, SkillsetError, UnknownNameError) as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(exit_code_of(error))
    except OSError as error:
        where = f"`{error.filename}`" if error.filename is not None else "A file or connection"
        sys.stderr.write(f"{where} cannot be used: {error.strerror or error}. Name one that can.\n")
        sys.exit(exit_code_of(error))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
