"""A client's copy of the resource states, and the order in which it may show what it hears.

The steps of the resource manager and the statuses of goals come from different processes, so they may overtake each
other. A status names the step that it follows from. It is held back until the states of that step are known: a client
never sees the end of a goal before the change that ended it. `docs/semantics.md` states the rule.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

from skillwing.services.protocol import GoalStatus, ResourceStates, ResourceStep

Delivered: TypeAlias = ResourceStep | GoalStatus
"""Message whose turn has come."""


class Held(NamedTuple):
    """A status that waits for a step. questions: number of questions for the states before it came."""

    after_step: int
    questions: int
    status: GoalStatus

    def answered_by(self, step: int, question: int) -> bool:
        """True if the states of that step, as the answer to that question, hold the step that it waits for."""
        return self.after_step <= step or self.questions < question


class CausalView:
    """Resource states, from steps and snapshots in any order, each any number of times.

    Every `take_...` returns the messages whose turn has come, in their order. Before the first snapshot, and for older
    steps, that is at once. Pure: its owner asks for the states if `waiting` lasts.
    """

    def __init__(self) -> None:
        self._states: dict[str, str] = {}
        self._records: dict[str, str] = {}
        self._early: dict[int, ResourceStep] = {}
        self._held: list[Held] = []
        self._shown: Held | None = None
        """Status of the latest step, among those that were shown before the first states."""
        self._questions = 0
        self._manager_is_new = False
        self.number: int | None = None
        """Number of the step whose states these are; None until known."""

    @property
    def ready(self) -> bool:
        """The states are known, and those of every step that a status was shown of."""
        return self.number is not None

    @property
    def states(self) -> Mapping[str, str]:
        """Live view; empty until the first snapshot."""
        return MappingProxyType(self._states) if self.ready else MappingProxyType({})

    @property
    def waiting(self) -> bool:
        """True while something is missing: an earlier step, or the first states."""
        return bool(self._early or self._held) or not self.ready

    def change_record(self, resource: str) -> str | None:
        """Id of the timeline record of the resource's last change; None if no change was seen."""
        return self._records.get(resource)

    def expect_new_manager(self) -> None:
        """Accept lower numbers from a new resource manager. States stay as they were until its snapshot arrives."""
        self._manager_is_new = True

    def note_question(self) -> int:
        """Note a question for the states, and return its number, for the answer."""
        self._questions += 1
        return self._questions

    def take_step(self, step: ResourceStep) -> tuple[Delivered, ...]:
        """Take a step. One that comes early waits for those before it."""
        if self.number is not None and step.number <= self.number:
            return (step,)
        self._early[step.number] = step
        return (step,) if self.number is None else (*self._next_steps(), *self._due())

    def take_states(self, snapshot: ResourceStates, question: int = 0) -> tuple[Delivered, ...]:
        """Take a snapshot, the answer to a question.

        The manager stores a step before it tells of it. So the answer holds the step of every status that came before
        the question. A manager without a journal may have lost that step.
        """
        known = self.number if not self._manager_is_new else None
        if known is not None and snapshot.step < known:
            return tuple(self._due(question))
        if self.number is None and self._shown and not self._shown.answered_by(snapshot.step, question):
            return ()
        was_ready, self._manager_is_new = self.ready, False
        past = tuple(self._early.pop(number) for number in sorted(self._early) if number <= snapshot.step)
        for step in past:
            self._apply(step)
        self._states.update(snapshot.states)
        self.number = snapshot.step
        steps = (*past, *self._next_steps())
        return (*(steps if was_ready else ()), *self._due(question))

    def take_status(self, status: GoalStatus) -> tuple[Delivered, ...]:
        """Take a status of a goal."""
        held = Held(status.after_step, self._questions, status)
        if self.number is None:
            self._shown = max(held, self._shown or held, key=lambda each: each.after_step)
        elif held.after_step > self.number:
            self._held.append(held)
            return ()
        return (status,)

    def give_up(self) -> tuple[Delivered, ...]:
        """Show everything that is held back: the resource manager does not answer."""
        if self.number is None:
            return ()
        early = tuple(self._early.pop(number) for number in sorted(self._early))
        for step in early:
            self._apply(step)
        held, self._held = self._held, []
        return (*early, *(each.status for each in held))

    def _next_steps(self) -> Iterator[ResourceStep]:
        while self.number is not None and (step := self._early.pop(self.number + 1, None)) is not None:
            self._apply(step)
            yield step

    def _apply(self, step: ResourceStep) -> None:
        for change in step.changes:
            self._states[change.subject] = change.after
            self._records[change.subject] = change.id
        self.number = step.number

    def _due(self, question: int = 0) -> Iterator[GoalStatus]:
        """Take out the statuses whose step is known, and those that came before an answered question."""
        held, self._held = self._held, []
        for each in held:
            if each.answered_by(self.number or 0, question):
                yield each.status
            else:
                self._held.append(each)
