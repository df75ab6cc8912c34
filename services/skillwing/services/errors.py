"""Errors that users of the services meet, one small tree. Names unknown to a skillset raise the language's
`UnknownNameError`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from skillwing.services.core.refusal import RefusedError

__all__ = ["InvalidInputError", "InvalidOptionError", "RefusedError", "SkillwingError"]


class SkillwingError(Exception):
    """Root of the tree; `str()` is for people: one sentence what is wrong, one what to do."""


class InvalidInputError(SkillwingError):
    """Inputs that a skill cannot take, whatever the state of the robot.

    skill: which skill; problems: for each input field (`target.x`), a sentence.
    """

    def __init__(self, skill: str, problems: Mapping[str, str]) -> None:
        self.skill = skill
        self.problems = MappingProxyType(dict(problems))
        super().__init__(f"The inputs do not fit `{skill}`: {' '.join(self.problems.values())}")


class InvalidOptionError(SkillwingError):
    """A process was started with an option that is missing or means nothing. option: its name."""

    def __init__(self, option: str, message: str) -> None:
        self.option = option
        super().__init__(message)
