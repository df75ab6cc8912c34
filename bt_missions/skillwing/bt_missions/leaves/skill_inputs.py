"""Input values of a skill that may be held and started again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.dsl.model import Skillset


def plain_inputs(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """The inputs, with structures such as those of a generated interface as plain values. Functions stay functions.

    A value without a plain form stays as it is; the check of the mission reports it.
    """
    return {name: value if callable(value) else _plain(value) for name, value in inputs.items()}


def _plain(value: object) -> object:
    try:
        return msgspec.to_builtins(value)
    except TypeError:
        return value


class SkillInputs:
    """Inputs of `skill`, less what earlier goals of the same run have done. A value may be a function.

    done: inputs that a goal works off, each with the feedback field that counts it: `{"laps": "laps_done"}`.
    """

    def __init__(self, skill: str, inputs: Mapping[str, Any], done: Mapping[str, str]) -> None:
        self._skill = skill
        self._inputs = inputs
        self._done = done
        self.reset()

    def reset(self) -> None:
        """Forget what earlier goals have done."""
        self._done_so_far = dict.fromkeys(self._done, 0.0)

    def count(self, goal: GoalView | None) -> None:
        """Add what this goal has done."""
        progress = {} if goal is None else goal.progress or {}
        for name, feedback in self._done.items():
            self._done_so_far[name] += float(progress.get(feedback, 0.0))

    def values(self, skillset: Skillset) -> dict[str, Any]:
        """Values for a goal that starts now. What remains of an input is not below its lower limit."""
        values = {name: value() if callable(value) else value for name, value in self._inputs.items()}
        for name, done in self._done_so_far.items():
            if done > 0.0:
                field = skillset.skill(self._skill).input(name)
                whole: Any = values.get(name, field.default)
                values[name] = whole - done if field.low is None else max(whole - done, field.low)
        return values
