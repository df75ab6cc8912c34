"""What is wrong in a tree file, and where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.errors import SkillwingError


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """line: counted from 1, 0 for the file as a whole; text: what is wrong and what to do."""

    line: int
    text: str

    def __str__(self) -> str:
        return f"line {self.line}: {self.text}" if self.line else self.text


class TreeFileError(SkillwingError):
    """A tree file that cannot be flown. file: which; problems: all that was found, by line."""

    def __init__(self, file: Path, problems: Iterable[Problem]) -> None:
        self.file = file
        self.problems = tuple(sorted(set(problems)))
        super().__init__("\n".join(f"{file}: {problem}" for problem in self.problems))
