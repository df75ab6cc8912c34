"""Types of the generated clients: a skill's signature, a goal's outcome, a datum's reading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar

import msgspec

from skillwing.services.errors import SkillwingError
from skillwing.services.protocol import DataReading, Ending, Terminal

R = TypeVar("R")
O = TypeVar("O")  # noqa: E741
F = TypeVar("F")
T = TypeVar("T")


@dataclass(frozen=True)
class Signature(Generic[R, O, F]):
    """A skill as the generated client describes it. R: the names of its results, as a Literal.

    skill: its name. outputs, feedback: the generated message classes, None where the skill has none.
    """

    skill: str
    outputs: type[O] | None = None
    feedback: type[F] | None = None

    def outcome(self, goal_id: str, terminal: Terminal) -> Outcome[R, O]:
        """The typed form of a terminal answer."""
        held: Any = terminal.result if terminal.ending is Ending.SUCCEEDED else None
        return Outcome(goal_id, self.skill, terminal, held, _message(self.outputs, terminal.output))

    def feedback_in(self, progress: Mapping[str, Any] | None) -> F | None:
        """The typed form of a goal's progress."""
        return _message(self.feedback, progress)


@dataclass(frozen=True)
class Outcome(Generic[R, O]):
    """The end of a goal.

    result: the skill's result that it ended with. None for every other end, such as an interrupt, and if the effect or
    the postcondition of the result did not hold; `terminal.result` names it then. output: of the result, None without
    one. terminal: the whole answer, with the failing preconditions, the violated invariant or the goal that runs.
    """

    goal_id: str
    skill: str
    terminal: Terminal
    result: R | None
    output: O | None

    @property
    def succeeded(self) -> bool:
        """The goal ended with a result that counts as a success."""
        return self.ending is Ending.SUCCEEDED and self.terminal.success

    @property
    def ending(self) -> Ending:
        return self.terminal.ending

    @property
    def reason(self) -> str:
        """A sentence."""
        return self.terminal.reason

    def require_success(self) -> Self:
        """Return this outcome; raises GoalFailedError if it is no success."""
        if not self.succeeded:
            raise GoalFailedError(self)
        return self

    def __str__(self) -> str:
        return f"{self.skill} ended {self.terminal.label}: {self.reason}" if self.reason else self.terminal.label


class GoalFailedError(SkillwingError):
    """A goal that had to succeed did not. outcome: its end."""

    def __init__(self, outcome: Outcome[Any, Any]) -> None:
        self.outcome = outcome
        super().__init__(str(outcome))


@dataclass(frozen=True)
class Reading(Generic[T]):
    """A datum. value: None if there never was one. age: in seconds of robot time. stale: too old to rely on."""

    value: T | None
    age: float | None
    stale: bool


def typed_reading(reading: DataReading, kind: type[T]) -> Reading[T]:
    """The typed form of a reading; `kind` as the generated client names it."""
    value = None if reading.value is None else msgspec.convert(reading.value, kind)
    return Reading(value, reading.age, reading.stale)


def known(state: str | None, resource: str) -> Any:
    """The state of a resource. Raises SkillwingError while it is None, not known."""
    if state is None:
        raise SkillwingError(f"The state of `{resource}` is not known yet: the resource manager has not answered.")
    return state


def _message(kind: type[T] | None, content: Mapping[str, Any] | None) -> T | None:
    return None if kind is None or content is None else msgspec.convert(content, kind)
