"""Base of a generated `interface.py`: skills, resources and data for a script that waits.

Everything runs on the caller's thread: messages are taken in while one of these calls waits. It works on either bus,
so that a script can be tested in virtual time.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

from skillwing.services.bus import Answer, Answered, RunnableBus
from skillwing.services.client.connection import find_target, open_connection, require_schema
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.client.outcome import Outcome, Reading, Signature, known, typed_reading
from skillwing.services.client.retry import wait_for_answer
from skillwing.services.errors import SkillwingError, TimedOutError
from skillwing.services.protocol import DataReading, Keys, QueryData, ReadyReport, SkillReady, State, decode, encode

__all__ = ["Client", "Datum", "Goal", "Resource", "connect"]

R = TypeVar("R")
O = TypeVar("O")  # noqa: E741
F = TypeVar("F")
G = TypeVar("G", bound="Goal[Any, Any, Any]")
S = TypeVar("S", bound=str)
T = TypeVar("T")


@contextmanager
def connect(
    robot: str | None = None,
    *,
    endpoint: str | None = None,
    table: str | None = None,
    schema: str | None = None,
    client: str = "script",
    owns_goals: bool = True,
) -> Iterator[Client]:
    """Connect to a running system.

    owns_goals: goals that still run at the end of the context, or of the script, are interrupted, unless their skill
    says `owner_lost=continue`; with False they go on. robot, endpoint, table: as for `find_target`. schema: hash of the
    skillset that the caller was written for. client: names who asks, in goals and in the timeline. Raises
    NoSystemError, NoReplyError, and a SkillwingError where the system's skillset is another one.
    """
    target = find_target(robot, endpoint=endpoint, table=table, schema=schema)
    with open_connection(target, client=client) as connection:
        require_schema(connection, schema)
        yield Client(connection.bus, connection.make_interface(client, owns_goals=owns_goals))


class Client:
    """A script's connection. interface: the untyped client below it."""

    def __init__(self, bus: RunnableBus, interface: SkillsetInterface) -> None:
        self.bus = bus
        self.interface = interface
        self.keys = Keys(interface.skillset.name)

    def start(
        self,
        signature: Signature[R, O, F],
        inputs: Mapping[str, Any],
        *,
        goal_id: str | None = None,
        cause: str | None = None,
    ) -> Goal[R, O, F]:
        """Start a skill and return at once. Raises InvalidInputError for a value of a wrong type."""
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
        return kind(self, signature, self.interface.start(signature.skill, inputs, goal_id=goal_id, cause=cause))

    def ready(self, skill: str, inputs: Mapping[str, Any] | None = None) -> SkillReady:
        """Answer whether a skill may start now, and what is missing. Nothing is started, and no hook is called.

        inputs: None to ask without them. Raises UnknownNameError, InvalidInputError, RefusedError, NoReplyError.
        """
        name, key = self.interface.skillset.skill(skill).name, self.keys.resource_ready
        answer = self.answer(key, lambda take: self.interface.ask_ready(name, take, inputs))
        return decode(answer.payload, ReadyReport).skills[0]

    def wait_until(self, condition: Callable[[], bool], awaited: str, timeout: float | None = None) -> None:
        """Take in messages until a condition holds.

        awaited: a name of it for the error. Raises TimedOutError after `timeout` seconds, SkillwingError when the
        connection is closed.
        """
        if not self.bus.run_until(condition, timeout):
            if timeout is not None:
                raise TimedOutError(awaited, timeout)
            raise SkillwingError(f"{awaited} cannot come: the connection is closed. Connect again.")

    def take_in_messages(self) -> None:
        """Take in the messages that have arrived."""
        reached: list[bool] = []
        self.bus.post(lambda: reached.append(True))
        self.bus.run_until(lambda: bool(reached))

    def fire(self, event: str) -> None:
        """Fire an event of the skillset. Raises RefusedError if its guard does not hold, NoReplyError."""
        self.answer(self.keys.event(event), lambda take: self.interface.fire(event, take))

    def answer(self, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
        """Call `ask` with a callback and return its argument. Raises RefusedError, NoReplyError."""
        return wait_for_answer(self.bus, key, ask)


class Goal(Generic[R, O, F]):
    """A goal that this script has started. handle: its untyped side, live."""

    def __init__(self, client: Client, signature: Signature[R, O, F], handle: GoalHandle) -> None:
        self._client = client
        self._signature = signature
        self.handle = handle

    def __repr__(self) -> str:
        return repr(self.handle)

    @property
    def id(self) -> str:
        return self.handle.goal_id

    @property
    def state(self) -> State | None:
        """State of the goal now; None until the manager's first answer."""
        self._client.take_in_messages()
        return self.handle.state

    @property
    def done(self) -> bool:
        """The goal has got its one terminal answer."""
        self._client.take_in_messages()
        return self.handle.done

    def wait(self, timeout: float | None = None) -> Outcome[R, O]:
        """Wait for the end of the goal, whatever it is.

        Raises TimedOutError if it still runs after `timeout` seconds; the goal is left alone. Ctrl-C interrupts the
        goal and waits until it has stopped; a second Ctrl-C leaves it alone.
        """
        awaited = f"The end of `{self._signature.skill}`"
        try:
            self._client.wait_until(lambda: self.handle.done, awaited, timeout)
        except KeyboardInterrupt:
            self.interrupt()
            with contextlib.suppress(SkillwingError):  # the connection is closed
                self._client.wait_until(lambda: self.handle.done, awaited)
            raise
        return self._outcome()

    def interrupt(self) -> None:
        """Ask for the goal's end and return; `wait` waits for it. Repetition does no harm."""
        self._client.interface.interrupt(self.handle)

    def modify_inputs(self, inputs: Mapping[str, Any]) -> None:
        """Give the running goal new values for modifiable inputs; one of None stays. All are taken, or none.

        Generated goals have a typed `modify`. Raises RefusedError, also if the goal has ended; NoReplyError;
        InvalidInputError for a value of a wrong type.
        """
        client, interface = self._client, self._client.interface
        values = {name: value for name, value in inputs.items() if value is not None}
        key = client.keys.modify(self._signature.skill)
        client.answer(key, lambda take: interface.modify(self.handle, values, take))

    def feedback(self) -> Iterator[F]:
        """Feedback until the end of the goal. Between two iterations only the latest is kept."""
        seen = None
        while not self.handle.done:
            self._client.wait_until(
                lambda latest=seen: self.handle.done or self.handle.progress is not latest,
                f"Feedback of `{self._signature.skill}`",
            )
            if self.handle.progress is not seen:
                seen = self.handle.progress
                if (feedback := self._signature.feedback_in(seen)) is not None:
                    yield feedback

    def _outcome(self) -> Outcome[R, O]:
        assert self.handle.terminal is not None
        return self._signature.outcome(self.id, self.handle.terminal)


class Resource(Generic[S]):
    """A resource; S: the names of its states, as a Literal."""

    def __init__(self, client: Client, name: str) -> None:
        self._client = client
        self.name = name

    @property
    def state(self) -> S:
        """The state now. Raises SkillwingError before the resource manager's first answer."""
        self._client.take_in_messages()
        return known(self._client.interface.state(self.name), self.name)

    def wait_for(self, *states: S, timeout: float | None = None) -> S:
        """Wait until the resource is in one of these states, and return which. Raises TimedOutError."""
        interface = self._client.interface
        awaited = f"`{self.name}` in {' or '.join(states)}"
        self._client.wait_until(lambda: interface.state(self.name) in states, awaited, timeout)
        return known(interface.state(self.name), self.name)

    def trigger(self, state: S) -> None:
        """Drive an extern transition, in the functional layer's place. Raises RefusedError, NoReplyError."""
        client = self._client
        client.answer(client.keys.resource_extern, lambda take: client.interface.trigger(self.name, state, take))


class Datum(Generic[T]):
    """A datum of type T."""

    def __init__(self, client: Client, name: str, kind: type[T]) -> None:
        self._client = client
        self._kind = kind
        self.name = name

    def read(self) -> Reading[T]:
        """Ask the data manager for the latest value. Raises NoReplyError."""
        client = self._client
        key = client.keys.data(self.name)
        answer = client.answer(key, lambda take: client.bus.ask(key, encode(QueryData()), take))
        return typed_reading(decode(answer.payload, DataReading), self._kind)

    def wait_for(self, condition: Callable[[T], bool], timeout: float | None = None) -> T:
        """Wait for a fresh value for which the condition holds, and return it. Raises TimedOutError."""
        found: list[T] = []

        def look() -> bool:
            reading = typed_reading(self._client.interface.reading(self.name), self._kind)
            if reading.value is not None and not reading.stale and condition(reading.value):
                found.append(reading.value)
            return bool(found)

        self._client.wait_until(look, f"The awaited value of `{self.name}`", timeout)
        return found[0]
