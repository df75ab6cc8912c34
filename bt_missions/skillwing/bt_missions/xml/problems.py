"""What is wrong in a tree file, and where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from skillwing.bt_missions.mission.problems import FaultyMissionError, Misfit


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """line, column: counted from 1, 0 for the file, or the line, as a whole; text: what is wrong and what to do."""

    line: int
    text: str
    column: int = 0

    def of(self, file: Path) -> Misfit:
        """The same with its place."""
        place = ":".join(str(part) for part in (file, self.line, self.column) if part)
        return Misfit(self.text, place)


class TreeFileError(FaultyMissionError):
    """A tree file that cannot be flown. file: which; misfits: all that was found, by line."""

    def __init__(self, file: Path, problems: Iterable[Problem]) -> None:
        self.file = file
        super().__init__(problem.of(file) for problem in sorted(set(problems)))
