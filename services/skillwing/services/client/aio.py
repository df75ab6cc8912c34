"""Base of a generated `aio.py`: skills, resources and data for asyncio.

async with connect("m600") as client:
    outcome = await client.start(DRIVE, {"distance": 3.0})

The network has a thread of its own. Requests are posted to that thread. Messages come back with
`call_soon_threadsafe`, and wake all waiters. Everything here is for the thread of the event loop.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Generator, Mapping
from contextlib import asynccontextmanager
from typing import Any, Generic, TypeVar

from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Answer, Answered, Bus, NoReply
from skillwing.services.client.connection import find_target, open_connection, require_schema
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.client.network_thread import NetworkThread
from skillwing.services.client.outcome import Outcome, Reading, Signature, known, typed_reading
from skillwing.services.client.retry import accepted
from skillwing.services.errors import RefusedError, SkillwingError
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import (
    DataReading,
    Keys,
    ProtocolError,
    QueryData,
    ReadyReport,
    SkillReady,
    State,
    Terminal,
    decode,
    encode,
    require_sendable,
)

__all__ = ["Client", "Datum", "Goal", "Resource", "connect"]

R = TypeVar("R")
O = TypeVar("O")  # noqa: E741
F = TypeVar("F")
G = TypeVar("G", bound="Goal[Any, Any, Any]")
S = TypeVar("S", bound=str)
T = TypeVar("T")


@asynccontextmanager
async def connect(
    robot: str | None = None,
    *,
    endpoint: str | None = None,
    table: str | None = None,
    schema: str | None = None,
    client: str = "script",
    owns_goals: bool = True,
) -> AsyncIterator[Client]:
    """Connect to a running system; see `skillwing.services.client.sync.connect`."""
    network = NetworkThread()

    def live() -> None:
        target = find_target(robot, endpoint=endpoint, table=table, schema=schema)
        with open_connection(target, client=client) as connection:
            require_schema(connection, schema)
            network.serve(connection.bus, connection.make_interface(client, owns_goals=owns_goals))

    try:
        connected = Client(*await network.start(live))
        network.ended.add_done_callback(lambda ended: connected.close())
        yield connected
    finally:
        await network.stop()


class Client:
    """A script's connection, for the thread of the event loop. The interface belongs to the thread of the bus."""

    def __init__(self, bus: Bus, interface: SkillsetInterface) -> None:
        self._loop = asyncio.get_running_loop()
        self.bus = bus
        self.interface = interface
        self.keys = Keys(interface.skillset.name)
        self.states: Mapping[str, str] = dict(interface.states)
        """State of each resource, by name."""
        self._readings: dict[str, DataReading] = {}
        self._waiters: set[asyncio.Future[None]] = set()
        self._closed = False
        bus.post(self._listen)

    def start(
        self,
        signature: Signature[R, O, F],
        inputs: Mapping[str, Any],
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> Goal[R, O, F]:
        """Start a skill; await the goal for its end. Raises InvalidInputError for a value of a wrong type."""
        return self.start_as(Goal[R, O, F], signature, inputs, goal_id=goal_id, cause=cause)

    def start_as(
        self,
        kind: type[G],
        signature: Signature[Any, Any, Any],
        inputs: Mapping[str, Any],
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> G:
        """Start a skill as `start` does. kind: the class of the goal, with methods of its own."""
        fitted = self.interface.fitted(signature.skill, inputs)
        goal = kind(self, signature, goal_id or new_goal_id())

        def begin() -> None:
            try:
                goal.begin(self.interface.start(signature.skill, fitted, goal_id=goal.id, cause=cause))
            except (ProtocolError, RefusedError) as error:  # inputs that no message can hold, or keys without the right
                goal.fail(error)

        self.bus.post(begin)
        return goal

    async def ready(self, skill: str, inputs: Mapping[str, Any] | None = None) -> SkillReady:
        """Answer whether a skill may start now; see `skillwing.services.client.sync.Client.ready`.

        Raises as that does, and ProtocolError for inputs too large to be sent.
        """
        name = self.interface.skillset.skill(skill).name
        fitted = None if inputs is None else self.interface.fitted(name, inputs)
        require_sendable(fitted)
        key = self.keys.resource_ready
        answer = await self.answer(key, lambda take: self.interface.ask_ready(name, take, fitted))
        return decode(answer.payload, ReadyReport).skills[0]

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition on the known goals, resources and data holds.

        Raises SkillwingError when the connection is closed.
        """
        while not condition():
            if self._closed:
                raise SkillwingError("The connection is closed, so that nothing comes in any more. Connect again.")
            waiter = self._loop.create_future()
            self._waiters.add(waiter)
            try:
                await waiter
            finally:
                self._waiters.discard(waiter)

    async def answer(self, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
        """Call `ask` with a callback on the bus's thread and return the callback's argument.

        Raises RefusedError, NoReplyError.
        """
        answers: list[Answer] = []
        problems: list[Exception] = []

        def take(answer: Answer) -> None:
            self.on_loop(lambda: answers.append(answer))

        def ask_there() -> None:
            try:
                ask(take)
            except UnknownNameError as error:
                problem = error
                self.on_loop(lambda: problems.append(problem))

        self.bus.post(ask_there)
        await self.until(lambda: bool(answers or problems))
        if problems:
            raise problems[0]
        return accepted(answers[0], key)

    async def fire(self, event: str) -> None:
        """Fire an event of the skillset. Raises RefusedError if its guard does not hold, NoReplyError."""
        await self.answer(self.keys.event(event), lambda take: self.interface.fire(event, take))

    def reading(self, datum: str) -> DataReading | None:
        """The latest received value of a datum; None before the first."""
        return self._readings.get(datum)

    def on_loop(self, action: Callable[[], None]) -> None:
        """Run an action on the event loop's thread, and wake all waiters there. Call it on the bus's thread.

        The states of now come with it: a task that wakes sees the end of a goal and the states after it together.
        """
        states = dict(self.interface.states)
        with contextlib.suppress(RuntimeError):  # the loop is closed: nothing waits
            self._loop.call_soon_threadsafe(self._take_in, states, action)

    def close(self) -> None:
        """End all waiting with an error: the bus is closed."""
        self._closed = True
        self._wake()

    def _take_in(self, states: Mapping[str, str], news: Callable[[], None]) -> None:
        self.states = states
        news()
        self._wake()

    def _wake(self) -> None:
        for waiter in self._waiters:
            if not waiter.done():
                waiter.set_result(None)

    def _listen(self) -> None:
        self.interface.on_change(self._copy_states)
        self.interface.on_data(self._copy_reading)
        self._copy_states()
        for item in self.interface.skillset.data:
            reading = self.interface.reading(item.name)
            if not reading.stale:
                self._copy_reading(reading)

    def _copy_states(self) -> None:
        self.on_loop(lambda: None)

    def _copy_reading(self, reading: DataReading) -> None:
        def take() -> None:
            self._readings[reading.name] = reading

        self.on_loop(take)


class Goal(Generic[R, O, F]):
    """A goal that this script has started. Await it for its outcome."""

    def __init__(self, client: Client, signature: Signature[R, O, F], goal_id: str) -> None:
        self.id = goal_id
        self.state: State | None = None
        """State of the goal; None until the manager's first answer."""
        self._client = client
        self._signature = signature
        self._progress: dict[str, Any] | None = None
        self._terminal: Terminal | None = None
        self._error: Exception | None = None
        self._handle: GoalHandle | None = None

    def __repr__(self) -> str:
        phase = self._terminal.label if self._terminal else self.state or "SENT"
        return f"<goal {self.id} of {self._signature.skill}: {phase}>"

    @property
    def done(self) -> bool:
        """True if the goal has its terminal answer, or could not be sent."""
        return self._terminal is not None or self._error is not None

    def __await__(self) -> Generator[Any, None, Outcome[R, O]]:
        return self.wait().__await__()

    async def wait(self) -> Outcome[R, O]:
        """Wait for any end of the goal. Raises ProtocolError for inputs too large to be sent.

        A task that is cancelled here, also by `asyncio.timeout`, interrupts the goal. It ends when the goal has
        stopped, so that its resources are free. A second cancellation leaves the goal alone. If several tasks wait and
        one is cancelled, the goal is interrupted for all of them.
        """
        try:
            await self._client.until(lambda: self.done)
        except asyncio.CancelledError:
            self.interrupt()
            with contextlib.suppress(SkillwingError):  # the connection is closed
                await self._client.until(lambda: self.done)
            raise
        if self._error is not None:
            raise self._error
        assert self._terminal is not None
        return self._signature.outcome(self.id, self._terminal)

    def interrupt(self) -> None:
        """Ask for the goal's end and return; await the goal for the end itself. Repetition does no harm."""
        self._client.bus.post(self._interrupt)

    async def modify_inputs(self, inputs: Mapping[str, Any]) -> None:
        """Give the running goal new inputs; see `skillwing.services.client.sync.Goal.modify_inputs`."""
        client, interface = self._client, self._client.interface
        given = {name: value for name, value in inputs.items() if value is not None}
        values = interface.fitted_changes(self._signature.skill, given)
        require_sendable(values)
        key = client.keys.modify(self._signature.skill)

        def ask(take: Callable[[Answer], None]) -> None:
            if self._handle is None:
                take(NoReply(timed_out=False))
            else:
                interface.modify(self._handle, values, take)

        await client.answer(key, ask)

    async def feedback(self) -> AsyncIterator[F]:
        """Feedback until the end of the goal. Between two iterations only the latest is kept.

        A task that is cancelled here does not interrupt the goal.
        """
        seen = None
        while not self.done:
            await self._client.until(lambda latest=seen: self.done or self._progress is not latest)
            if self._progress is not seen:
                seen = self._progress
                if (feedback := self._signature.feedback_in(seen)) is not None:
                    yield feedback

    def begin(self, handle: GoalHandle) -> None:
        """Follow the started goal. Call it on the bus's thread."""
        self._handle = handle
        handle.on_change(self._copy)
        self._copy(handle)

    def fail(self, error: Exception) -> None:
        """Fail the goal, which cannot be started. Call it on the bus's thread."""

        def take() -> None:
            self._error = error

        self._client.on_loop(take)

    def _interrupt(self) -> None:
        if self._handle is not None:
            try:
                self._client.interface.interrupt(self._handle)
            except RefusedError as error:  # keys without the right
                self.fail(error)

    def _copy(self, handle: GoalHandle) -> None:
        state, terminal, progress = handle.state, handle.terminal, handle.progress

        def take() -> None:
            self.state, self._terminal, self._progress = state, terminal, progress

        self._client.on_loop(take)


class Resource(Generic[S]):
    """A resource; S: the names of its states, as a Literal."""

    def __init__(self, client: Client, name: str) -> None:
        self._client = client
        self.name = name

    @property
    def state(self) -> S:
        """The last known state. Raises SkillwingError before the resource manager's first answer."""
        return known(self._client.states.get(self.name), self.name)

    async def wait_for(self, *states: S) -> S:
        """Wait until the resource is in one of these states, and return which."""
        await self._client.until(lambda: self._client.states.get(self.name) in states)
        return self.state

    async def trigger(self, state: S) -> None:
        """Drive an extern transition, in the functional layer's place. Raises RefusedError, NoReplyError."""
        interface, key = self._client.interface, self._client.keys.resource_extern
        await self._client.answer(key, lambda take: interface.trigger(self.name, state, take))


class Datum(Generic[T]):
    """A datum of type T."""

    def __init__(self, client: Client, name: str, kind: type[T]) -> None:
        self._client = client
        self._kind = kind
        self.name = name

    async def read(self) -> Reading[T]:
        """Ask the data manager for the latest value. Raises NoReplyError."""
        client, key = self._client, self._client.keys.data(self.name)
        answer = await client.answer(key, lambda take: client.bus.ask(key, encode(QueryData()), take))
        return typed_reading(decode(answer.payload, DataReading), self._kind)

    async def wait_for(self, condition: Callable[[T], bool]) -> T:
        """Wait for a value for which the condition holds, and return it."""
        async for value in self.values():
            if condition(value):
                return value
        raise AssertionError("unreachable")

    async def values(self) -> AsyncIterator[T]:
        """The present value and each new one, without end. Between two iterations only the latest is kept."""
        seen: DataReading | None = None
        while True:
            await self._client.until(lambda latest=seen: self._client.reading(self.name) is not latest)
            seen = self._client.reading(self.name)
            if seen is not None and (value := typed_reading(seen, self._kind).value) is not None:
                yield value
