"""The table of commands in docs/cli.md, written from the commands themselves: `make generate`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from typer.main import get_command

from skillwing.services.terminal import cli
from skillwing.services.terminal.doc_sections import Marks

PAGE = Path(__file__).parents[3] / "docs" / "cli.md"
MARKS = Marks.named("commands")
DOCS = re.compile(r"docs/([\w/-]+\.md)")
LONGEST = 300
"""Letters of a command's first sentence."""


def commands() -> Iterator[tuple[str, Any]]:
    """Every command by its words, subcommands included."""
    group: Any = get_command(cli.app)
    context = typer.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = getattr(command, "commands", {})
        yield from ((f"{name} {each}", inner[each]) for each in inner)
        if not inner:
            yield name, command


def command_table() -> str:
    """A row for each command: its arguments, the first sentence of its help with links to pages, and its options."""
    rows = ["| command | does | options |", "|---|---|---|"]
    for words, command in commands():
        arguments = [_argument(each) for each in command.params if each.param_type_name == "argument"]
        options = [_option(each) for each in command.params if each.param_type_name == "option" and not each.hidden]
        usage = " ".join([words, *filter(None, arguments)]).replace("|", "\\|")
        rows.append(f"| `{usage}` | {_help(command)} | {' '.join(filter(None, options))} |")
    return "\n".join(rows)


def _help(command: Any) -> str:
    sentence = command.get_short_help_str(LONGEST)
    links = [
        f"[{Path(page).stem}]({page})" for page in dict.fromkeys(DOCS.findall(command.help)) if page not in sentence
    ]
    return DOCS.sub(r"[\1](\1)", sentence) + (f" See {', '.join(links)}." if links else "")


def _argument(parameter: Any) -> str:
    if parameter.hidden:
        return ""
    name = parameter.metavar or parameter.name.upper()
    name = name if parameter.required or name.startswith("[") else f"[{name}]"
    return f"{name}..." if parameter.nargs == -1 else name


def _option(parameter: Any) -> str:
    """The option, and for one that is on by default the word that turns it off."""
    words = parameter.secondary_opts if parameter.secondary_opts and parameter.default is True else parameter.opts
    return "" if parameter.name == "help" else f"`{next(word for word in words if word.startswith('--'))}`"


if __name__ == "__main__":
    MARKS.replace(PAGE, command_table())
