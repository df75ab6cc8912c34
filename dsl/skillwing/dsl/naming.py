"""Names that follow from names of the language: of Python, and of the files beside a skillset."""

from __future__ import annotations

import keyword
from pathlib import Path

# Names that generated annotations, classes and methods need for themselves.
_TAKEN = frozenset({"self", "bool", "float", "int", "list", "str", "mro", "msgspec"})


def class_name(name: str) -> str:
    """`goto_straight` becomes `GotoStraight`; existing capitals stay."""
    return "".join(piece[:1].upper() + piece[1:] for piece in name.split("_"))


def is_usable(name: str) -> bool:
    """True if generated code can use the name as a field, a parameter, a method and an enum member."""
    return not (name.startswith("_") or keyword.iskeyword(name) or name in _TAKEN)


def manager_class(skill: str) -> str:
    """The class with the hooks of a skill, in the module of the skill's name."""
    return f"{class_name(skill)}Manager"


def script_of(skillset: Path) -> Path:
    """The script of the mocks beside a skillset file, `rover.mock.toml`, whether it exists or not."""
    return skillset.with_suffix(".mock.toml")
