"""The bench: a skillset with all its managers, controlled by one test.

Calls are synchronous. Time passes while a call waits: virtual time on the in-process benches, wall time with real
processes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, NoReturn, Self

import msgspec

from skillwing.dsl.model import Skill, Skillset
from skillwing.services.bus import Answer, NoReply, Refused, RunnableBus
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.client.retry import wait_for_answer
from skillwing.services.core.refusal import RefusedError
from skillwing.services.errors import NoReplyError
from skillwing.services.history.history import History
from skillwing.services.history.wording import headlines
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.protocol import DataReading, Keys, State
from skillwing.services.testing.context import ContextError, checked_states, extern_way
from skillwing.services.testing.data_feed import DataFeed
from skillwing.services.testing.fake_layer import FakeLayer
from skillwing.services.testing.goal import WITHIN, GoalUnderTest
from skillwing.services.testing.story import concerned, tell

CLIENT = "test"
SETTLE = 0.01
"""Seconds until the effects of one call have reached all nodes."""
START_WITHIN = 10.0
ANSWER_WITHIN = 5.0


class Bench:
    """A client of a running skillset that starts goals, acts as the functional layer, and records the timeline.

    layer: the fake functional layer. types: hooks classes by skill, for typed outputs.
    """

    def __init__(
        self,
        bus: RunnableBus,
        skillset: Skillset,
        layer: FakeLayer,
        *,
        types: Mapping[str, type[SkillHooks[Any, Any, Any]]] | None = None,
        new_goal_id: Callable[[], str] | None = None,
    ) -> None:
        self.bus = bus
        self.skillset = skillset
        self.history = History(skillset)
        """The timeline so far."""
        self._layer = layer
        self._types = dict(types or {})
        self._feed = DataFeed(bus, skillset)
        follow_records(bus, Keys(skillset.name), self.history.add_record)
        self.client = SkillsetInterface(bus, skillset, client=CLIENT, new_goal_id=new_goal_id)
        self.run_until(lambda: self.client.ready, START_WITHIN, "the resource manager to answer")

    @property
    def layer(self) -> FakeLayer:
        return self._layer

    def close(self) -> None:
        """Shut down all nodes in order. Idempotent."""
        self.bus.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --- goals -------------------------------------------------------------------------------------------------------

    def start_skill(
        self, skill: str, inputs: Mapping[str, Any] | msgspec.Struct | None = None, /, **fields: Any
    ) -> GoalUnderTest[Any, Any]:
        """Start a skill, and return when its goal runs or has ended.

        inputs: a mapping, the struct generated for the skill, or keywords. Raises UnknownNameError and
        InvalidInputError as `SkillsetInterface.start` does.
        """
        goal = self.send_start(skill, inputs, **fields)
        started = (State.RUNNING, State.TERMINATED)
        self.run_until(lambda: goal.state in started, START_WITHIN, f"the goal of `{skill}` to run or end")
        self.run(SETTLE)
        return goal

    def send_start(
        self, skill: str, inputs: Mapping[str, Any] | msgspec.Struct | None = None, /, **fields: Any
    ) -> GoalUnderTest[Any, Any]:
        """Send the start of a skill and return at once, before any node receives it."""
        given: dict[str, Any] = msgspec.to_builtins(inputs or {}) | fields
        handle = self.client.start(skill, given)
        hooks = self._types.get(skill)
        return GoalUnderTest(
            self,
            handle,
            self.skillset.skill(skill),
            given,
            hooks.Outputs if hooks else None,
            hooks.Feedback if hooks else None,
        )

    def interrupt(self, goal: GoalHandle) -> None:
        """Send an interrupt and return at once."""
        self.client.interrupt(goal)

    def modify(self, goal: GoalHandle, inputs: Mapping[str, Any]) -> str | None:
        """Give a running goal new inputs. Returns the sentences of a refusal, None if they are accepted."""
        try:
            wait_for_answer(self.bus, goal.skill, lambda take: self.client.modify(goal, inputs, take))
        except (RefusedError, NoReplyError) as refusal:
            return str(refusal)
        return None

    def wait_for(self, goal: GoalHandle, within: float) -> bool:
        """Wait for a goal's end, and for the messages of its manager's `on_ended`. False if there was no end."""
        done = self.bus.run_until(lambda: goal.done, within)
        self.run(SETTLE)
        return done

    # --- time --------------------------------------------------------------------------------------------------------

    def now(self) -> float:
        """Robot time in seconds."""
        return self.bus.now()

    def run(self, seconds: float) -> None:
        """Let this much time pass."""
        self.bus.run_until(lambda: False, seconds)

    def run_until(self, condition: Callable[[], bool], within: float = WITHIN, what: str = "it") -> None:
        """Let time pass until a condition holds. Fails the test if it does not; `what` is for the message."""
        if not self.bus.run_until(condition, within):
            self.fail(f"Waited {within:g} s in vain for {what}.")

    # --- the context -------------------------------------------------------------------------------------------------

    @property
    def states(self) -> Mapping[str, str]:
        """State of each resource, live."""
        return self.client.states

    def set_states(self, **states: str) -> None:
        """Bring resources to states by the shortest chain of extern transitions.

        Raises ContextError if there is none, before anything is moved.
        """
        wanted = checked_states(self.skillset, states)
        ways = {name: extern_way(self.skillset.resource(name), self.states[name], wanted[name]) for name in wanted}
        closed = [name for name, way in ways.items() if way is None]
        if closed:
            raise ContextError(self.skillset.name, (self._no_way(name, wanted[name]) for name in closed))
        for name, way in ways.items():
            for state in way or ():
                self.trigger(name, state)

    def trigger(self, resource: str, target: str) -> None:
        """Take one extern transition. Raises RefusedError if the model has none, and UnknownNameError."""
        self._ask(lambda on_answer: self.client.trigger(resource, target, on_answer))

    def fire(self, event: str) -> None:
        """Fire an event. Raises RefusedError if its guard or a transition forbids it, and UnknownNameError."""
        self._ask(lambda on_answer: self.client.fire(event, on_answer))

    def reading(self, datum: str) -> DataReading:
        """The latest value of a datum as clients see it. Raises UnknownNameError."""
        return self.client.reading(datum)

    def set_data(self, **values: object) -> None:
        """Publish data from now on, each at its promised period. Raises ContextError if they do not fit."""
        self._feed.set(values)
        self.run(SETTLE)

    def stop_data(self, *names: str) -> None:
        """Stop publishing data. After three of its periods each is stale. Raises UnknownNameError."""
        for name in names:
            self._feed.stop(name)

    # --- judging -----------------------------------------------------------------------------------------------------

    def assert_states(self, *, within: float = 1.0, **states: str) -> None:
        """Assert that resources are in these states, or reach them within that time."""
        wanted = checked_states(self.skillset, states)
        if not self.bus.run_until(lambda: all(self.states[name] == state for name, state in wanted.items()), within):
            wrong = [
                f"`{name}` should be {state}, it is {self.states[name]}"
                for name, state in wanted.items()
                if self.states[name] != state
            ]
            self.fail(f"{'; '.join(wrong)}.")

    def chain(self, record_id: str | None) -> list[str]:
        """The chain of causes of a record of the timeline, the root first, as short texts."""
        return headlines(self.history.chain(record_id))

    def concerned(self, skill: Skill) -> str:
        """The resources and data that a skill's guards and effects name, each with its present state or value."""
        return concerned(skill, self.states, self.client.reading)

    def story(self, goal_id: str | None = None) -> str:
        """The timeline, from the first record of a goal on or whole, and the present states."""
        return tell(
            self.history,
            now=self.now(),
            goal_id=goal_id,
            states=self.states,
            readings=[self.client.reading(item.name) for item in self.skillset.data],
            layer=self._layer,
        )

    def fail(self, sentence: str) -> NoReturn:
        """Fail the test, with the story in its message."""
        raise AssertionError(f"{sentence}\n{self.story()}")

    # --- inside ------------------------------------------------------------------------------------------------------

    def _ask(self, send: Callable[[Callable[[Answer], None]], None]) -> None:
        answers: list[Answer] = []
        send(answers.append)
        self.run_until(lambda: bool(answers), ANSWER_WITHIN, "the resource manager to answer")
        match answers[0]:
            case Refused(error):
                raise RefusedError(error.code, error.message, help=error.help, known=error.known)
            case NoReply():
                self.fail("The resource manager does not answer.")
            case _:
                self.run(SETTLE)

    def _no_way(self, name: str, target: str) -> str:
        resource = self.skillset.resource(name)
        reached = [state for state in resource.states if extern_way(resource, self.states[name], state)]
        can = f"; it can bring it to {' or '.join(reached)}" if reached else ""
        return (
            f"The functional layer cannot bring `{name}` from {self.states[name]} to {target}{can}. "
            "Start a skill that does, or let the test begin there with `states=`."
        )
