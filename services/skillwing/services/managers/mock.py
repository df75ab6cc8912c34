"""Mock managers: the real managers around scripted skills, so that missions can be tested without a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from skillwing.dsl.model import Skill, Skillset
from skillwing.services.bus import Handle, Node
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.protocol import Terminal

DEFAULT_DELAY = 1.0


@dataclass(frozen=True, slots=True)
class MockRun:
    """How one goal goes.

    delay: robot time in seconds from the dispatch to the end. result: how it ends then; None runs until interrupted.
    output: goes with the result. progress: fed back at each period. invalid: a sentence with which the goal is refused
    as NV. error: a sentence with which it fails instead of giving a result. stop_delay: robot time from an interrupt
    to its confirmation; None never confirms.
    """

    delay: float = DEFAULT_DELAY
    result: str | None = None
    output: Mapping[str, Any] | None = None
    progress: Mapping[str, Any] | None = None
    invalid: str | None = None
    error: str | None = None
    stop_delay: float | None = 0.0


@dataclass(frozen=True, slots=True)
class MockScript:
    """For each skill the runs of its goals, one after the other; the last one repeats.

    A skill without runs ends with its first success after one second; one that has no success runs until interrupted.
    """

    runs: Mapping[str, Sequence[MockRun]] = field(default_factory=dict[str, Sequence[MockRun]])

    def run(self, skill: Skill, number: int) -> MockRun:
        """The run of the skill's goal of that number, from 0."""
        runs = self.runs.get(skill.name)
        if runs:
            return runs[min(number, len(runs) - 1)]
        successes = [result.name for result in skill.results if result.success]
        return MockRun(result=successes[0] if successes else None)


class MockHooks(SkillHooks[dict[str, Any], dict[str, Any], dict[str, Any]]):
    """Hooks that follow a script. Raises UnknownNameError for a skill or result that the skillset does not know."""

    def __init__(self, skill: str, skillset: Skillset, script: MockScript) -> None:
        self.skill = skill  # pyright: ignore[reportAttributeAccessIssue] - one class plays every skill
        self._model = skillset.skill(skill)
        self._script = script
        self._count = 0
        self._run = script.run(self._model, 0)
        self._timers: list[Handle] = []
        for run in script.runs.get(skill, ()):
            if run.result is not None:
                self._model.result(run.result)

    def validate(self, goal: Goal[dict[str, Any]]) -> str | None:
        self._run = self._script.run(self._model, self._count)
        self._count += 1
        return self._run.invalid

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        run = self._run
        if run.error is not None:
            reason = run.error
            self._timers.append(self.bus.after(run.delay, lambda: self.failed(goal.id, reason)))
        elif run.result is not None:
            result, output = run.result, None if run.output is None else dict(run.output)
            self._timers.append(self.bus.after(run.delay, lambda: self.terminated(goal.id, result, output)))

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any] | None:
        return None if self._run.progress is None else dict(self._run.progress)

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        self._forget_timers()
        if self._run.stop_delay is not None:
            self._timers.append(self.bus.after(self._run.stop_delay, lambda: self.interrupted(goal.id)))

    def on_ended(self, goal: Goal[dict[str, Any]], terminal: Terminal) -> None:
        self._forget_timers()

    def _forget_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()


def make_mock_managers(skillset: Skillset, script: MockScript | None = None) -> list[Node]:
    """The data manager, the resource manager, and a mock of each skill's manager."""
    played = script or MockScript()
    skills = [SkillManagerNode(MockHooks(skill.name, skillset, played), skillset) for skill in skillset.skills]
    return [DataManagerNode(skillset), ResourceManagerNode(skillset), *skills]
