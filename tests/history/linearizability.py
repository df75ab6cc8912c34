"""Could a history of concurrent operations have happened one after the other?

The search of Wing and Gong (1993), with the memory of configurations that Lowe (2017) added. Operations are taken out
of the history one at a time, each between its call and its answer, as long as a sequential model agrees. If not,
the last one is put back. Pure: a model, a history, a verdict.

Operations without an answer would double the configurations, each by itself. So one that changes nothing is left out,
and of those with the same call the first one comes first. Both lose no order: such an operation may happen or not, and
one that was called before another can take its place.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

S = TypeVar("S", bound=Hashable)
C = TypeVar("C")
A = TypeVar("A")
C_contra = TypeVar("C_contra", contravariant=True)
A_contra = TypeVar("A_contra", contravariant=True)


@dataclass(frozen=True, slots=True)
class Operation(Generic[C, A]):
    """One request of a client, and its answer.

    called, answered: when, in any unit. answer, answered: None where no answer came: then the operation may have
    happened at any time after its call, or never.
    """

    client: str
    call: C
    answer: A | None
    called: int
    answered: int | None


class Model(Protocol[S, C_contra, A_contra]):
    """The same thing for one client at a time. Its states are values."""

    @property
    def initial(self) -> S: ...
    def step(self, state: S, call: C_contra, answer: A_contra | None) -> S | None:
        """The state after the call, or None if it cannot have had that answer; any answer will do for None."""
        ...


@dataclass(frozen=True, slots=True)
class Verdict(Generic[C, A]):
    """Verdict on a history: linearizable or not.

    order: one order in which it can have happened, or the longest that could be found. stuck: operations of which one
    would have had to come next, none of which can. steps: how often the model was asked.
    """

    linearizable: bool
    order: tuple[Operation[C, A], ...]
    stuck: tuple[Operation[C, A], ...]
    steps: int

    def __str__(self) -> str:
        if self.linearizable:
            return f"linearizable: {len(self.order)} operations in {self.steps} steps"
        lines = [f"not linearizable: of the longest order, {len(self.order)} operations, the last ones are"]
        lines += [f"    {each.client}: {each.call} -> {each.answer}" for each in self.order[-5:]]
        lines += ["and none of these can come next:"]
        lines += [f"    {each.client}: {each.call} -> {each.answer}" for each in self.stuck]
        return "\n".join(lines)


class UndecidedError(Exception):
    """A search that was given up. The time of a search may grow exponentially with the calls at once."""


def check(model: Model[S, C, A], history: Sequence[Operation[C, A]], most_steps: float = math.inf) -> Verdict[C, A]:
    """Search for an order. An operation that was never answered need not be in it.

    Raises UndecidedError after `most_steps` questions to the model.
    """
    search = _Search(model, history)
    return search.run(most_steps)


class _Search(Generic[S, C, A]):
    def __init__(self, model: Model[S, C, A], history: Sequence[Operation[C, A]]) -> None:
        self._model = model
        self._history = history
        self._events = _Events(history)
        self._open = sum(operation.answered is not None for operation in history)
        self._taken: list[tuple[int, S]] = []
        self._best: tuple[int, ...] = ()
        self._stuck: tuple[int, ...] = ()
        self._before = _same_before(history)

    def run(self, most_steps: float) -> Verdict[C, A]:
        """Take the first operation that fits, again and again; undo the last one where none fits.

        Those without an answer are tried last. One that is taken too early is found out late: its client waits for its
        timeout, and the others go on. One that has to come next is found out at once.
        """
        events, history = self._events, self._history
        state, mask, steps = self._model.initial, 0, 0
        seen: set[tuple[int, S]] = {(mask, state)}
        event, answered = events.first, True
        while self._open:
            index = events.called_by(event)
            if index is None and answered:
                event, answered = events.first, False
                continue
            if index is None:
                # Whatever comes next has to come before this answer, and nothing that was called by then fits.
                self._note_dead_end(event)
                if not self._taken:
                    return self._verdict(False, steps)
                index, state = self._taken.pop()
                mask &= ~(1 << index)
                answered = history[index].answered is not None
                self._open += answered
                events.put_back(index)
                event = events.after(events.call(index))
                continue
            before = self._before.get(index)
            is_early = before is not None and not mask >> before & 1
            if is_early or answered != (history[index].answered is not None):
                event = events.after(event)
                continue
            steps += 1
            if steps > most_steps:
                raise UndecidedError(f"No verdict after {most_steps:g} steps.")
            after = self._model.step(state, history[index].call, history[index].answer)
            is_needless = history[index].answered is None and after == state
            configuration = None if after is None or is_needless else (mask | 1 << index, after)
            if configuration is None or configuration in seen:
                event = events.after(event)
                continue
            seen.add(configuration)
            self._taken.append((index, state))
            mask, state = configuration
            self._open -= history[index].answered is not None
            events.take_out(index)
            event, answered = events.first, True
        self._best = tuple(index for index, _ in self._taken)
        return self._verdict(True, steps)

    def _note_dead_end(self, event: int) -> None:
        if len(self._taken) >= len(self._best):
            self._best = tuple(index for index, _ in self._taken)
            self._stuck = self._events.calls_before(event)

    def _verdict(self, linearizable: bool, steps: int) -> Verdict[C, A]:
        history = self._history
        order = tuple(history[index] for index in self._best)
        stuck = () if linearizable else tuple(history[index] for index in self._stuck)
        return Verdict(linearizable, order, stuck, steps)


def _same_before(history: Sequence[Operation[C, A]]) -> dict[int, int]:
    """The operation before each one without an answer, of those with the same call and no answer."""
    unanswered = [index for index, each in enumerate(history) if each.answered is None]
    latest: dict[str, int] = {}
    before: dict[int, int] = {}
    for index in sorted(unanswered, key=lambda index: history[index].called):
        call = repr(history[index].call)  # calls may hold what has no hash
        if call in latest:
            before[index] = latest[call]
        latest[call] = index
    return before


class _Events:
    """Calls and answers in order of time, as a linked list from which operations can be taken and put back.

    An answer at the very time of a call comes after it: then nobody knows which was first.
    """

    def __init__(self, history: Sequence[Operation[C, A]]) -> None:
        times = [(each.called, 0, index) for index, each in enumerate(history)]
        times += [(each.answered, 1, index) for index, each in enumerate(history) if each.answered is not None]
        self._calls: dict[int, int] = {}
        self._answers: dict[int, int] = {}
        self._index: list[int | None] = [None]
        for event, (_, is_answer, index) in enumerate(sorted(times), start=1):
            (self._answers if is_answer else self._calls)[index] = event
            self._index.append(None if is_answer else index)
        count = len(self._index)
        self._next = [*range(1, count), 0]
        self._previous = [count - 1, *range(count - 1)]

    @property
    def first(self) -> int:
        return self._next[0]

    def after(self, event: int) -> int:
        return self._next[event]

    def call(self, index: int) -> int:
        return self._calls[index]

    def called_by(self, event: int) -> int | None:
        """The operation whose call this is; None for an answer."""
        return self._index[event]

    def calls_before(self, event: int) -> tuple[int, ...]:
        """The operations that are still there and were called before this event."""
        found: list[int] = []
        each = self.first
        while each != event:
            index = self._index[each]
            assert index is not None
            found.append(index)
            each = self._next[each]
        return tuple(found)

    def take_out(self, index: int) -> None:
        for event in self._events_of(index):
            self._next[self._previous[event]] = self._next[event]
            self._previous[self._next[event]] = self._previous[event]

    def put_back(self, index: int) -> None:
        for event in reversed(self._events_of(index)):
            self._next[self._previous[event]] = event
            self._previous[self._next[event]] = event

    def _events_of(self, index: int) -> tuple[int, ...]:
        answer = self._answers.get(index)
        return (self._calls[index],) if answer is None else (self._calls[index], answer)
