"""Deliberate bugs in the managers: a simulation that does not find them is worth nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from simulation.run import simulate
from skillwing.services.client.causal_feed import CausalFeed
from skillwing.services.client.causal_view import CausalView, Held
from skillwing.services.client.goal_tracker import GoalTracker
from skillwing.services.core import ends, externs_and_events, grants, invariants, losses, readiness
from skillwing.services.core.delivery import Delivery
from skillwing.services.core.goal_states import (
    Asking,
    AskingCancelled,
    Finished,
    GoalRun,
    Reaction,
    Stopping,
    Unstopped,
)
from skillwing.services.core.ledger import Ledger
from skillwing.services.core.manager_state import ManagerState
from skillwing.services.core.modifications import Modifications
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.skill_events import RenewalAnswered
from skillwing.services.core.snapshot import FinishedGoal, GrantEntry
from skillwing.services.journal.journal import Journal
from skillwing.services.managers import skill_manager
from skillwing.services.managers.registration import Registration
from skillwing.services.protocol import (
    BeginGoal,
    Ended,
    EndGoal,
    Ending,
    EndKind,
    Lost,
    RecordOutcome,
    Violated,
)

Wrong = Callable[..., Any]


def _start_again(right: Wrong) -> Wrong:
    def start(self: SkillCore, request: Any, now: float) -> Any:
        self._finished.pop(request.goal_id)
        return right(self, request, now)

    return start


def _answer_the_running_goal(right: Wrong) -> Wrong:
    def publish(self: SkillCore, run: GoalRun, now: float) -> None:
        if isinstance(run.state, Finished) and run.state.terminal.ending is Ending.BUSY:
            run.goal_id = run.state.terminal.running_goal or ""
        right(self, run, now)

    return publish


def _release_at_the_request(right: Wrong) -> Wrong:
    def stop(self: Unstopped, *args: Any) -> Reaction:
        stopping, _, cause = right(self, *args)
        state, action, _ = stopping.ask_end(EndKind.INTERRUPT, stopping.reason)
        return state, action, cause

    return stop


def _forget_early_interrupts(right: Wrong) -> Wrong:
    def interrupt(self: SkillCore, request: Any, now: float) -> Any:
        try:
            return right(self, request, now)
        finally:
            self._interrupted_early.pop(request.goal_id)

    return interrupt


def _dispatch_what_was_interrupted(right: Wrong) -> Wrong:
    del right
    return Asking.on


def _never_force(right: Wrong) -> Wrong:
    def next_tick(self: SkillCore) -> float | None:
        run = self.current
        return None if run is not None and isinstance(run.state, Stopping) else right(self)

    return next_tick


def _judge_once(right: Wrong) -> Wrong:
    del right

    def enforce(state: ManagerState, now: float) -> None:
        violation = invariants.first_violation(state, now)
        if violation is not None:
            invariants._end_violated(state, violation, {}, now)

    return enforce


def _count_from_one(right: Wrong) -> Wrong:
    del right

    def next_token(self: Ledger, now: float) -> int:
        del now
        self._last_token += 1
        return self._last_token

    return next_token


def _write_no_grants(right: Wrong) -> Wrong:
    def write(self: Journal, entries: Any, *rest: Any) -> None:
        right(self, [each for each in entries if not isinstance(each, GrantEntry)], *rest)

    return write


def _write_no_local_outcomes(right: Wrong) -> Wrong:
    def remember(self: Ledger, over: FinishedGoal) -> None:
        if not isinstance(over.verdict, Ended) or over.verdict.terminal is None:
            right(self, over)

    return remember


def _retry_only(*calls: type) -> Callable[[Wrong], Wrong]:
    def wrong(right: Wrong) -> Wrong:
        return lambda self, asked, **waits: right(self, asked, **waits) if isinstance(asked.call, calls) else None

    return wrong


def _ignore(*events: type) -> Callable[[Wrong], Wrong]:
    return lambda right: lambda self, event, now: () if isinstance(event, events) else right(self, event, now)


def _keep_the_inputs(right: Wrong) -> Wrong:
    def apply(self: Modifications, run: GoalRun, before: Any) -> str:
        inputs = run.inputs
        text = right(self, run, before)
        run.inputs = inputs
        return text

    return apply


def _name_no_step(right: Wrong) -> Wrong:
    def publish(self: SkillCore, run: GoalRun, *args: Any) -> None:
        run.step = 0
        right(self, run, *args)

    return publish


def _show_at_once(right: Wrong) -> Wrong:
    del right
    return lambda self, status: (status,)


def _lose_at_once(right: Wrong) -> Wrong:
    del right
    return lambda self, skill, goal_id, then: then("")


def _ignore_gaps(right: Wrong) -> Wrong:
    def take_step(self: CausalView, step: Any) -> Any:
        if self.number is not None and step.epoch == self._epoch and step.number > self.number:
            self.number = step.number - 1
        return right(self, step)

    return take_step


def _take_old_answers(right: Wrong) -> Wrong:
    del right
    return lambda self, step, question: self.after_step <= step or self.questions <= question


def _keep_the_cause(right: Wrong) -> Wrong:
    del right
    return lambda self, resource: self._changes[resource][1].id if resource in self._changes else None


def _always(value: Any) -> Callable[[Wrong], Wrong]:
    return lambda right: lambda *args, **kwargs: value


BUGS: Mapping[str, tuple[tuple[Any, str, Callable[[Wrong], Wrong]], ...]] = {
    "a start with a known id runs the goal again": ((SkillCore, "_start", _start_again),),
    "a busy manager answers the running goal's id": ((SkillCore, "_publish", _answer_the_running_goal),),
    "resources are released when the interrupt is requested": ((Unstopped, "stop", _release_at_the_request),),
    "an interrupt before the start is forgotten": ((SkillCore, "_interrupt", _forget_early_interrupts),),
    "a goal interrupted before its grant is dispatched": ((AskingCancelled, "on", _dispatch_what_was_interrupted),),
    "nothing ends an interrupt that nobody confirms": ((SkillCore, "next_tick", _never_force),),
    "a question that nobody answers is not asked again": ((Delivery, "retry_or_fail", _retry_only(RecordOutcome)),),
    "verdicts of the resource manager are not followed": (
        (SkillCore, "step", _ignore(Violated, Lost, RenewalAnswered)),
    ),
    "goals outlive their owner": ((SkillCore, "_on_owner_gone", _always(None)),),
    "the lost effect is skipped": (
        (losses, "lost_effect", _always(None)),
        (ends, "lost_effect", _always(None)),
    ),
    "preconditions are not judged with the start effect": ((grants, "failing_preconditions", _always({})),),
    "invariants are judged once, not to the fixpoint": tuple(
        (module, "enforce_invariants", _judge_once)
        for module in (invariants, grants, readiness, ends, losses, externs_and_events)
    ),
    "tokens are counted from one": ((Ledger, "next_token", _count_from_one),),
    "grants are not written to the journal": ((Journal, "write", _write_no_grants),),
    "a local outcome is not written down": ((Ledger, "remember", _write_no_local_outcomes),),
    "a local outcome that nobody acknowledges is not sent again": (
        (Delivery, "retry_or_fail", _retry_only(BeginGoal, EndGoal)),
    ),
    "a repeated modification counts again": ((Modifications, "__contains__", _always(False)),),
    "a goal ends with the inputs of its start": ((Modifications, "apply", _keep_the_inputs),),
    "a replaced manager that nobody asks anything does not notice": ((Registration, "_ask_after", _always(None)),),
    "an owner has no grace": ((skill_manager, "owner_grace", _always(0.0)),),
    "a status does not name its step": ((SkillCore, "_publish", _name_no_step),),
    "a client shows a goal before it knows the states": ((CausalView, "take_status", _show_at_once),),
    "a client shows a loss before it knows the states after it": ((CausalFeed, "after_release", _lose_at_once),),
    "a client applies a step although the one before it is missing": ((CausalView, "take_step", _ignore_gaps),),
    "an answer from before a status counts as one from after it": ((Held, "answered_by", _take_old_answers),),
    "a client names an older change as the cause of a state": ((CausalView, "change_record", _keep_the_cause),),
    "clients learn of no loss": ((GoalTracker, "probe", _always(None)), (GoalTracker, "on_verdict", _always(None))),
}
"""Replaced functions by bug: owner, name, and a factory of the wrong function from the right one."""
LATE: Mapping[str, int] = {
    "nothing ends an interrupt that nobody confirms": 60,
    "goals outlive their owner": 165,
    "an owner has no grace": 165,
    "invariants are judged once, not to the fixpoint": 210,
    "tokens are counted from one": 75,
    "grants are not written to the journal": 80,
    "a client shows a loss before it knows the states after it": 265,
    "an answer from before a status counts as one from after it": 550,
    "a local outcome is not written down": 1885,
}
"""First seed of the search for rare bugs, so that it takes little time."""
SEEDS = 2000
"""Number of seeds within which each bug has to be found."""


@contextmanager
def planted(name: str) -> Iterator[None]:
    """Put one of the bugs into the managers."""
    patches = [patch.object(where, what, wrong(getattr(where, what))) for where, what, wrong in BUGS[name]]
    for each in patches:
        each.start()
    try:
        yield
    finally:
        for each in patches:
            each.stop()


def find(name: str, first: int = 0) -> tuple[int, str] | None:
    """First seed that finds a planted bug, and the promise that it finds broken."""
    with planted(name):
        for seed in range(first, SEEDS):
            problems = simulate(seed).problems
            if problems:
                return seed, problems[0].law
    return None
