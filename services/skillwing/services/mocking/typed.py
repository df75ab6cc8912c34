"""The runtime of generated `mocks.py`: runs of mocked goals from typed messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Generic, Literal, TypeAlias, TypeVar

import msgspec

from skillwing.services.mocking.script import InputDelay, MockRun, MockScript

O = TypeVar("O")  # noqa: E741
F = TypeVar("F")

Delay: TypeAlias = float | tuple[float, float] | InputDelay
"""Robot time in seconds, the bounds between which it is drawn, or an input of the goal."""
StopDelay: TypeAlias = float | Literal["never"]
"""Robot time in seconds from an interrupt to its confirmation, or "never"."""
Runs: TypeAlias = Sequence[MockRun]


class SkillMock(Generic[O, F]):
    """Run of one goal of a mocked skill. Missing outputs and feedback get a valid value."""

    @classmethod
    def ended(
        cls,
        result: str,
        *,
        output: O | None = None,
        feedback: F | None = None,
        delay: Delay = 1.0,
        stop_delay: StopDelay = 0.0,
    ) -> MockRun:
        """End with a result. Generated `ended_<RESULT>` methods call this."""
        return MockRun(
            result=result, output=_fields(output), progress=_fields(feedback), delay=delay, stop_delay=stop_delay
        )

    @classmethod
    def forever(cls, *, feedback: F | None = None, stop_delay: StopDelay = 0.0) -> MockRun:
        """Run until interrupted."""
        return MockRun(forever=True, progress=_fields(feedback), stop_delay=stop_delay)

    @classmethod
    def refused(cls, reason: str) -> MockRun:
        """Be refused as NV."""
        return MockRun(invalid=reason)

    @classmethod
    def failed(cls, reason: str, *, delay: Delay = 1.0) -> MockRun:
        """End as ERROR."""
        return MockRun(error=reason, delay=delay)

    @classmethod
    def lost(cls, *, delay: Delay = 1.0) -> MockRun:
        """End as LOST: the manager's process dies."""
        return MockRun(crash=True, delay=delay)


def scripted(runs: Mapping[str, Runs], seed: int = 0) -> MockScript:
    """The script of the skills that have runs."""
    return MockScript(skills={skill: its for skill, its in runs.items() if its}, seed=seed)


def _fields(message: object | None) -> dict[str, Any]:
    return {} if message is None else msgspec.to_builtins(message)
