"""Terminal answers of goals, derived from verdicts of the resource manager."""

from __future__ import annotations

from typing import Any

from skillwing.dsl.model import Skill
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import (
    Ended,
    Ending,
    EndKind,
    ErrorCode,
    ErrorReply,
    GoalVerdict,
    Lost,
    NotReady,
    Terminal,
    Violated,
)

ROOT = ""
"""Cause of a change that no record led to: it begins a chain of its own. The goal's start did not make it happen."""
REVOKED_CODES = (ErrorCode.STALE_TOKEN, ErrorCode.UNKNOWN_GOAL)
"""Refusals that say: this process does not hold the goal, or no longer."""


def terminal_of(verdict: Violated | Lost) -> Terminal:
    """The terminal answer of a goal that the resource manager has ended."""
    if isinstance(verdict, Lost):
        return Terminal(ending=Ending.LOST, reason=verdict.reason, detected_by=RESOURCE_MANAGER)
    return Terminal(
        ending=Ending.INVARIANT_VIOLATED,
        reason=verdict.reason,
        invariant=verdict.invariant,
        subject=verdict.subject,
    )


def terminal_of_end(
    ended: Ended,
    how: EndKind | None,
    result: str | None,
    reason: str,
    skill: Skill,
    *,
    output: dict[str, Any] | None = None,
    forced: bool = False,
) -> Terminal:
    """The terminal answer of a goal whose end the resource manager has applied."""
    if result is not None:
        return Terminal(
            ending=Ending.SUCCEEDED if ended.held else Ending.NOT_HELD,
            reason=reason,
            result=result,
            success=ended.held and skill.result(result).success,
            output=output,
        )
    return Terminal(
        ending=Ending.INTERRUPTED if how is EndKind.INTERRUPT else Ending.ERROR, reason=reason, forced=forced
    )


def terminal_without_grant(answer: GoalVerdict | ErrorReply, skill: Skill) -> Terminal:
    """The terminal answer of a goal that holds no grant here, from the reply to its begin or its local outcome."""
    match answer:
        case NotReady(failing=failing):
            return Terminal(ending=Ending.NOT_READY, reason=" ".join(failing.values()), failing=tuple(failing))
        case Ended(terminal=Terminal() as local):  # of this process, or of an earlier one of its name
            return local
        case Ended():
            reason = f"An earlier process of this manager ended it. {answer.reason}".rstrip()
            return terminal_of_end(answer, answer.how, answer.result, reason, skill)
        case _:
            return terminal_of_revoked(answer)


def terminal_of_revoked(answer: GoalVerdict | ErrorReply) -> Terminal:
    """The terminal answer of a goal that the resource manager has ended, refused, or never heard of."""
    match answer:
        case Violated() | Lost():
            return terminal_of(answer)
        case ErrorReply(code=code) if code in REVOKED_CODES:
            return Terminal(ending=Ending.LOST, reason=answer.message, detected_by=RESOURCE_MANAGER)
        case ErrorReply():
            reason = f"The resource manager refused: {answer.message} {answer.help}".strip()
            return Terminal(ending=Ending.ERROR, reason=reason)
        case _:
            reason = f"The resource manager gave an answer that does not belong here: {answer}"
            return Terminal(ending=Ending.ERROR, reason=reason)


def record_of(answer: GoalVerdict | ErrorReply) -> str:
    """The timeline record of a verdict; `ROOT` for a refusal, and for a local outcome without one."""
    return ROOT if isinstance(answer, ErrorReply) else answer.record
