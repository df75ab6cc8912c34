"""Skills that behave in all the ways that developers make skills behave, drawn for each goal."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from skillwing.dsl.model import Skill
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.protocol import Terminal


class HookError(Exception):
    """An exception that a developer did not think of."""


@dataclass
class Logbook:
    """True events, apart from all reports of managers.

    They are: dispatches of each goal, goals that were at a standstill, and calls of `on_ended` by process number. Then
    the speeds that each process was told for a goal, and the one that it had in the end.
    """

    dispatched: Counter[str] = field(default_factory=Counter[str])
    stood_still: set[str] = field(default_factory=set[str])
    ended: Counter[tuple[int, str]] = field(default_factory=Counter[tuple[int, str]])
    speeds: dict[tuple[int, str], list[float]] = field(default_factory=dict[tuple[int, str], list[float]])
    last_speed: dict[tuple[int, str], float] = field(default_factory=dict[tuple[int, str], float])


class AnySkill(SkillHooks[dict[str, Any], dict[str, Any], dict[str, Any]]):
    """Hooks of one process. seed: of the run; process: its number, for the logbook."""

    def __init__(self, model: Skill, logbook: Logbook, seed: int, process: int) -> None:
        self.skill = model.name  # pyright: ignore[reportAttributeAccessIssue] - one class plays them all
        self._model = model
        self._logbook = logbook
        self._seed = seed
        self._process = process
        self.ran: list[str] = []

    def _draw(self, goal_id: str, what: str) -> random.Random:
        """Chance that depends on nothing but the goal, so that leaving other acts out changes nothing here."""
        return random.Random(f"{self._seed}/{goal_id}/{what}")

    def validate(self, goal: Goal[dict[str, Any]]) -> str | None:
        new = "" if self.current is None else f" {goal.inputs}"
        draw = self._draw(goal.id, f"validate{new}").random()
        if draw < 0.03:
            raise HookError("while validating")
        return "It makes no sense." if draw < 0.06 else None

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self._logbook.dispatched[goal.id] += 1
        self._note_speed(goal)
        self.ran.append(goal.id)
        chance = self._draw(goal.id, "dispatch")
        result = chance.choice(self._model.results).name
        draw = chance.random()
        if draw < 0.08:
            self.terminated(goal.id, result)
        elif draw < 0.12:
            raise HookError("while dispatching")
        elif draw < 0.62:
            after = chance.choice((0.001, 0.5, chance.uniform(0.0, 3.0)))
            self.bus.after(after, lambda: self.terminated(goal.id, result))
            if chance.random() < 0.2:
                self.bus.after(after, lambda: self.terminated(goal.id, chance.choice(self._model.results).name))
        elif draw < 0.66:
            self.bus.after(chance.uniform(0.0, 2.0), self._fail_later)
        elif draw < 0.70:
            self.bus.after(chance.uniform(0.0, 2.0), lambda: self.failed(goal.id, "It gives up."))

    def on_modify(self, goal: Goal[dict[str, Any]]) -> None:
        self._note_speed(goal)
        if self._draw(goal.id, f"modify {goal.inputs}").random() < 0.05:
            raise HookError("while modifying")

    def _note_speed(self, goal: Goal[dict[str, Any]]) -> None:
        if "speed" in goal.inputs:
            self._logbook.speeds.setdefault((self._process, goal.id), []).append(goal.inputs["speed"])

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any] | None:
        return {each.name: 1.0 for each in self._model.feedback} or None

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        chance = self._draw(goal.id, "interrupt")
        draw = chance.random()
        if draw < 0.4:
            self.interrupted(goal.id)
        elif draw < 0.7:
            self.bus.after(chance.uniform(0.0, 1.2), lambda: self.interrupted(goal.id))
        elif draw < 0.8:
            self.terminated(goal.id, chance.choice(self._model.results).name)
        elif draw < 0.85:
            raise HookError("while interrupting")
        elif draw < 0.9:
            self.interrupted(goal.id)
            self.interrupted(goal.id)

    def terminated(
        self,
        goal_id: str,
        result: str,
        output: dict[str, Any] | None = None,
        *,
        cause: str | None = None,
        why: str = "",
    ) -> None:
        self._logbook.stood_still.add(goal_id)
        super().terminated(goal_id, result, output, cause=cause, why=why)

    def interrupted(self, goal_id: str) -> None:
        self._logbook.stood_still.add(goal_id)
        super().interrupted(goal_id)

    def on_ended(self, goal: Goal[dict[str, Any]], terminal: Terminal) -> None:
        del terminal
        self._logbook.ended[self._process, goal.id] += 1
        if "speed" in goal.inputs:
            self._logbook.last_speed[self._process, goal.id] = goal.inputs["speed"]

    def _fail_later(self) -> None:
        raise HookError("in a callback")
