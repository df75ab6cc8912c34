"""The player of a mocked skill: the run of the script for each goal. Pure; randomness comes from the script's seed."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from random import Random
from typing import Any

from skillwing.dsl.default_values import default_fields
from skillwing.dsl.model import Skill
from skillwing.services.mocking.fitting import FittedRun, FittedRuns
from skillwing.services.mocking.script import LONGEST
from skillwing.services.mocking.signals import FromInput, SignalContext, value_at


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A run with its delay, drawn or from an input."""

    run: FittedRun
    delay: float


def shortest_delay(run: FittedRun, inputs: Mapping[str, Any]) -> float:
    """The shortest delay of a run in seconds, for a goal with these inputs."""
    if isinstance(run.delay, FromInput):
        seconds = float(value_at(run.delay, SignalContext(None, inputs=inputs)))
        return min(max(0.0, seconds), LONGEST)
    return run.delay[0]


class SkillPlayer:
    """The runs of one skill's goals.

    A run given for the next goal comes first, then the script's. A goal consumes its run when it is dispatched or
    refused as invalid. A goal that was not ready leaves it to the next one.
    """

    def __init__(self, skill: Skill, runs: FittedRuns, seed: int) -> None:
        self._skill = skill
        self._script = runs
        self._runs = runs
        self._used = 0
        self._next: deque[FittedRun] = deque()
        # Each skill draws by itself, so that what one does changes nothing for another.
        self._random = Random(f"{seed}/{skill.name}")
        self._planned: PlannedRun | None = None

    def peek(self) -> PlannedRun:
        """The run of the next goal. It stays the same until it is taken."""
        if self._planned is None:
            run = self._next[0] if self._next else self._drawn()
            # A delay from an input is known with the goal.
            drawn = 0.0 if isinstance(run.delay, FromInput) else self._random.uniform(*run.delay)
            self._planned = PlannedRun(run, drawn)
        return self._planned

    def take(self, inputs: Mapping[str, Any] | None = None) -> PlannedRun:
        """Take the next goal's run. inputs: of that goal; without them a delay from an input is 0."""
        planned, self._planned = self.peek(), None
        if inputs is not None and isinstance(planned.run.delay, FromInput):
            planned = PlannedRun(planned.run, shortest_delay(planned.run, inputs))
        if self._next:
            self._next.popleft()
        else:
            self._used += 1
        return planned

    def give_next(self, run: FittedRun) -> None:
        """Give a run to the next goal, or to the one after those with given runs."""
        if not self._next:
            self._planned = None
        self._next.append(run)

    def give_always(self, run: FittedRun) -> None:
        """Give a run to all goals from now on."""
        self._start(FittedRuns((run,)))

    def reset(self) -> None:
        """Restart the script."""
        self._start(self._script)

    @property
    def given(self) -> tuple[FittedRun, ...]:
        """The given runs of the next goals."""
        return tuple(self._next)

    @property
    def rest(self) -> FittedRuns:
        """The runs after the given ones: those left in the script, or those to draw from."""
        if self._runs.drawn:
            return self._runs
        return FittedRuns(self._runs.runs[min(self._used, len(self._runs.runs) - 1) :])

    def output(self, run: FittedRun, inputs: dict[str, Any]) -> dict[str, Any] | None:
        """The output of a goal with these inputs; None if the skill has none."""
        if not self._skill.outputs:
            return None
        return value_at(run.output, SignalContext(default_fields(self._skill.outputs), inputs=inputs, span=0.0))

    def feedback(self, planned: PlannedRun, inputs: dict[str, Any], elapsed: float, number: int) -> dict[str, Any]:
        """The feedback of that number, from 0, `elapsed` seconds after the dispatch."""
        before = default_fields(self._skill.feedback)
        context = SignalContext(before, elapsed=elapsed, sample=number, inputs=inputs, span=planned.delay)
        return value_at(planned.run.progress, context)

    def _drawn(self) -> FittedRun:
        runs = self._runs.runs
        if self._runs.drawn:
            return self._random.choices(runs, [run.weight for run in runs])[0]
        return runs[min(self._used, len(runs) - 1)]

    def _start(self, runs: FittedRuns) -> None:
        self._runs = runs
        self._used = 0
        self._next.clear()
        self._planned = None
