"""A skill core on a desk: a skill manager without a process, a network or anybody's code."""

from __future__ import annotations

from typing import Any

from rig import RIG
from soundness import assert_all_sound

from skillwing.dsl.model import Skillset
from skillwing.services.core.events import TimePassed
from skillwing.services.core.skill_actions import Action, AskResources, CallHook, Hook
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.core.skill_events import (
    Dispatched,
    Event,
    Failed,
    OwnerGone,
    QuestionAnswered,
    Raised,
    RenewalAnswered,
    StopConfirmed,
    Terminated,
    Validated,
)
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import (
    Ended,
    EndGoal,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    Granted,
    InterruptGoal,
    Record,
    RecordOutcome,
    RenewGoal,
    StartGoal,
    State,
    Terminal,
    Violated,
)

TOKEN = 7


class Desk:
    """A skill core for `move`, what it asked for, and the answers to that in short."""

    def __init__(self, skillset: Skillset = RIG) -> None:
        new_id = RecordIds("skill/move")
        self.core = SkillCore(skillset, "move", source="skill/move", new_record_id=new_id, incarnation="this")
        self.actions: list[Action] = []
        self.now = 0.0

    def take(self, actions: tuple[Action, ...]) -> None:
        calls = [action.call for action in actions if isinstance(action, AskResources)]
        assert_all_sound((*actions, *calls), self.now)
        assert all(action.t == self.now for action in actions if isinstance(action, GoalStatus))
        self.actions += actions

    def step(self, event: Event) -> None:
        self.take(self.core.step(event, self.now))

    def start(self, goal_id: str = "g", **fields: Any) -> None:
        request: dict[str, Any] = {"inputs": {}, "client": "test", "schema": RIG.schema_hash} | fields
        self.step(StartGoal(goal_id=goal_id, **request))

    def interrupt(self, goal_id: str = "g") -> None:
        self.step(InterruptGoal(goal_id=goal_id, client="test", cause="mission#1"))

    def validated(self, problem: str | None = None) -> None:
        self.step(Validated("g", problem))

    def dispatched(self) -> None:
        self.step(Dispatched("g"))

    def terminated(
        self,
        result: str = "DONE",
        output: dict[str, object] | None = None,
        goal_id: str = "g",
        cause: str | None = None,
    ) -> None:
        self.step(Terminated(goal_id, result, output, cause))

    def interrupted(self) -> None:
        self.step(StopConfirmed("g"))

    def failed(self, cause: str | None = None) -> None:
        self.step(Failed("g", "The motor is gone.", cause))

    def raised(self) -> None:
        self.step(Raised("g", "progress", "ValueError: oh"))

    def answer(self, verdict: Any) -> None:
        self.step(QuestionAnswered(self.asked, verdict))

    @property
    def committed(self) -> Ended:
        """The answer to the local outcome that was just sent, if no other process had the goal."""
        asked = self.asked.call
        assert isinstance(asked, RecordOutcome)
        return Ended(
            goal_id=asked.goal_id,
            held=False,
            reason="",
            step=1,
            record=asked.cause or "",
            terminal=asked.terminal,
        )

    def outcome_committed(self) -> None:
        self.answer(self.committed)

    def granted(self) -> None:
        self.answer(Granted(goal_id="g", token=TOKEN, step=1, record="rm#1"))

    def ended(self, held: bool = True) -> None:
        reason = "" if held else "It did not hold."
        self.answer(Ended(goal_id="g", held=held, reason=reason, step=2, record="rm#2"))

    def renewed(self, verdict: Any) -> None:
        call = RenewGoal(goal_id="g", skill="move", token=TOKEN)
        self.step(RenewalAnswered(call, verdict))

    def owner_gone(self, owner: str = "client/mission-1") -> None:
        self.step(OwnerGone(owner))

    def violated(self) -> None:
        self.step(VIOLATED)

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.step(TimePassed())

    @property
    def records(self) -> list[Record]:
        """The timeline records of all statuses."""
        statuses = (action for action in self.actions if isinstance(action, GoalStatus))
        return [record for status in statuses if (record := status.as_record()) is not None]

    @property
    def asked(self) -> AskResources:
        return next(action for action in reversed(self.actions) if isinstance(action, AskResources))

    @property
    def ends_asked(self) -> list[tuple[str, str | None, int]]:
        calls = [action.call for action in self.actions if isinstance(action, AskResources)]
        return [(call.how, call.result, call.token) for call in calls if isinstance(call, EndGoal)]

    @property
    def hooks(self) -> list[Hook]:
        return [action.hook for action in self.actions if isinstance(action, CallHook)]

    @property
    def state(self) -> State:
        return self.core.status("g").state

    @property
    def terminals(self) -> list[tuple[str, Terminal]]:
        return [(s.goal_id, s.terminal) for s in self.actions if isinstance(s, GoalStatus) and s.terminal is not None]

    def terminal(self, goal_id: str = "g") -> Terminal:
        [terminal] = [terminal for name, terminal in self.terminals if name == goal_id]
        assert self.core.status(goal_id).terminal == terminal
        return terminal


VIOLATED = Violated(
    goal_id="g",
    skill="move",
    invariant="authority",
    subject="authority",
    reason="It is OFF.",
    t=0.0,
    step=3,
    record="rm#9",
    token=TOKEN,
)
ENDED = Ended(goal_id="g", held=True, reason="", step=2, record="rm#2")
REFUSED = ErrorReply(code=ErrorCode.STALE_TOKEN, message="The token is stale.")


def validating() -> Desk:
    desk = Desk()
    desk.start()
    desk.validated()
    return desk


def failed_to_validate() -> Desk:
    desk = Desk()
    desk.start()
    desk.raised()
    return desk


def dispatching() -> Desk:
    desk = validating()
    desk.granted()
    return desk


def running() -> Desk:
    desk = dispatching()
    desk.dispatched()
    return desk


def interrupting() -> Desk:
    desk = running()
    desk.interrupt()
    return desk


def owned(*, validating: bool = False, skillset: Skillset = RIG) -> Desk:
    """A goal that must not outlive the client that started it."""
    desk = Desk(skillset)
    desk.start(owner="client/mission-1", schema=skillset.schema_hash)
    desk.validated()
    if not validating:
        desk.granted()
        desk.dispatched()
    return desk
