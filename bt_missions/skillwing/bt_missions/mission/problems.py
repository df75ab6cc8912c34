"""Problems found in a mission, each as a sentence with its place."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.errors import InvalidOptionError
from skillwing.services.user_code_errors import exception_message, import_error_message


@dataclass(frozen=True, slots=True)
class MissionProblem:
    """One problem, as a sentence. place: `file:line` or `file:line:column` in the mission, if known."""

    text: str
    place: str | None = None

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


class FaultyMissionError(InvalidOptionError):
    """A mission that cannot run as it is written. problems: all that was found, by place; heading: a line before
    them."""

    def __init__(self, problems: Iterable[MissionProblem], *, heading: str | None = None) -> None:
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems]
        super().__init__("mission", "\n".join(lines if heading is None else [heading, *lines]))


def problem_of_exception(file: Path | None, error: BaseException, when: str) -> MissionProblem:
    """The problem behind an exception in a mission's code, at the innermost line of its file. file: None if it has no
    file."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    place = f"{file}:{frames[-1].lineno}" if frames else file and str(file)
    if isinstance(error, ImportError):
        return MissionProblem(import_error_message(error, after=place or ""), place)
    return MissionProblem(exception_message(error, when=f" {when}"), place)
