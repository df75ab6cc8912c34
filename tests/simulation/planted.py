"""Mistakes put into the managers on purpose: a simulation that does not find them is worth nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from simulation.run import simulate
from skillwing.services.client.goal_tracker import GoalTracker
from skillwing.services.core import resource_core
from skillwing.services.core.grants import Ledger
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.snapshot import FinishedGoal, GrantEntry
from skillwing.services.journal.journal import Journal
from skillwing.services.managers.registration import Registration
from skillwing.services.protocol import Ended, Ending, EndKind, State
from skillwing.services.protocol import Granted as GrantedVerdict

Wrong = Callable[..., Any]


def _start_anew(right: Wrong) -> Wrong:
    def start(self: SkillCore, request: Any, now: float) -> Any:
        self._ended.pop(request.goal_id)
        return right(self, request, now)

    return start


def _answer_the_running_goal(right: Wrong) -> Wrong:
    def finish(self: SkillCore, run: Any, terminal: Any, now: float) -> None:
        if terminal.ending is Ending.BUSY:
            run.goal_id = terminal.running_goal
        right(self, run, terminal, now)

    return finish


def _release_at_the_request(right: Wrong) -> Wrong:
    def stop(self: SkillCore, run: Any, reason: str, cause: str | None, now: float) -> None:
        right(self, run, reason, cause, now)
        if run.stoppable:
            self._end(run, EndKind.INTERRUPT, reason)

    return stop


def _forget_early_interrupts(right: Wrong) -> Wrong:
    def interrupt(self: SkillCore, request: Any, now: float) -> Any:
        try:
            return right(self, request, now)
        finally:
            self._interrupted_early.pop(request.goal_id)

    return interrupt


def _dispatch_what_was_interrupted(right: Wrong) -> Wrong:
    def begin_answered(self: SkillCore, run: Any, answer: Any, now: float) -> None:
        if isinstance(answer, GrantedVerdict):
            run.state = State.VALIDATING
        right(self, run, answer, now)

    return begin_answered


def _never_force(right: Wrong) -> Wrong:
    def next_tick(self: SkillCore) -> float | None:
        run = self._run
        return None if run is not None and run.state is State.INTERRUPTING else right(self)

    return next_tick


def _judge_once(right: Wrong) -> Wrong:
    del right

    def enforce(self: ResourceCore, now: float) -> None:
        found = self._first_violation(now)
        if found is not None:
            self._violate(*found, {}, now)

    return enforce


def _count_from_one(right: Wrong) -> Wrong:
    del right

    def next_token(self: Ledger, now: float) -> int:
        del now
        self._last_token += 1
        return self._last_token

    return next_token


def _write_no_grants(right: Wrong) -> Wrong:
    def write(self: Journal, entries: Any, records: Any, now: float) -> None:
        right(self, [each for each in entries if not isinstance(each, GrantEntry)], records, now)

    return write


def _write_no_local_outcomes(right: Wrong) -> Wrong:
    def remember(self: Ledger, over: FinishedGoal) -> None:
        if not isinstance(over.verdict, Ended) or over.verdict.terminal is None:
            right(self, over)

    return remember


def _always(value: Any) -> Callable[[Wrong], Wrong]:
    return lambda right: lambda *args, **kwargs: value


BUGS: Mapping[str, tuple[tuple[Any, str, Callable[[Wrong], Wrong]], ...]] = {
    "a start with a known id runs the goal again": ((SkillCore, "start", _start_anew),),
    "a busy manager answers the running goal's id": ((SkillCore, "_finish", _answer_the_running_goal),),
    "resources are released when the interrupt is requested": ((SkillCore, "_stop", _release_at_the_request),),
    "an interrupt before the start is forgotten": ((SkillCore, "interrupt", _forget_early_interrupts),),
    "a goal interrupted before its grant is dispatched": (
        (SkillCore, "_begin_answered", _dispatch_what_was_interrupted),
    ),
    "nothing ends an interrupt that nobody confirms": ((SkillCore, "next_tick", _never_force),),
    "a question that nobody answers is not asked again": ((SkillCore, "_bear_silence", _always(None)),),
    "verdicts of the resource manager are not followed": (
        (SkillCore, "pushed", _always(())),
        (SkillCore, "renewed", _always(())),
    ),
    "goals outlive their owner": ((SkillCore, "owner_gone", _always(())),),
    "the lost effect is skipped": ((resource_core, "_lost_effect", _always(None)),),
    "preconditions are not judged with the start effect": ((ResourceCore, "_failing_preconditions", _always({})),),
    "invariants are judged once, not to the fixpoint": ((ResourceCore, "_enforce_invariants", _judge_once),),
    "tokens are counted from one": ((Ledger, "next_token", _count_from_one),),
    "grants are not written to the journal": ((Journal, "write", _write_no_grants),),
    "a local outcome is not written down": ((Ledger, "remember", _write_no_local_outcomes),),
    "a question in doubt that nobody answers is not asked again": ((SkillCore, "_bear_doubt", _always(None)),),
    "a replaced manager that nobody asks anything does not notice": ((Registration, "_ask_after", _always(None)),),
    "clients learn of no loss": ((GoalTracker, "probe", _always(None)), (GoalTracker, "judged", _always(None))),
}
"""By name: what is replaced, and by what it makes of the right one."""
LATE: Mapping[str, int] = {
    "nothing ends an interrupt that nobody confirms": 60,
    "goals outlive their owner": 165,
    "invariants are judged once, not to the fixpoint": 210,
    "tokens are counted from one": 75,
    "grants are not written to the journal": 80,
    "clients learn of no loss": 650,
    "a local outcome is not written down": 1885,
}
"""Where tests begin to look for those that take many seeds, so that they take little time."""
SEEDS = 2000
"""Seeds within which each of them has to be found."""


@contextmanager
def planted(name: str) -> Iterator[None]:
    """The managers with one of the bugs."""
    patches = [patch.object(where, what, wrong(getattr(where, what))) for where, what, wrong in BUGS[name]]
    for each in patches:
        each.start()
    try:
        yield
    finally:
        for each in patches:
            each.stop()


def find(name: str, first: int = 0) -> tuple[int, str] | None:
    """The first seed that finds a planted bug, and the promise that it finds broken."""
    with planted(name):
        for seed in range(first, SEEDS):
            problems = simulate(seed).problems
            if problems:
                return seed, problems[0].law
    return None
