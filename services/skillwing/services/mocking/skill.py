"""A mocked skill: the real skill manager with hooks that follow a script."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Bus, Handle, Publisher
from skillwing.services.core.refusal import RefusedError
from skillwing.services.managers.hook_bus import HookBus
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.serving import serve
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.mocking.fitting import FittedRun, FittedScript, fit_run
from skillwing.services.mocking.player import PlannedRun, SkillPlayer, shortest_delay
from skillwing.services.mocking.script_file import read_run
from skillwing.services.protocol import (
    DirectMock,
    ErrorCode,
    Keys,
    MockCall,
    MockedGoal,
    MockPlan,
    ResetMock,
    Terminal,
    encode,
)

log = logging.getLogger(__name__)


class MockHooks(SkillHooks[dict[str, Any], dict[str, Any], dict[str, Any]]):
    """Hooks that follow a script.

    hang: stops all answers of the manager; crash: ends its process.
    """

    def __init__(
        self,
        skill: str,
        skillset: Skillset,
        script: FittedScript,
        *,
        hang: Callable[[], None],
        crash: Callable[[], None],
    ) -> None:
        self.skill = skill  # pyright: ignore[reportAttributeAccessIssue] - one class plays every skill
        self._model = skillset.skill(skill)
        self._keys = Keys(skillset.name)
        self._hang = hang
        self._crash = crash
        self.player = SkillPlayer(self._model, script.skills[skill], script.seed)
        self._planned: PlannedRun | None = None
        self._dispatched_at = 0.0
        self._feedbacks = 0
        # Apart from one another: a goal that is directed while it stops still stops.
        self._ending: Handle | None = None
        self._stopping: Handle | None = None

    def setup(self) -> None:
        self._goals: Publisher = self.bus.advertise(self._keys.mocked_goal(self.skill), events=True)

    def validate(self, goal: Goal[dict[str, Any]]) -> str | None:
        run = self.player.peek().run
        if self.current is not None:  # new inputs of the running goal
            return None
        if run.how != "invalid":
            return None
        self.player.take()
        return run.text

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self._planned = self.player.take(goal.inputs)
        self._dispatched_at = self.bus.now()
        self._feedbacks = 0
        self._tell_inputs(goal)
        self._end_after(goal, self._planned.run, self._planned.delay)

    def on_modify(self, goal: Goal[dict[str, Any]]) -> None:
        self._tell_inputs(goal)

    def _tell_inputs(self, goal: Goal[dict[str, Any]]) -> None:
        self._goals.put(encode(MockedGoal(skill=self.skill, goal_id=goal.id, inputs=goal.inputs)))

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any] | None:
        if self._planned is None or not self._model.feedback:
            return None
        elapsed = self.bus.now() - self._dispatched_at
        feedback = self.player.feedback(self._planned, goal.inputs, elapsed, self._feedbacks)
        self._feedbacks += 1
        return feedback

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        self._forget_ending()
        stop_delay = None if self._planned is None else self._planned.run.stop_delay
        if stop_delay is not None:
            self._stopping = self.bus.after(stop_delay, lambda: self.interrupted(goal.id))

    def on_ended(self, goal: Goal[dict[str, Any]], terminal: Terminal) -> None:
        self._forget_ending()
        if self._stopping is not None:
            self._stopping.cancel()
            self._stopping = None
        self._planned = None

    def end_now(self, run: FittedRun) -> None:
        """End the running goal by a run, after the run's delay, unless it stops before. Raises RefusedError if none is
        running.
        """
        goal = self.current
        if goal is None or self._planned is None:
            raise RefusedError(ErrorCode.NOT_ALLOWED, f"No goal of `{self.skill}` is running.", help="Start one.")
        self._forget_ending()
        delay = shortest_delay(run, goal.inputs)
        if delay > 0.0 or run.how in ("hang", "crash", "forever"):
            self._end_after(goal, run, delay)
        else:
            self._end(goal, run)  # so that the first one of two counts

    def _end_after(self, goal: Goal[dict[str, Any]], run: FittedRun, delay: float) -> None:
        if run.how != "forever":
            self._ending = self.bus.after(delay, lambda: self._end(goal, run))

    def _end(self, goal: Goal[dict[str, Any]], run: FittedRun) -> None:
        match run.how:
            case "result":
                inputs = goal.inputs if self.current is None else self.current.inputs
                self.terminated(goal.id, run.text, self.player.output(run, inputs))
            case "hang":
                log.info("hangs, as its script says")
                self._hang()
            case "crash":
                log.info("crashes, as its script says")
                self._crash()
            case _:
                self.failed(goal.id, run.text)

    def _forget_ending(self) -> None:
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None


class MockSkillNode(SkillManagerNode):
    """The manager of a mocked skill. Clients can direct it while it runs.

    crash: ends its process; by default it leaves the bus as a dying process does.
    """

    def __init__(
        self, skillset: Skillset, skill: str, script: FittedScript, *, crash: Callable[[], None] | None = None
    ) -> None:
        self._mock = MockHooks(skill, skillset, script, hang=self._stop_listening, crash=self._leave_life)
        super().__init__(self._mock, skillset)
        self._end_of_process = crash
        self._listening = True
        self._unheard: list[Callable[[], None]] = []

    def attach(self, bus: Bus) -> None:
        self._world = bus
        heard = HookBus(bus, self._hear)
        super().attach(heard)
        serve(heard, self._keys.mocked_skill(self._model.name), MockCall, self._answer_direction)

    # --- hanging and crashing ----------------------------------------------------------------------------------------

    def _hear(self, name: str, callback: Callable[[], None]) -> None:
        """Run a callback, unless the manager hangs. Then its clients get no answer."""
        if self._listening:
            callback()
        else:
            self._unheard.append(callback)

    def _stop_listening(self) -> None:
        self._listening = False

    def _leave_life(self) -> None:
        (self._end_of_process or self._world.close)()

    # --- directing ---------------------------------------------------------------------------------------------------

    def _answer_direction(self, call: MockCall, key: str) -> MockPlan:
        del key
        if isinstance(call, ResetMock):
            self._mock.player.reset()
        elif isinstance(call, DirectMock):
            self._direct(call)
        return self._plan()

    def _direct(self, call: DirectMock) -> None:
        problems: list[str] = []
        said = read_run(call.run, self._model.name, problems.append)
        run = fit_run(said, self._model, problems.append, self._model.name)
        if problems:
            raise RefusedError(ErrorCode.BAD_REQUEST, " ".join(problems), help="See docs/mocks.md.")
        match call.when:
            case "now" if run.how == "invalid":
                help_text = "Say `error` instead."
                raise RefusedError(ErrorCode.NOT_ALLOWED, "A goal that runs has been validated.", help=help_text)
            case "now":
                self._mock.end_now(run)
            case "next":
                self._mock.player.give_next(run)
            case "always":
                self._mock.player.give_always(run)

    def _plan(self) -> MockPlan:
        player = self._mock.player
        return MockPlan(
            skill=self._model.name,
            given=tuple(msgspec.to_builtins(run.said) for run in player.given),
            script=tuple(msgspec.to_builtins(run.said) for run in player.rest.runs),
            drawn=player.rest.drawn,
        )
