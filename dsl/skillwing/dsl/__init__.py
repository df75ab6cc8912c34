"""The skillset language: grammar, model, checker, generator.

Public API: `load` and `parse` turn source into a `Skillset`, and `add_checked` takes one that was checked elsewhere. A
`SkillsetError` holds all problems of a file.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from skillwing.dsl.diagnostics.diagnostic import Diagnostic, SkillsetError
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.dsl.text_files import text_of_file

__all__ = ["Diagnostic", "Skillset", "SkillsetError", "UnknownNameError", "add_checked", "load", "parse"]

INCLUDING = ".rl"
"""End of the names of files that include others."""
_checked_elsewhere: dict[tuple[str, str], Skillset] = {}
"""Skillsets by text and file."""


def load(path: str | Path) -> Skillset:
    """Read a `.skillset` file. Raises OSError if it cannot be read, and SkillsetError if it has errors."""
    file = Path(path)
    return parse(text_of_file(file), str(file))


def parse(text: str, file: str = "<text>") -> Skillset:
    """Turn source text into a skillset. Raises SkillsetError on errors.

    file: its name in diagnostics. Results are cached, because all managers of a robot may run in one process. Those of
    `.rl` files are not, because other files that they include may change.
    """
    if file.endswith(INCLUDING):
        return _parsed.__wrapped__(text, file)
    return _checked_elsewhere.get((text, file)) or _parsed(text, file)


def add_checked(text: str, file: str, skillset: Skillset) -> None:
    """Have `parse` return this skillset for this text, except for an `.rl` file. Another process has checked it.

    This process then loads neither parser nor checker, which is a quarter of the start of a manager.
    """
    _checked_elsewhere[text, file] = skillset


@lru_cache(maxsize=8)
def _parsed(text: str, file: str) -> Skillset:
    from skillwing.dsl.checking.checker import check  # noqa: PLC0415 - who only needs the model does not pay for the parser

    checked = check(text, file)
    if checked.skillset is None:
        raise SkillsetError(checked.diagnostics, text)
    return checked.skillset
