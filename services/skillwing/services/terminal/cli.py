"""The command `skillwing`.

Each command is an entry point of the group `skillwing.commands`: its name, and `module:function` (or a `typer.Typer`
for a command with commands of its own). Only the module of the command that is called is imported, and for a list of
all commands none: what they do is read from their sources.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from pathlib import Path
from typing import Annotated, Any, NoReturn, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

COMMANDS = "skillwing.commands"
LONGEST_SENTENCE = 200
"""Letters of the sentence about a command in a list of all."""
_Misuse = cast("type[Exception]", typer.BadParameter.__bases__[0])
"""What the parser raises for a mistyped command line; typer has a name for one kind of it only."""
INTERRUPTED = 130
"""What a shell expects of a command that Ctrl-C or `kill` has ended."""


class LazyGroup(TyperGroup):
    """A group whose commands are entry points."""

    _listing = False

    def make_context(self, info_name: Any, *args: Any, **settings: Any) -> Any:
        with _misuse_told(lambda: str(info_name)):
            return super().make_context(info_name, *args, **settings)

    def invoke(self, ctx: Any) -> Any:
        with _misuse_told(lambda: f"{ctx.command_path} {ctx.invoked_subcommand}"):
            return super().invoke(ctx)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        with self._only_listing():
            super().format_help(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Each command with the whole first sentence of what it says of itself, on as many lines as that takes."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(LONGEST_SENTENCE)) for name, command in commands])

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        with self._only_listing():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _only_listing(self) -> Iterator[None]:
        """Meanwhile commands are got for their names and what they say of themselves, not to be run."""
        self._listing = True
        try:
            yield
        finally:
            self._listing = False

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(_entries().names)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command; raises InvalidOptionError, which says what there is."""
        if cmd_name in _entries().names:
            entry = _entries()[cmd_name]
            return (_announced(entry) if self._listing else None) or _command(entry)
        if ctx.resilient_parsing:
            return None
        from skillwing.dsl.suggest import closest, listed  # noqa: PLC0415 - needed for a slip of the user only
        from skillwing.services.errors import InvalidOptionError  # noqa: PLC0415

        known = self.list_commands(ctx)
        guess = closest(cmd_name, known)
        hint = f"; did you mean `{guess}`?" if guess else "."
        # All of them: who does not know a command's name finds it nowhere else.
        text = f"There is no command `{cmd_name}`{hint} What exists: {listed(known, limit=len(known))}."
        raise InvalidOptionError("command", text)


@contextmanager
def _misuse_told(command: Callable[[], str]) -> Iterator[None]:
    """Let a mistyped command line be told as every other mistake is. command: which it is, once it is known."""
    try:
        yield
    except _Misuse as error:
        from skillwing.services.terminal.usage_errors import usage_error  # noqa: PLC0415 - needed for a slip of the user only

        instead = usage_error(error, command())
        raise instead from (None if instead is error else error)


@cache
def _entries() -> EntryPoints:
    """The commands, asked for once: it takes reading what every installed package says of itself."""
    return entry_points(group=COMMANDS)


def _announced(entry: EntryPoint) -> Any:
    """A command that knows its name and its docstring; None where its source does not tell."""
    try:
        tree = ast.parse(_source(entry.module))
    except (OSError, SyntaxError):
        return None
    for node in tree.body:
        match node:
            case ast.FunctionDef(name=entry.attr) if text := ast.get_docstring(node):
                return TyperCommand(name=entry.name, help=text)
            case ast.Assign(targets=[ast.Name(id=entry.attr)], value=ast.Call(keywords=words)):
                for word in words:
                    if word.arg == "help" and isinstance(word.value, ast.Constant):
                        return TyperCommand(name=entry.name, help=str(word.value.value))
            case _:
                pass
    return None


def _source(module: str) -> str:
    """The text of a module, which is not imported, nor are the packages around it; empty where it is not found."""
    names, place, origin = module.split("."), None, None
    for end in range(1, len(names) + 1):
        spec = PathFinder.find_spec(".".join(names[:end]), place)
        if spec is None:
            return ""
        place, origin = spec.submodule_search_locations, spec.origin
    return Path(origin).read_text(encoding="utf-8") if origin else ""


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
    _reflow(command)
    return command


def _reflow(command: Any) -> None:
    """Let paragraphs of the help fill the terminal's width, not that of the source."""
    if command.help:
        paragraphs = inspect.cleandoc(command.help).split("\n\n")
        command.help = "\n\n".join(" ".join(each.split()) for each in paragraphs)
    for each in getattr(command, "commands", {}).values():
        _reflow(each)


def _unavailable(name: str, error: ImportError) -> Any:
    def explain(words: Annotated[list[str] | None, typer.Argument(hidden=True)] = None) -> NoReturn:
        from skillwing.services.errors import SkillwingError  # noqa: PLC0415 - needed for what is missing only

        del words
        raise SkillwingError(f"`skillwing {name}` cannot be loaded: {error}. Install `skillwing[all]`.")

    explain.__doc__ = f"(not available here: {error})"
    return explain


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    # Rich takes longer to load than all the rest of a list of commands. Each command's own help has it.
    rich_markup_mode=None,
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
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except Exception as error:
        from skillwing.services.terminal.exit_codes import (  # noqa: PLC0415 - needed where it fails only
            exit_code_of,
            user_message,
        )

        if (sentence := user_message(error)) is None:
            raise
        sys.stderr.write(f"{sentence}\n")
        sys.exit(exit_code_of(error))


if __name__ == "__main__":
    main()
