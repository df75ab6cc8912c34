"""A client's copy of the resource states, and the order in which it may show what it hears.

The steps of the resource manager and the statuses of goals come from different processes, so they may overtake each
other. A status names the step that it follows from. It is held back until the states of that step are known: a client
never sees the end of a goal before the change that ended it. `docs/semantics.md` states the rule.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from heapq import heapify, heappop, heappush
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from skillwing.services.protocol import GoalStatus, Record, ResourceStates, ResourceStep

Delivered: TypeAlias = ResourceStep | GoalStatus
"""Message whose turn has come."""


class Held(NamedTuple):
    """A status that waits for a step. order: of arrival. questions: number of those for the states before it came."""

    after_step: int
    order: int
    questions: int
    status: GoalStatus

    def answered_by(self, step: int, question: int) -> bool:
        """True if the states of that step, as the answer to that question, hold the step that it waits for."""
        return self.after_step <= step or self.questions < question


class CausalView:
    """Resource states, from steps and snapshots in any order, each any number of times.

    Every `take_...` returns the messages whose turn has come, in their order. Before the first snapshot, and for steps
    that are older or of another epoch, that is at once. Pure: its owner asks for the states if `waiting` lasts.
    """

    def __init__(self) -> None:
        self._states: dict[str, str] = {}
        self._changes: dict[str, tuple[int, Record]] = {}
        """Latest change of each resource that was heard of, with the number of its step."""
        self._early: dict[int, tuple[int, ResourceStep]] = {}
        """Steps of this epoch that wait for earlier ones, by number; each with the number of questions before it."""
        self._shown_early: frozenset[int] = frozenset()
        """Numbers of those that were shown before the first states of their epoch."""
        self._foreign: list[tuple[int, ResourceStep]] = []
        """Steps of which it is unknown whether they come before or after the states: no snapshot of their epoch is.
        Each with the number of questions before it came: only the answer to a later one tells which epoch is over."""
        self._held: list[Held] = []
        """A heap by step: a client that lags behind may hold thousands, and takes a step in the time of one."""
        self._arrived = 0
        self._shown: Held | None = None
        """Status of the latest step, among those that were shown before the first states."""
        self._questions = 0
        self._answered = 0
        self._questions_before = 0
        """Number of questions before that step was heard. The answer to a later one holds the step."""
        self._complete_after: int | None = None
        """Number of a question, while steps may be missing in the states: the answer to a later question holds them."""
        self._epoch = ""
        self.number: int | None = None
        """Number of the step whose states these are; None until known."""
        self.version = 0
        """Number that grows whenever `number` or the states change."""

    @property
    def ready(self) -> bool:
        """The states are known, and those of every step that a status was shown of."""
        return self.number is not None

    @property
    def states(self) -> Mapping[str, str]:
        """Live view; empty until the first snapshot."""
        return MappingProxyType(self._states) if self.ready else MappingProxyType({})

    @property
    def incomplete(self) -> bool:
        """True after `give_up`, or if the resource manager has lost steps, until the states are known again."""
        return self._complete_after is not None

    @property
    def waiting(self) -> bool:
        """True while something is missing: an earlier step, the states of another epoch, or the first states."""
        return bool(self._early or self._held or self._foreign) or self.incomplete or not self.ready

    def change_record(self, resource: str) -> str | None:
        """Id of the timeline record of the change that led to the resource's state; None if it was not seen."""
        _, change = self._changes.get(resource, (0, None))
        return change.id if change is not None and change.after == self._states.get(resource) else None

    def note_question(self) -> int:
        """Note a question for the states, or a request that they answer, and return its number, for the answer."""
        self._questions += 1
        return self._questions

    def take_step(self, step: ResourceStep) -> tuple[Delivered, ...]:
        """Take a step. One that comes early waits for those before it."""
        if self.number is None or step.epoch != self._epoch:
            self._foreign.append((self._questions, step))
            return (step,)
        if step.number <= self.number:
            if self._is_used_again(step):
                self._changes.clear()
                self._complete_after = self._questions
            self._note_changes(step)
            return (step,)
        self._early[step.number] = (self._questions, step)
        return (*self._not_shown(self._next_steps()), *self._due())

    def take_states(self, snapshot: ResourceStates, question: int) -> tuple[Delivered, ...]:
        """Take a snapshot, the answer to a question.

        The manager stores a step before it tells of it. So the answer holds the step of every status that came before
        the question, and every step that did. A manager that has lost steps does not hold them, and its states count.
        """
        known = self.number
        older = known is not None and snapshot.epoch == self._epoch and snapshot.step < known
        differs = self._differs(snapshot)
        if question < self._answered or (older and question <= self._questions_before):
            # An answer that newer states have overtaken.
            if differs and question >= self._answered:
                self._complete_after = self._questions
            return (*self._not_shown(self._unknown_to(snapshot, question)), *self._due(question))
        if known is None and self._shown and not self._shown.answered_by(snapshot.step, question):
            return ()
        self._answered = question
        other_epoch = known is None or snapshot.epoch != self._epoch
        left = self._begin_epoch(snapshot.epoch) if other_epoch else ()
        past = self._take_early(lambda number: number <= snapshot.step)
        for step in past:
            self._apply(step, self._questions)
        past += self._unknown_to(snapshot, question)
        if (snapshot.step, snapshot.states) != (self.number, self._states):
            self.version += 1
        self._states.update(snapshot.states)
        for gone in self._states.keys() - snapshot.states.keys():
            del self._states[gone]
        self._learn(snapshot.step, self._questions)
        if older or differs:
            # Changes of lost steps are no causes, and steps that came meanwhile seemed to be late ones.
            self._changes.clear()
            self._complete_after = self._questions
        elif self.incomplete and question > (self._complete_after or 0):
            self._complete_after = None
        self._foreign = [each for each in self._foreign if each[0] >= question and each[1].epoch != snapshot.epoch]
        return (*left, *self._not_shown((*past, *self._next_steps())), *self._due(question))

    def take_status(self, status: GoalStatus) -> tuple[Delivered, ...]:
        """Take a status of a goal."""
        self._arrived += 1
        held = Held(status.after_step, self._arrived, self._questions, status)
        if self.number is None:
            self._shown = max(held, self._shown or held, key=lambda each: each.after_step)
        elif held.after_step > self.number:
            heappush(self._held, held)
            return ()
        return (status,)

    def give_up(self) -> tuple[Delivered, ...]:
        """Show everything that is held back: the resource manager does not answer."""
        if self.number is None:
            return ()
        early = self._take_early()
        for step in early:
            self._apply(step, self._questions)
        held, self._held = self._held, []
        if early or held:
            self._complete_after = self._questions
        return (*self._not_shown(early), *_as_arrived(held))

    def _is_used_again(self, step: ResourceStep) -> bool:
        """True for a late step without a change that a step of its number had: that one was lost."""
        known = (change for number, change in self._changes.values() if number == step.number)
        return any(change not in step.records for change in known)

    def _differs(self, snapshot: ResourceStates) -> bool:
        """True for other states than those that are known after its step, or after a later one that left them alone.

        The resource manager has lost steps and used their numbers again.
        """
        if self.number is None or self.incomplete or snapshot.epoch != self._epoch or snapshot.step > self.number:
            return False
        return any(
            state != self._states.get(resource) and self._changes.get(resource, (0, None))[0] <= snapshot.step
            for resource, state in snapshot.states.items()
        )

    def _begin_epoch(self, epoch: str) -> tuple[ResourceStep, ...]:
        """Turn to the steps of another epoch. Return those of the old one that still wait: they change no state now."""
        left = tuple(self._not_shown(self._take_early()))
        self._epoch = epoch
        self._changes.clear()
        self._early = {heard[1].number: heard for heard in self._foreign if heard[1].epoch == epoch}
        self._shown_early = frozenset(self._early)
        return left

    def _unknown_to(self, snapshot: ResourceStates, question: int) -> tuple[ResourceStep, ...]:
        """Take out the early steps that came before the question of a snapshot, which does not hold them."""
        if snapshot.epoch != self._epoch:
            return ()
        return self._take_early(lambda number: number > snapshot.step and self._early[number][0] < question)

    def _take_early(self, which: Callable[[int], bool] = lambda number: True) -> tuple[ResourceStep, ...]:
        """Take out early steps, in their order."""
        return tuple(self._early.pop(number)[1] for number in sorted(self._early) if which(number))

    def _not_shown(self, steps: Iterable[ResourceStep]) -> Iterator[ResourceStep]:
        return (step for step in steps if step.number not in self._shown_early)

    def _next_steps(self) -> Iterator[ResourceStep]:
        while self.number is not None and (heard := self._early.pop(self.number + 1, None)) is not None:
            self._apply(heard[1], heard[0])
            yield heard[1]

    def _apply(self, step: ResourceStep, questions: int) -> None:
        """Take over the changes of a step. questions: number of those before it was heard."""
        self._states |= {change.subject: change.after for change in step.changes}
        self.version += 1
        self._note_changes(step)
        self._learn(step.number, questions)

    def _learn(self, number: int, questions: int) -> None:
        if number != self.number:
            self.number, self._questions_before = number, questions

    def _note_changes(self, step: ResourceStep) -> None:
        """Remember the changes of a step, unless later ones are known."""
        for change in step.changes:
            if step.number >= self._changes.get(change.subject, (0, None))[0]:
                self._changes[change.subject] = (step.number, change)

    def _due(self, question: int = 0) -> Iterator[GoalStatus]:
        """Take out the statuses whose step is known, and those that came before an answered question."""
        number, due = self.number or 0, list[Held]()
        while self._held and self._held[0].after_step <= number:
            due.append(heappop(self._held))
        if question:
            due += [each for each in self._held if each.answered_by(number, question)]
            self._held = [each for each in self._held if not each.answered_by(number, question)]
            heapify(self._held)
        return _as_arrived(due)


def _as_arrived(held: Iterable[Held]) -> Iterator[GoalStatus]:
    return (each.status for each in sorted(held, key=lambda each: each.order))
