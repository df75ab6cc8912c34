"""Errors that users of the services meet, one small tree. Names unknown to a skillset raise the language's
`UnknownNameError`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from skillwing.services.core.refusal import RefusedError

__all__ = [
    "BadRecordingError",
    "InvalidInputError",
    "InvalidOptionError",
    "NoReplyError",
    "NoSystemError",
    "PassingError",
    "RefusedError",
    "SkillwingError",
    "TimedOutError",
    "WrongSkillsetError",
]


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


class PassingError(SkillwingError):
    """What failed may go well when it is tried again, such as writing to a disk that is full just now."""


class NoSystemError(SkillwingError):
    """There is no running system to talk to."""


class BadRecordingError(SkillwingError):
    """A recording that is missing or damaged, or that this Skillwing cannot read."""


class WrongSkillsetError(SkillwingError):
    """The processes of a robot have different versions of its skillset."""


class NoReplyError(SkillwingError):
    """A process of the system does not answer. key: what was asked."""

    def __init__(self, key: str) -> None:
        self.key = key
        super().__init__(f"Nobody answers at `{key}`. See what is running with `skillwing status`.")


class TimedOutError(SkillwingError, TimeoutError):
    """What was waited for did not come in time. awaited: what; timeout: in seconds."""

    def __init__(self, awaited: str, timeout: float) -> None:
        self.awaited = awaited
        self.timeout = timeout
        super().__init__(f"{awaited} did not come within {timeout:g} s. Wait longer, or see with `skillwing status`.")
