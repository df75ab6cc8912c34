"""The mocked world: a process in place of a robot's bridge to its functional layer."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Bus, Handle, Refused
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.core.bounded_dict import GOALS_REMEMBERED, BoundedDict
from skillwing.services.core.refusal import RefusedError
from skillwing.services.managers.serving import serve
from skillwing.services.mocking.fitting import fit_datum, fit_script
from skillwing.services.mocking.script import MockRun, MockScript
from skillwing.services.mocking.signals import Signal
from skillwing.services.mocking.world_core import (
    Due,
    EndMockedGoal,
    Fire,
    MockedValues,
    Reactions,
    SetDatum,
    StopReactions,
    Trigger,
)
from skillwing.services.names import MOCKED_WORLD
from skillwing.services.protocol import (
    DataSample,
    DirectMock,
    ErrorCode,
    FireEvent,
    FireExtern,
    GoalStatus,
    Keys,
    MockedData,
    MockedGoal,
    MockedWorldCall,
    QueryData,
    QueryStates,
    ResetMock,
    ResourceStep,
    SetMockedData,
    encode,
)

DEFAULT_PERIOD = 1.0
"""Publishing period of data without a promised one [s]."""
log = logging.getLogger(__name__)


class MockWorld:
    """A publisher of mocked data that also fires extern transitions and events, as a script says.

    Raises ScriptError if the script does not fit the skillset.
    """

    name = MOCKED_WORLD
    owns_clock = False
    tells_when_ready = True

    def __init__(self, skillset: Skillset, script: MockScript | None = None) -> None:
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._script = fit_script(script or MockScript(), skillset)

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._alive: Handle | None = None
        self._delayed: BoundedDict[str, list[Handle]] = BoundedDict(GOALS_REMEMBERED)
        keys = self._keys
        self._reactions = Reactions(self._script)
        self._values = MockedValues(self._skillset, self._script, bus.now())
        self._publish: dict[str, Callable[[], None]] = {}
        for item in self._skillset.data:
            self._publish[item.name] = partial(self._sample, item.name, bus.advertise(keys.data(item.name)).put)
        if self._reactions.follow_goals:
            bus.subscribe(keys.mocked_goal("*"), message_reader(MockedGoal, self._reactions.on_goal), events=True)
            bus.subscribe(
                keys.status("*"),
                message_reader(GoalStatus, lambda status: self._take(self._reactions.on_status(status))),
                events=True,
            )
        if self._reactions.follow_resources:
            bus.subscribe(keys.resource_steps, message_reader(ResourceStep, self._on_step), events=True)
        serve(bus, keys.mocked_world, MockedWorldCall, self._answer)
        self._begin()

    def detach(self) -> None:
        if self._alive is not None:
            self._alive.cancel()

    def _begin(self) -> None:
        """Bring the world to its initial state, and check that the managers receive its data.

        Only then is the world ready: no start is refused because of a state or a datum that is still on its way.
        """
        self._unanswered = 0  # of the questions and requests that belong to the beginning
        self._take(self._reactions.begin())
        self._ask(self._keys.resource_states, encode(QueryStates()), "ask for the resources")
        for item in self._skillset.data:
            self._ask(self._keys.data(item.name), encode(QueryData()), f"ask for {item.name}")

    def _appear(self) -> None:
        self._publish_all()
        for item in self._skillset.data:
            self._bus.every(item.period or DEFAULT_PERIOD, self._publish[item.name])
        self._alive = self._bus.declare_alive(self._keys.alive(self.name))

    def _on_step(self, step: ResourceStep) -> None:
        for change in step.changes:
            self._take(self._reactions.on_resource(change))

    # --- what is due -------------------------------------------------------------------------------------------------

    def _take(self, dues: tuple[Due, ...]) -> None:
        for due in dues:
            if due.after > 0.0:
                timer = self._bus.after(due.after, partial(self._do, due))
                if due.goal_id is not None:
                    self._delayed[due.goal_id] = [*(self._delayed.get(due.goal_id) or ()), timer]
            else:
                self._do(due)

    def _do(self, due: Due) -> None:
        match due.action:
            case Trigger(resource, state):
                request = FireExtern(resource=resource, target=state, source=self.name, cause=due.cause)
                self._ask(self._keys.resource_extern, encode(request), f"bring {resource} to {state}")
            case Fire(event):
                request = FireEvent(event=event, source=self.name, cause=due.cause)
                self._ask(self._keys.event(event), encode(request), f"fire {event}")
            case SetDatum(datum, signal, inputs, goal_id):
                try:
                    self._set(datum, signal, dict(inputs), goal_id)
                except KeyError as error:
                    log.warning("%s stays as it is: the goal has no input %s", datum, error)
            case StopReactions(goal_id):
                for timer in self._delayed.pop(goal_id) or ():
                    timer.cancel()
                self._values.hold(goal_id, self._bus.now())
            case EndMockedGoal(skill, result):
                run = msgspec.to_builtins(MockRun(result=result, delay=0.0))
                request = encode(DirectMock(run=run, when="now"))
                self._bus.ask(self._keys.mocked_skill(skill), request, lambda answer: _complain(f"end {skill}", answer))

    def _ask(self, key: str, payload: bytes, what: str) -> None:
        belongs_to_beginning = self._alive is None
        self._unanswered += belongs_to_beginning

        def take(answer: Answer) -> None:
            _complain(what, answer)
            self._unanswered -= belongs_to_beginning
            if belongs_to_beginning and self._unanswered == 0:
                self._appear()

        ask_until_answered(self._bus, key, payload, take)

    # --- data --------------------------------------------------------------------------------------------------------

    def _sample(self, datum: str, put: Callable[[bytes], None]) -> None:
        now = self._bus.now()
        put(encode(DataSample(name=datum, value=self._values.sample(datum, now), t=now)))

    def _publish_all(self) -> None:
        for publish in self._publish.values():
            publish()

    def _set(self, datum: str, signal: Signal, inputs: dict[str, Any], goal_id: str | None = None) -> None:
        self._values.set(datum, signal, self._bus.now(), inputs, goal_id)
        self._publish[datum]()

    def _answer(self, call: MockedWorldCall, key: str) -> MockedData:
        del key
        if isinstance(call, ResetMock):
            self._values.reset(self._bus.now())
            self._publish_all()
        elif isinstance(call, SetMockedData):
            problems: list[str] = []
            signals = {name: fit_datum(raw, name, self._skillset, problems.append) for name, raw in call.data.items()}
            if problems:
                raise RefusedError(ErrorCode.BAD_REQUEST, " ".join(problems), help="See docs/mocks.md.")
            for name, signal in signals.items():
                if signal is not None:
                    self._set(name, signal, {})
        return MockedData(values=self._values.values(self._bus.now()))


def _complain(what: str, answer: Answer) -> None:
    if isinstance(answer, Refused):
        log.warning("could not %s: %s %s", what, answer.error.message, answer.error.help)
    elif not isinstance(answer, Answered):
        log.warning("could not %s: no reply", what)
