"""What is wrong in a tree file, and where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.running.misfit import Misfit
from skillwing.services.errors import InvalidOptionError


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """line: counted from 1, 0 for the file as a whole; text: what is wrong and what to do."""

    line: int
    text: str

    def of(self, file: Path) -> Misfit:
        """The same with its place."""
        return Misfit(self.text, f"{file}:{self.line}" if self.line else str(file))


class TreeFileError(InvalidOptionError):
    """A tree file that cannot be flown. file: which; misfits: all that was found, by line."""

    def __init__(self, file: Path, problems: Iterable[Problem]) -> None:
        self.file = file
        self.misfits = tuple(problem.of(file) for problem in sorted(set(problems)))
        super().__init__("mission", "\n".join(map(str, self.misfits)))
