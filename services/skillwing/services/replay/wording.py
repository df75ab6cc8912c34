"""Questions and answers in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from skillwing.services.protocol import EndGoal
from skillwing.services.replay.steps import (
    Attach,
    Begin,
    Datum,
    End,
    Event,
    Extern,
    GoalSilent,
    ManagerGone,
    Outcome,
    Question,
    Renew,
    Resume,
    Tick,
)


def asked_in_words(question: Question) -> str:
    """What happened, as a clause: `skill/goto asked to begin goto, goal 0190...`."""
    match question:
        case Extern(request):
            text = f"{request.source} reported `{request.resource}` as {request.target}"
        case Event(request):
            text = f"{request.source} fired the event `{request.event}`"
        case Datum(sample):
            text = f"`{sample.name}` was measured as {sample.value}"
        case Tick():
            text = "time had passed"
        case Attach(request):
            text = f"a new process of {request.manager} reported for service"
        case Begin(request):
            text = f"{request.manager} asked to begin `{request.skill}`, goal {request.goal_id}"
        case End(request):
            text = f"`{request.skill}` was to end by {_way(request)}, goal {request.goal_id}"
        case Outcome(request):
            text = f"{request.manager} ended the goal {request.goal_id} locally as {request.terminal.label}"
        case Renew(request):
            text = f"`{request.skill}` asked whether its goal {request.goal_id} still stands"
        case ManagerGone(manager, reason):
            text = f"{manager} was gone: {reason}"
        case GoalSilent(goal_id, reason):
            text = f"the manager of the goal {goal_id} was {reason}"
        case Resume():
            text = "a new resource manager went on from the journal"
    return text


def answer_in_words(answer: Mapping[str, Any]) -> str:
    """An answer as plain values, as sentences: what was replied, and what else came of it."""
    match answer:
        case {"type": "refused", "error": error}:
            return f"refused ({error['code']}): {error['message']}"
        case {"type": "broken", "error": error}:
            return f"the core broke: {error}"
        case {"reply": reply, "said": said}:
            return "; ".join([_reply(reply), *_changes(said)])
        case _:
            return str(answer)


def _way(request: EndGoal) -> str:
    return f"the result {request.result}" if request.result else request.how


def _reply(reply: Any) -> str:
    match reply:
        case {"type": "granted", "token": token, "revision": revision}:
            return f"granted with token {token} at revision {revision}"
        case {"type": "not_ready", "failing": failing}:
            return f"not ready: {' '.join(failing.values())}"
        case {"type": "violated" | "lost" as kind, "reason": reason}:
            return f"{kind}: {reason}"
        case {"type": "ended"}:
            return _end(reply)
        case {"states": _, "revision": revision}:
            return f"taken, revision {revision}"
        case _:
            return "taken"


def _end(reply: Mapping[str, Any]) -> str:
    match reply:
        case {"terminal": {"ending": ending, "reason": reason}}:
            return f"{ending}, local outcome of the manager: {reason}"
        case {"held": False, "reason": reason}:
            return f"ended, but did not hold: {reason}"
        case _:
            return "ended"


def _changes(said: list[dict[str, Any]]) -> Iterator[str]:
    for each in said:
        match each:
            case {"type": "violated", "invariant": invariant, "skill": skill}:
                yield f"invariant {invariant} of `{skill}` violated"
            case {"type": "lost", "skill": skill}:
                yield f"`{skill}` lost"
            case {"resource": resource, "before": before, "after": after}:
                yield f"`{resource}` {before} -> {after}"
            case _:
                pass
