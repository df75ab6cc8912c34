"""The command `skillwing`.

Each file of `services/commands/` is a command: a function with the name of the file. Other packages declare theirs as
entry points of the group `skillwing.commands`: a name, and `module:function`, or a `typer.Typer` for subcommands. Only
the module of the command that runs is imported. A list of all commands imports none: it reads their sources.
"""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from typing import Annotated, Any, NoReturn, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

GROUP = "skillwing.commands"
OWN_COMMANDS = "skillwing.services.commands"
JSON_OPTION = "--json"
LONGEST_SENTENCE = 200
"""Letters of the sentence on a command in the list of all."""
_UsageError = cast("type[Exception]", typer.BadParameter.__bases__[0])
"""Base class of the parser's errors; typer exports only some of them."""


class LazyGroup(TyperGroup):
    """The group of all commands; it loads a command when it runs."""

    _listing = False

    def make_context(self, info_name: Any, *args: Any, **settings: Any) -> Any:
        with _usage_errors(lambda: str(info_name)):
            return super().make_context(info_name, *args, **settings)

    def invoke(self, ctx: Any) -> Any:
        with _usage_errors(lambda: f"{ctx.command_path} {ctx.invoked_subcommand}"):
            return super().invoke(ctx)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        with self._only_listing():
            super().format_help(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Each command with the whole first sentence of its help, on as many lines as needed."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.get_short_help_str(LONGEST_SENTENCE)) for name, command in commands])

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        with self._only_listing():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _only_listing(self) -> Iterator[None]:
        """Meanwhile `get_command` returns names and help, and imports no command."""
        self._listing = True
        try:
            yield
        finally:
            self._listing = False

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(command_entries())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command; raises InvalidOptionError, which names all commands."""
        entry = command_entries().get(cmd_name)
        if entry is not None:
            return (_described(entry) if self._listing else None) or _loaded(entry)
        if ctx.resilient_parsing:
            return None
        from skillwing.services.errors import InvalidOptionError  # noqa: PLC0415 - needed for a wrong name only
        from skillwing.services.terminal.usage_errors import unknown_command  # noqa: PLC0415

        if (folder := _declaring_folder(cmd_name)) is not None:
            text = f"`skillwing {cmd_name}` is declared in {folder}/pyproject.toml and not installed yet."
            text = f"{text} Install it: `make setup` in that folder, or `pip install --editable {folder}`."
            raise InvalidOptionError("command", text)
        raise InvalidOptionError("command", unknown_command(cmd_name, self.list_commands(ctx)))


@contextmanager
def _usage_errors(command: Callable[[], str]) -> Iterator[None]:
    """Replace the parser's errors by ours. command: the command's name, which is known late."""
    try:
        yield
    except _UsageError as error:
        from skillwing.services.terminal.usage_errors import usage_error  # noqa: PLC0415 - needed for an error only

        instead = usage_error(error, command())
        raise instead from (None if instead is error else error)


@cache
def command_entries() -> dict[str, EntryPoint]:
    """All commands by name. Cached, because `entry_points` reads the metadata of every installed package."""
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    for path in (Path(__file__).parents[1] / "commands").glob("[a-z]*.py"):
        name = path.stem.replace("_", "-")
        entries[name] = EntryPoint(name, f"{OWN_COMMANDS}.{path.stem}:{path.stem}", GROUP)
    return entries


def _declaring_folder(command: str) -> Path | None:
    """The source folder of an editable installation whose pyproject.toml declares a command; None without one."""
    import json  # noqa: PLC0415 - needed for a wrong name only
    import tomllib  # noqa: PLC0415
    from importlib.metadata import distributions  # noqa: PLC0415
    from urllib.request import url2pathname  # noqa: PLC0415

    for found in distributions(name="skillwing"):
        url = json.loads(found.read_text("direct_url.json") or "{}").get("url", "")
        folder = Path(url2pathname(url.removeprefix("file://")))
        if (folder / "pyproject.toml").is_file():
            project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
            if command in project.get("entry-points", {}).get(GROUP, {}):
                return folder
    return None


def _described(entry: EntryPoint) -> Any:
    """A command with just its name and its help; None if its source has no help."""
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
    """The text of a module, found without an import of it or its packages; empty for a module that is missing."""
    names, place, origin = module.split("."), None, None
    for end in range(1, len(names) + 1):
        spec = PathFinder.find_spec(".".join(names[:end]), place)
        if spec is None:
            return ""
        place, origin = spec.submodule_search_locations, spec.origin
    return Path(origin).read_text(encoding="utf-8") if origin else ""


def _loaded(entry: EntryPoint) -> Any:
    """The command of an entry point, or one that names the package it lacks."""
    settings: dict[str, Any] = {}
    try:
        target = entry.load()
    except ImportError as error:
        # It accepts any words, and answers each call with the reason.
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
        from skillwing.services.errors import SkillwingError  # noqa: PLC0415 - needed for an error only

        del words
        raise SkillwingError(f"`skillwing {name}` cannot be loaded: {error}. Install `skillwing[all]`.")

    explain.__doc__ = f"(not available here: {error})"
    return explain


app = typer.Typer(
    cls=LazyGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    # Rich takes longer to load than all the rest of a list of commands. The help of one command uses it.
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Skillwing: skills of an autonomous robot, from its model to the mission.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"skillwing {version('skillwing')}")
        raise typer.Exit


@app.callback()
def root(
    show_version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Callback of the whole program: without it typer would take a single command for it."""


def main() -> None:
    """Run the command line. A user's error is a sentence on standard error and an exit code (docs/cli.md)."""
    try:
        app()
    except (KeyboardInterrupt, Exception) as error:
        from skillwing.services.terminal.exit_codes import (  # noqa: PLC0415 - needed for an error only
            INTERRUPTED,
            exit_code_of,
            user_message,
        )
        from skillwing.services.terminal.robot_option import named_robot, with_robot  # noqa: PLC0415

        if isinstance(error, KeyboardInterrupt):
            sys.exit(INTERRUPTED)
        if (message := user_message(error)) is None:
            raise
        code = exit_code_of(error)
        text = _as_json(error, message, code) if JSON_OPTION in sys.argv else message
        # The parser's errors name the command that was typed, and advise none.
        robot = None if isinstance(error.__cause__, _UsageError) else named_robot(sys.argv[1:])
        sys.stderr.write(f"{with_robot(text, robot)}\n")
        sys.exit(code)


def _as_json(error: Exception, message: str, code: int) -> str:
    """The error in one line of JSON; the message for a `--json` that is no option."""
    import json  # noqa: PLC0415 - needed for an error only

    from skillwing.services.terminal.error_facts import error_facts, wants_json  # noqa: PLC0415

    return json.dumps(error_facts(error, message, code)) if wants_json(sys.argv[1:]) else message


if __name__ == "__main__":
    main()
