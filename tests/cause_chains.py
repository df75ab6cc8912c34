"""Audit of cause chains: the causes of each failure lead to what made it happen. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.history.history import History, is_switch
from skillwing.services.history.wording import chain_text, ends, headline
from skillwing.services.protocol import Ending, MissionPhase, Record, RecordKind, State

FAILED_ENDINGS = (Ending.INVARIANT_VIOLATED, Ending.LOST, Ending.ERROR, Ending.NOT_READY)
"""Endings that are failures whatever the skill. `BUSY` and `NV` are replies to a wrong request, `IT` is asked for."""
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
    """The bad chains of a run: those of goals' ends, switches and mission ends.

    tolerance: difference between the clocks of two processes [s]; none in virtual time. fault: every failure after it
    is taken for its consequence.
    """
    return tuple(
        BadChain(problem, record, history.chain(record.id))
        for record in history.records
        if is_end(record) or is_switch(record)
        for problem in _problems(history, record, skillset, fault, tolerance)
    )


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


def _problems(
    history: History, record: Record, skillset: Skillset, fault: InjectedFault | None, tolerance: float
) -> Iterator[ChainProblem]:
    chain = history.chain(record.id)
    root = chain[0]
    if root.cause is not None:
        yield ChainProblem.LOOP if any(root.cause == each.id for each in chain) else ChainProblem.CUT
    if _goes_back(chain, tolerance):
        yield ChainProblem.BACKWARDS
    if root.cause is not None or not is_failure(record, skillset):
        return
    if fault is not None and record.t >= fault.t:
        if headline(ends(chain)[0]) not in fault.roots:
            yield ChainProblem.SKIPS_FAULT
    elif _is_start(root):
        yield ChainProblem.UNRELATED


def _goes_back(chain: Iterable[Record], tolerance: float) -> bool:
    times = [record.t for record in chain]
    return any(cause > effect + tolerance for cause, effect in pairwise(times))


def _is_start(root: Record) -> bool:
    """True for the start of a goal or a mission."""
    if root.kind is RecordKind.MISSION:
        return root.after == MissionPhase.RUNNING
    return root.kind is RecordKind.GOAL and root.after in (State.VALIDATING, "GRANTED")
