"""Errors that users of the services meet. Names unknown to a skillset raise the language's `UnknownNameError`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from skillwing.services.core.refusal import RefusedError

__all__ = [
    "BadRecordingError",
    "InvalidInputError",
    "InvalidOptionError",
    "KeysError",
    "NoGoalError",
    "NoMissionError",
    "NoReplyError",
    "NoSystemError",
    "NotKnownError",
    "PassingError",
    "RefusedError",
    "SeveralSystemsError",
    "SkillwingError",
    "TimedOutError",
    "WrongSkillsetError",
]


class SkillwingError(Exception):
    """Root of these errors. `str()` is for people: one sentence with the problem, one with the remedy."""


class InvalidInputError(SkillwingError):
    """Inputs that do not fit a skill, whatever the state of the robot.

    skill: its name. problems: a sentence for each input field (`target.x`).
    """

    def __init__(self, skill: str, problems: Mapping[str, str]) -> None:
        self.skill = skill
        self.problems = MappingProxyType(dict(problems))
        super().__init__(f"The inputs do not fit `{skill}`: {' '.join(self.problems.values())}")


class InvalidOptionError(SkillwingError):
    """An option that is missing or has an invalid value. option: its name."""

    def __init__(self, option: str, message: str) -> None:
        self.option = option
        super().__init__(message)


class KeysError(SkillwingError):
    """A folder of keys that is missing, damaged, or cannot do what was asked."""


class PassingError(SkillwingError):
    """A failure that may not occur again, such as a write to a disk that is full for the moment."""


class NoSystemError(SkillwingError):
    """No running system. endpoint: of a router that does not answer, None if the reason is another."""

    def __init__(self, message: str, endpoint: str | None = None) -> None:
        self.endpoint = endpoint
        super().__init__(message)


class NotKnownError(SkillwingError):
    """A certificate that a router rejects. endpoint: of the router. reason: part of a sentence. remedy: a sentence."""

    def __init__(self, endpoint: str, reason: str, remedy: str = "Ask the owner of the robot for new keys.") -> None:
        self.endpoint = endpoint
        self.reason = reason
        super().__init__(f"You are not known at {endpoint}: {reason}. {remedy}")


class SeveralSystemsError(NoSystemError):
    """Several running systems, of which none was chosen."""


class NoGoalError(SkillwingError):
    """No running goal of a skill."""

    def __init__(self, skill: str) -> None:
        super().__init__(f"No goal of `{skill}` is running. `skillwing status` shows what is.")


class NoMissionError(SkillwingError):
    """No running mission. elsewhere: other robots of the router with one."""

    def __init__(self, elsewhere: Sequence[str] = ()) -> None:
        self.elsewhere = tuple(elsewhere)
        remedy = "Start one with `skillwing mission run`."
        if elsewhere:
            # Every process imports this module, and the router has no other part of the language.
            from skillwing.dsl.suggest import listed  # noqa: PLC0415

            remedy = f"One runs at {listed(elsewhere)}: choose with `--robot {elsewhere[0]}`."
        super().__init__(f"No mission runs here. {remedy}")


class BadRecordingError(SkillwingError):
    """A recording that is missing or damaged, or that this Skillwing cannot read."""


class WrongSkillsetError(SkillwingError):
    """Processes of one robot with different versions of its skillset."""


class NoReplyError(SkillwingError):
    """No answer from a process of the system. key: the key of the request."""

    def __init__(self, key: str) -> None:
        self.key = key
        super().__init__(f"No process answers at `{key}`. `skillwing status` shows what runs.")


class TimedOutError(SkillwingError, TimeoutError):
    """A wait that took too long. awaited: the subject of a sentence; timeout: in seconds."""

    def __init__(self, awaited: str, timeout: float) -> None:
        self.awaited = awaited
        self.timeout = timeout
        super().__init__(f"{awaited} did not come within {timeout:g} s. Wait longer, or look at `skillwing status`.")
