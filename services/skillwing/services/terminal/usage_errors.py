"""Usage errors: a mistyped command line, in sentences like those of all other errors."""

from __future__ import annotations

import re
from typing import Any

from skillwing.dsl.suggest import did_you_mean, listed
from skillwing.services.errors import InvalidOptionError

_QUOTED = r"""'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*\""""
"""A word as the parser quotes it: in Python's notation, with quotes that the word does not contain."""
_NO_COMMAND = re.compile(f"No such command ({_QUOTED})")
_OUT_OF_RANGE = re.compile(
    r"(?P<value>\S+) is not in the range (?:(?P<low>\S+)<=)?x(?:<=(?P<high>\S+)|>=(?P<least>\S+))"
)
"""A number as the parser judges it: with one limit or two."""
_QUOTED_PLACE = re.compile(rf"`[^`]*`|(?<!\w)({_QUOTED})(?!\w)")
"""A quoted word. Text in backticks stays, and an apostrophe within a word is no quote."""


def usage_error(error: Exception, command: str) -> Exception:
    """The error to raise in place of a parser's: InvalidOptionError, or the same error for a request for help.

    command: name of the command, for an error without it. The names of their classes distinguish the parser's errors:
    typer does not export the classes.
    """
    kind = type(error).__name__
    if kind == "NoArgsIsHelpError":
        return error
    context: Any = getattr(error, "ctx", None)
    parameter: Any = getattr(error, "param", None)
    command = command if context is None else context.command_path
    option = str(getattr(error, "option_name", ""))
    message = str(getattr(error, "message", ""))
    said = _plain(message)
    if kind == "MissingParameter" and parameter is not None:
        text = f"`{command}` lacks {_described(parameter)}."
    elif kind == "BadParameter" and parameter is not None:
        text = f"`{_name(parameter)}` of `{command}` does not fit: {said}."
    elif kind == "NoSuchOption" and context is not None:
        text = f"`{command}` has no option `{option}`{did_you_mean(option, _options(context))}"
    elif kind == "BadOptionUsage":
        text = f"`{option}` of `{command}` does not fit: {said}."
    elif (unknown := _NO_COMMAND.match(message)) and context is not None:
        text = unknown_command(unknown[1][1:-1], context.command.list_commands(context), f" of `{command}`")
    else:
        text = f"`{command}` does not fit: {said}."
    return InvalidOptionError(option or str(getattr(parameter, "name", "")), f"{text} See `{command} -h`.")


def unknown_command(word: str, known: list[str], of: str = "") -> str:
    """Sentences about an unknown command. of: its group, as ` of `skillwing demo``; empty at the top."""
    exists = f"What exists: {listed(known, limit=len(known))}."
    return f"There is no command `{word}`{of}{did_you_mean(word, known)} {exists}"


def _plain(said: str) -> str:
    """The parser's message without details for its developers."""
    said = said.removeprefix("Value error, ").partition(", unable to parse")[0]
    if found := _OUT_OF_RANGE.fullmatch(said.rstrip(".")):
        value, low, high, least = (each and each.removesuffix(".0") for each in found.groups())
        limit = f"from {low} to {high}" if low and high else f"at most {high}" if high else f"at least {least}"
        return f"{value} is not {limit}"
    return _QUOTED_PLACE.sub(lambda found: f"`{found[1][1:-1]}`" if found[1] else found[0], said).rstrip(".")


def _described(parameter: Any) -> str:
    """`--skillset FILE` (skillset file)."""
    is_option = parameter.param_type_name == "option"
    value = f" {parameter.metavar}" if is_option and parameter.metavar else ""
    said = str(getattr(parameter, "help", None) or "").rstrip(".")
    return f"`{_name(parameter)}{value}`" + (f" ({said[0].lower()}{said[1:]})" if said else "")


def _name(parameter: Any) -> str:
    """`--speed`, or the metavar of an argument."""
    if parameter.param_type_name == "option":
        return max(parameter.opts, key=len)
    return str(parameter.metavar or parameter.name.upper())


def _options(context: Any) -> list[str]:
    """Long names of the options of a command."""
    return [name for each in context.command.params for name in each.opts if name.startswith("--")]
