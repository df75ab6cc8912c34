"""Audit of cause chains: the causes of each failure lead to what made it happen. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import inf

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.history.history import History, is_switch
from skillwing.services.history.wording import chain_text, ends, headline
from skillwing.services.protocol import Ending, MissionPhase, Record, RecordKind, State

FAILED_ENDINGS = (Ending.INVARIANT_VIOLATED, Ending.LOST, Ending.ERROR, Ending.NOT_READY)
"""Endings that are failures whatever the skill. `BUSY` and `NV` are replies to a wrong request, and `IT` is asked for:
see `_is_unplanned`."""
FAILED_PHASES = (MissionPhase.FAILED, MissionPhase.ABORTED)


class ChainProblem(StrEnum):
    """Problem of a chain of causes."""

    CUT = "names an unknown cause"
    LOOP = "leads back to itself"
    BACKWARDS = "has a cause that is later than its effect"
    SKIPS_FAULT = "does not lead to the injected fault"
    UNRELATED = "leads to the start of a goal or a mission, which makes nothing fail"


@dataclass(frozen=True, slots=True)
class InjectedFault:
    """A fault that a test has injected at `t`. roots: headlines that its chains may begin with, `zed FAILED`."""

    t: float
    roots: frozenset[str]


@dataclass(frozen=True, slots=True)
class BadChain:
    """A chain of causes with a problem. record: the effect; chain: the records from the root to it."""

    problem: ChainProblem
    record: Record
    chain: tuple[Record, ...]

    def __str__(self) -> str:
        return f"{headline(self.record)} at {self.record.t:.3f} s {self.problem}: {chain_text(self.chain)}"


def bad_chains(
    history: History, skillset: Skillset, fault: InjectedFault | None = None, tolerance: float = 0.0
) -> tuple[BadChain, ...]:
    """The bad chains of a run.

    Every chain has to be whole and to go forward. Those of failures also have to lead to what made them happen.
    tolerance: difference between the clocks of two processes [s]; none in virtual time. fault: every failure after it
    is taken for its consequence, and so is every interruption after the first failure.
    """
    begin = -inf if fault is None else fault.t
    failed = {each.id: each.t for each in failures(history, skillset)}
    first = min((t for t in failed.values() if t >= begin), default=inf)
    bad: list[BadChain] = []
    for record in history.records:
        chain = history.chain(record.id)
        problems = list(_problems_of_links(chain, tolerance))
        if record.id in failed or _is_unplanned(chain, begin, first):
            problems += _problems_of_root(chain, fault)
        bad += [BadChain(problem, record, chain) for problem in problems]
    return tuple(bad)


def failures(history: History, skillset: Skillset) -> tuple[Record, ...]:
    """The goals and missions that failed, and the switches."""
    ends = (record for record in history.records if is_end(record) or is_switch(record))
    return tuple(record for record in ends if is_failure(record, skillset))


def is_end(record: Record) -> bool:
    """True for the end of a goal or of a mission."""
    if record.kind is RecordKind.MISSION:
        return record.after in FAILED_PHASES or record.after == MissionPhase.SUCCEEDED
    label = record.after.partition("_")[0]
    return record.kind is RecordKind.GOAL and record.before is not None and label in frozenset(Ending)


def is_failure(record: Record, skillset: Skillset) -> bool:
    """True for a switch, for a failed mission, and for a goal that failed. A result without effect (`N_`) is one."""
    if record.kind is RecordKind.MISSION:
        return is_switch(record) or record.after in FAILED_PHASES
    label, _, result = record.after.partition("_")
    if label != Ending.SUCCEEDED:
        return record.after in FAILED_ENDINGS or label == Ending.NOT_HELD
    try:
        return not skillset.skill(record.subject).result(result).success
    except UnknownNameError:
        return False


def _problems_of_links(chain: Sequence[Record], tolerance: float) -> Iterator[ChainProblem]:
    root = chain[0]
    if root.cause is not None:
        yield ChainProblem.LOOP if any(root.cause == each.id for each in chain) else ChainProblem.CUT
    if any(cause.t > effect.t + tolerance for cause, effect in pairwise(chain)):
        yield ChainProblem.BACKWARDS


def _problems_of_root(chain: Sequence[Record], fault: InjectedFault | None) -> Iterator[ChainProblem]:
    root, effect = chain[0], chain[-1]
    if root.cause is not None:
        return
    if fault is not None and effect.t >= fault.t:
        # What begins a chain may go on about the same subject: a goal that its client has lost is then interrupted.
        about_root = chain[: chain.index(ends(chain)[0]) + 1]
        if fault.roots.isdisjoint(map(headline, about_root)):
            yield ChainProblem.SKIPS_FAULT
    elif _is_start(root):
        yield ChainProblem.UNRELATED


def _is_unplanned(chain: Sequence[Record], begin: float, first: float) -> bool:
    """True for an interruption that was asked for after the first failure, or after the fault and without a cause.

    begin: time of the fault; first: that of the first failure after it.
    """
    effect = chain[-1]
    if effect.kind is not RecordKind.GOAL or effect.after not in (State.INTERRUPTING, Ending.INTERRUPTED):
        return False
    own = [each for each in chain if each.goal_id == effect.goal_id]
    asked = next((each.t for each in own if each.after == State.INTERRUPTING), effect.t)
    return asked >= first or (asked >= begin and len(own) == len(chain))


def _is_start(root: Record) -> bool:
    """True for the start of a goal or a mission."""
    if root.kind is RecordKind.MISSION:
        return root.after == MissionPhase.RUNNING
    return root.kind is RecordKind.GOAL and root.after in (State.VALIDATING, "GRANTED")
