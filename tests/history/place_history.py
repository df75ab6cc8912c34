"""History of a place that robots share: what was asked of its judge, and whether that can have happened in turn.

Unlike `sequential_manager.py`, the model is no code of the resource manager: a place that is free, held by one goal,
or unclear. Pure, except that it collects the messages of a network in virtual time.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, TypeAlias

from linearizability import Operation, Verdict, check

from skillwing.services.bus.inprocess import SentMessage
from skillwing.services.protocol import (
    BeginGoal,
    EndGoal,
    FireExtern,
    GoalCall,
    GoalVerdict,
    Granted,
    Keys,
    NotReady,
    RenewGoal,
    decode,
)

UNCLEAR, FREE = "UNCLEAR", "FREE"
"""States of a place that nobody holds. All other states of the model are the id of the goal that holds it."""
MICROSECOND = 1e-6
_GOAL_CALL: Any = GoalCall
_VERDICT: Any = GoalVerdict


@dataclass(frozen=True, slots=True)
class Take:
    """A start of the skill that holds the place."""

    goal: str


@dataclass(frozen=True, slots=True)
class Renew:
    """The manager's question whether its goal still holds the place."""

    goal: str


@dataclass(frozen=True, slots=True)
class GiveBack:
    """The end of a goal, by its manager or by the judge."""

    goal: str


@dataclass(frozen=True, slots=True)
class Change:
    """A change of the place by the watch: to FREE or to UNCLEAR."""

    to: str


class Answer(Enum):
    """Kinds of answers. OVER: the goal has ended. REFUSED: an error, which tells nothing of the place."""

    YES = auto()
    NO = auto()
    OVER = auto()
    REFUSED = auto()


Call: TypeAlias = Take | Renew | GiveBack | Change
Told: TypeAlias = Operation[Call, Answer]


class PlaceModel:
    """Sequential model of a place."""

    initial = UNCLEAR

    def step(self, state: str, call: Call, answer: Answer | None) -> str | None:
        """The state after a call, or None if it cannot have had that answer."""
        if answer is Answer.REFUSED:
            return state
        match call:
            case Take(goal):
                return _taken(state, goal, answer)
            case Renew(goal):
                return state if answer is None or (answer is Answer.YES) is (state == goal) else None
            case GiveBack(goal):
                return UNCLEAR if state == goal else state
            case Change(to):
                fits = state == UNCLEAR if to == FREE else state != UNCLEAR
                return to if fits else (state if answer is None else None)


def _taken(state: str, goal: str, answer: Answer | None) -> str | None:
    match answer:
        case Answer.YES:
            return goal if state in (FREE, goal) else None
        case Answer.NO:
            return None if state == FREE else state
        case Answer.OVER:
            return None if state == goal else state
        case _:
            return goal if state == FREE else state


class PlaceHistory:
    """All operations on a place, of the messages of an `InProcessNetwork` whose messages take `latency` s.

    Give `take` as its tap. An answer belongs to the first open question of its key that was sent `latency` before.
    """

    def __init__(self, place: str, skillset: str = "yard", latency: float = 0.0002) -> None:
        keys = Keys(skillset)
        self._place, self._skill = place, f"hold_{place}"
        self._goals, self._extern = keys.resource_goal, keys.resource_extern
        self._cleared = keys.event(f"{place}_cleared")
        self._latency = latency
        self._open: list[tuple[SentMessage, Call | None]] = []
        """Questions without an answer yet. Those of other places have no call: they have the same keys."""
        self._done: list[Told] = []

    def take(self, message: SentMessage) -> None:
        """Note a message."""
        if message.key not in (self._goals, self._extern, self._cleared):
            return
        if message.what == "ask":
            self._open.append((message, self._call(message)))
        elif message.what in ("reply", "refuse"):
            self._answer(message)

    @property
    def operations(self) -> tuple[Told, ...]:
        """All operations so far. Each goal that was granted may also be ended by the judge, at any time after that."""
        ends: list[Told] = [
            Operation("judge", GiveBack(told.call.goal), None, told.called, None)
            for told in self._done
            if isinstance(told.call, Take) and told.answer is Answer.YES
        ]
        open_ones = [_operation(asked, call, None, None) for asked, call in self._open if call is not None]
        return (*self._done, *open_ones, *ends)

    def judge(self) -> Verdict[Call, Answer]:
        """Verdict on the operations so far: linearizable or not."""
        return check(PlaceModel(), self.operations)

    def _call(self, message: SentMessage) -> Call | None:
        if message.key == self._cleared:
            return Change(FREE)
        if message.key == self._extern:
            asked = decode(message.payload, FireExtern)
            return Change(asked.target) if asked.resource == self._place else None
        match decode(message.payload, _GOAL_CALL):
            case BeginGoal(goal_id=goal, skill=self._skill):
                return Take(goal)
            case EndGoal(goal_id=goal, skill=self._skill):
                return GiveBack(goal)
            case RenewGoal(goal_id=goal, skill=self._skill):
                return Renew(goal)
            case _:
                return None

    def _answer(self, message: SentMessage) -> None:
        for number, (asked, call) in enumerate(self._open):
            late = message.t - asked.t - self._latency
            if asked.key == message.key and abs(late) < self._latency / 2.0:
                del self._open[number]
                if call is None:
                    return
                self._done.append(_operation(asked, call, self._meaning(message), message.t + self._latency))
                return

    def _meaning(self, message: SentMessage) -> Answer:
        """Kind of an answer. Raises ProtocolError for one that none of these calls has."""
        if message.what == "refuse":
            return Answer.REFUSED
        if message.key != self._goals:
            return Answer.YES
        match decode(message.payload, _VERDICT):
            case Granted():
                return Answer.YES
            case NotReady():
                return Answer.NO
            case _:
                return Answer.OVER


def _operation(asked: SentMessage, call: Call, answer: Answer | None, answered: float | None) -> Told:
    when = None if answered is None else round(answered / MICROSECOND)
    return Operation(asked.source.name, call, answer, round(asked.t / MICROSECOND), when)
