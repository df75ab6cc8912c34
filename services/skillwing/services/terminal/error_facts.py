"""An error of a command as JSON, for a call with `--json`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from skillwing.dsl import SkillsetError
from skillwing.dsl.commands.source import UsageError
from skillwing.services.core.refusal import RefusedError
from skillwing.services.terminal.cli import JSON_OPTION


def wants_json(words: Sequence[str]) -> bool:
    """True if these words of a command line ask for JSON."""
    options = words[: words.index("--")] if "--" in words else words
    return JSON_OPTION in options


def error_facts(error: Exception, message: str, exit_code: int) -> dict[str, Any]:
    """Fields of an error.

    kind: name of its class, as `no_system`. what, remedy: sentences, None for no remedy. place: file, with line and
    column if known, else None. problems: a sentence for each single problem, by its name if it has one.
    """
    what, remedy, place = *_parted(message), None
    problems: Any = getattr(error, "problems", None)
    match error:
        case RefusedError():
            what, remedy = error.message, error.help or None
        case SkillsetError() if error.diagnostics:
            first = next((each for each in error.diagnostics if each.severity == "error"), error.diagnostics[0])
            what, remedy, place = first.message, first.help, str(first.span)
            problems = [f"{each.span}: {each.message}" for each in error.diagnostics]
        case UsageError():
            place = error.place
        case OSError() if error.filename is not None:
            place = str(error.filename)
        case _ if isinstance(problems, Mapping):
            what, remedy = message, None
        case _:
            pass
    facts: dict[str, Any] = {"kind": _kind(error), "what": what, "remedy": remedy, "place": place}
    if problems:
        facts["problems"] = dict(problems) if isinstance(problems, Mapping) else [str(each) for each in problems]
    return {"error": {**facts, "exit_code": exit_code}}


def _kind(error: Exception) -> str:
    """`no_system` for NoSystemError."""
    name = type(error).__name__.removesuffix("Error")
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


def _parted(message: str) -> tuple[str, str | None]:
    """The sentences on the problem, and the last one on the remedy. A text in backticks is never parted."""
    line, quoted, end = message.partition("\n")[0], False, 0
    for place, letter in enumerate(line[:-1]):
        if letter == "`":
            quoted = not quoted
        elif letter in ".?" and line[place + 1] == " " and not quoted:
            end = place + 1
    return (line[:end], line[end + 1 :]) if end else (line, None)
