"""What does not fit, in words."""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.errors import InvalidOptionError
from skillwing.services.user_code_errors import exception_message, import_error_message


@dataclass(frozen=True, slots=True)
class MissionProblem:
    """What does not fit, as a sentence. place: `file:line` or `file:line:column` of the mission where it is written,
    if that is known."""

    text: str
    place: str | None = None

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


class FaultyMissionError(InvalidOptionError):
    """A mission that cannot be flown for what is written in it. problems: all that was found, by place; heading: what
    is to be said before them."""

    def __init__(self, problems: Iterable[MissionProblem], *, heading: str | None = None) -> None:
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems]
        super().__init__("mission", "\n".join(lines if heading is None else [heading, *lines]))


def problem_of_exception(file: Path | None, error: BaseException, when: str) -> MissionProblem:
    """What went wrong in the code of a mission, with the last line of its file that took part. file: None where the
    mission was written in none."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    place = f"{file}:{frames[-1].lineno}" if frames else file and str(file)
    if isinstance(error, ImportError):
        return MissionProblem(import_error_message(error, after=place or ""), place)
    return MissionProblem(exception_message(error, when=f" {when}"), place)
