"""Published steps of a resource manager, held to its replies, its journal and the goals' statuses (rule 11 of
docs/semantics.md).

Pure: what an observer has heard, a history, sentences about what does not fit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain

from sequential_manager import Reply

from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import Ended, ErrorReply, GoalStatus, RecordKind, ResourceStates, ResourceStep


@dataclass(frozen=True)
class Observed:
    """Knowledge of an observer of a history.

    begun: states before the first call. steps: in the order of their arrival. stored: ids of the timeline records in
    the journal, in order; None without a journal. kills: how often the process was killed. statuses: of the goals of
    real skill managers.
    """

    begun: ResourceStates
    steps: tuple[ResourceStep, ...]
    stored: tuple[str, ...] | None
    kills: int = 0
    statuses: tuple[GoalStatus, ...] = ()


@dataclass
class StepOrder:
    """Judgement of what was observed. missing: numbers that were stored and not sent, before returns of the process.
    problems: sentences, none if everything fits."""

    observed: Observed
    missing: list[range] = field(default_factory=list[range])
    problems: list[str] = field(default_factory=list[str])
    _steps: dict[int, ResourceStep] = field(default_factory=dict[int, ResourceStep])

    @property
    def missing_steps(self) -> int:
        return sum(map(len, self.missing))

    def judge(self, replies: Iterable[Reply]) -> None:
        """Find all problems, those of the replies too."""
        told = list(replies)
        self.problems += chain(
            self._problems_of_numbers(),
            self._problems_of_states([reply for reply in told if isinstance(reply, ResourceStates)]),
            self._problems_of_verdicts(told),
            self._problems_of_statuses(),
            self._problems_of_journal(),
        )

    def _problems_of_numbers(self) -> Iterator[str]:
        """Each number comes once, after the one before. Only a process that was killed leaves some out."""
        latest, returns = self.observed.begun.step, 0
        for step in self.observed.steps:
            if step.number in self._steps:
                if step != self._steps[step.number]:
                    yield f"Step {step.number} was published twice, with different content."
                continue
            if step.epoch != self.observed.begun.epoch:
                yield f"Step {step.number} belongs to another epoch."
            elif step.number <= latest:
                yield f"Step {step.number} was published after step {latest}."
            elif _is_return(step):
                returns += 1
                self.missing += [range(latest + 1, step.number)] if step.number > latest + 1 else []
            elif step.number > latest + 1:
                yield f"Step {step.number} was published after step {latest}, and nobody was killed."
            self._steps[step.number] = step
            latest = max(latest, step.number)
        if returns > self.observed.kills:
            yield f"The process has returned {returns} times, and was killed {self.observed.kills} times."

    def _problems_of_states(self, replies: Sequence[ResourceStates]) -> Iterator[str]:
        """States in a reply are the sum of the steps up to its number. After a missing step, a reply begins the sum."""
        by_number: dict[int, list[ResourceStates]] = {}
        for reply in (self.observed.begun, *replies):
            by_number.setdefault(reply.step, []).append(reply)
        states: dict[str, str] | None = None
        before = self.observed.begun.step
        for number in sorted(self._steps.keys() | by_number.keys()):
            if number > before + 1 or self._is_missing(number):
                states = None
            if number in self._steps:
                yield from self._apply(self._steps[number], states)
            elif number != self.observed.begun.step and not self._is_missing(number):
                yield f"Step {number} is that of a reply, and was not published."
                states = None
            for reply in by_number.get(number, ()):
                states = dict(reply.states) if states is None else states
                if (reply.epoch, reply.states) != (self.observed.begun.epoch, states):
                    yield f"A reply has {reply.states} after step {number} of epoch {reply.epoch}: it left {states}."
            before = number

    def _apply(self, step: ResourceStep, states: dict[str, str] | None) -> Iterator[str]:
        """Apply the changes of a step, if the states before it are known."""
        for change in step.changes:
            if states is None:
                return
            if states[change.subject] != change.before:
                yield f"Step {step.number} finds {change.subject} {change.before}: it was {states[change.subject]}."
            states[change.subject] = change.after

    def _is_missing(self, number: int) -> bool:
        return any(number in numbers for numbers in self.missing)

    def _problems_of_verdicts(self, replies: Iterable[Reply]) -> Iterator[str]:
        """A verdict names the step that has its record."""
        pushed = (verdict for step in self._steps.values() for verdict in step.verdicts)
        for verdict in chain(replies, pushed):
            if isinstance(verdict, ResourceStates | ErrorReply) or self._is_missing(verdict.step):
                continue
            if isinstance(verdict, Ended) and verdict.terminal is not None:
                continue  # a local outcome, whose record may be that of its manager
            step = self._steps.get(verdict.step)
            if step is None or verdict.record not in {record.id for record in step.records}:
                yield f"The verdict {verdict} has no record in step {verdict.step}."

    def _problems_of_statuses(self) -> Iterator[str]:
        """A status that follows from a step names it, or a later one of its goal."""
        steps = {record.id: step.number for step in self._steps.values() for record in step.records}
        latest = max(self._steps, default=self.observed.begun.step)
        for status in self.observed.statuses:
            told = f"The status {status.label} of {status.goal_id} names step {status.after_step}"
            if status.after_step > latest:
                yield f"{told}: the last one was {latest}."
            if status.cause in steps:
                if status.after_step < steps[status.cause]:
                    yield f"{told}. Its cause belongs to step {steps[status.cause]}."
            elif _is_of_a_step(status.cause) and status.cause not in (self.observed.stored or ()):
                yield f"{told}. No step has its cause, {status.cause}."

    def _problems_of_journal(self) -> Iterator[str]:
        """Published steps equal stored ones, and each missing step was stored as well."""
        if self.observed.stored is None:
            return
        place = {record: at for at, record in enumerate(self.observed.stored)}
        expected, before = 0, self.observed.begun.step
        for number, step in sorted(self._steps.items()):
            places = [place.get(record.id) for record in step.records]
            begins = places[0] if places else None
            if begins is None or places != list(range(begins, begins + len(places))):
                yield f"Step {number} was not stored as it was published."
                continue
            unsent, left_out = begins - expected, self._missing_between(before, number)
            if unsent < left_out or (unsent and not left_out):
                yield f"Before step {number}, {left_out} steps are missing, and {unsent} records were stored."
            expected, before = begins + len(places), number
        if expected != len(self.observed.stored):
            yield f"The last {len(self.observed.stored) - expected} records were stored, and not published."

    def _missing_between(self, before: int, number: int) -> int:
        return sum(len(numbers) for numbers in self.missing if before < numbers.start and numbers.stop <= number)


def _is_return(step: ResourceStep) -> bool:
    """True for the step by which a process continues from its journal."""
    return any(record.kind is RecordKind.PROCESS and record.after == "RESUMED" for record in step.records)


def _is_of_a_step(record: str | None) -> bool:
    """True for the id of a record of the resource manager."""
    return record is not None and record.partition("~")[0] == RESOURCE_MANAGER


def judge_order(observed: Observed, replies: Iterable[Reply]) -> StepOrder:
    """Judge the published steps of a history."""
    order = StepOrder(observed)
    order.judge(replies)
    return order
