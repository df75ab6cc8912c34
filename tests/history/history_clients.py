"""Clients that compete for the resources of one resource manager, and record their calls and its answers."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any, TypeAlias

from linearizability import Operation
from sequential_manager import Call, Lose, Reply, Told
from step_order import Observed

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answered, NoReply, Refused, RunnableBus
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.core.ends import LOCAL_OUTCOMES
from skillwing.services.journal.journal import look_into
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    Ended,
    EndGoal,
    EndKind,
    ErrorReply,
    FireEvent,
    FireExtern,
    GoalStatus,
    GoalVerdict,
    Granted,
    Keys,
    Lost,
    QueryStates,
    RecordOutcome,
    RenewGoal,
    ResourceStates,
    ResourceStep,
    State,
    Terminal,
    Violated,
    decode,
    encode,
)

PATIENCE = 20.0
"""Wall seconds that a client waits for the restart of a killed resource manager."""
ARRIVAL = 10.0
"""Wall seconds that the observer waits for the last step. Zenoh recovers a lost event within a second."""


class NobodyAnswersError(Exception):
    """The resource manager did not come back."""


class Notebook:
    """Record of one client's operations, and the times of its calls."""

    def __init__(self, client: str) -> None:
        self.client = client
        self.operations: list[Told] = []

    def write(self, call: Call, answer: Reply | None, called: int) -> None:
        """Record an operation, which ends when its answer is read. An unanswered query or renewal leaves no trace."""
        if answer is None and isinstance(call, (QueryStates, RenewGoal)):
            return
        answered = None if answer is None else time.monotonic_ns()
        self.operations.append(Operation(self.client, call, answer, called, answered))


Goal: TypeAlias = tuple[str, str]
"""Id and skill of a goal."""


class Client:
    """Caller of the resource manager on a session of its own, one call at a time.

    manager: name under which it begins goals. Clients of one manager are incarnations that replace each other.
    asked_for: by manager, its last goal. All clients share it, so that one may begin a goal that another has just begun
    or refused.
    """

    def __init__(
        self, bus: RunnableBus, skillset: Skillset, manager: str, seed: int, asked_for: dict[str, Goal]
    ) -> None:
        self.name = bus.name
        self.notebook = Notebook(bus.name)
        self._bus = bus
        self._skillset = skillset
        self._keys = Keys(skillset.name)
        self._manager = manager
        self._random = random.Random(seed)
        self._incarnations = count(1)
        self._incarnation = ""
        self._goals = count(1)
        self._asked_for = asked_for

    def work(self, operations: int) -> None:
        """Make about this many calls. Raises NobodyAnswersError."""
        self._take_the_place()
        ways = {
            self._track_a_goal: 10,
            self._end_locally: 4,
            self._look: 4,
            self._switch: 4,
            self._sweep: 3,
            self._take_the_place: 1,
        }
        while len(self.notebook.operations) < operations:
            (act,) = self._random.choices(list(ways), list(ways.values()))
            act()

    # --- what a client does ------------------------------------------------------------------------------------------

    def _track_a_goal(self) -> None:
        self._begin_and_end(*self._goal())

    def _end_locally(self) -> None:
        """Record an outcome for a goal without a grant. In most cases begin the goal afterwards, as a successor may."""
        goal = self._goal()
        self._insist(self._outcome(*goal))
        if self._random.random() < 0.3:
            self._take_the_place()
        if self._random.random() < 0.7:
            self._begin_and_end(*goal)

    def _begin_and_end(self, goal_id: str, skill: str) -> None:
        begin = BeginGoal(
            goal_id=goal_id,
            skill=skill,
            inputs={},
            manager=self._manager,
            owner=self._bus.name,
            schema=self._skillset.schema_hash,
            incarnation=self._incarnation,
        )
        granted = self._insist(begin)
        if isinstance(granted, ErrorReply) and self._random.random() < 0.5:
            self._take_the_place()
        if not isinstance(granted, Granted):
            return
        renew = RenewGoal(goal_id=goal_id, skill=skill, token=granted.token)
        while self._random.random() < 0.5:
            self._random.choice([lambda: self._ask(renew), self._look, self._switch])()
        if self._random.random() < 0.1:
            self._insist(EndGoal(goal_id=goal_id, skill=skill, token=granted.token - 1, how=EndKind.INTERRUPT))
        if self._random.random() < 0.1:
            self._insist(self._outcome(goal_id, skill))
        how = self._random.choice([EndKind.RESULT, EndKind.RESULT, EndKind.INTERRUPT, EndKind.ERROR])
        result = self._random.choice(self._skillset.skill(skill).results).name if how is EndKind.RESULT else None
        end = EndGoal(goal_id=goal_id, skill=skill, token=granted.token, how=how, result=result)
        self._insist(end)
        if self._random.random() < 0.2:
            self._insist(self._random.choice([begin, end, self._outcome(goal_id, skill)]))

    def _goal(self) -> Goal:
        """Goal of the next calls, in most cases a new one."""
        last = self._asked_for.get(self._manager)
        if last is not None and self._random.random() < 0.2:
            return last
        goal = f"{self._bus.name}-{next(self._goals)}", self._random.choice(self._skillset.skills).name
        self._asked_for[self._manager] = goal
        return goal

    def _outcome(self, goal_id: str, skill: str) -> RecordOutcome:
        return RecordOutcome(
            goal_id=goal_id,
            skill=skill,
            manager=self._manager,
            incarnation=self._incarnation,
            terminal=Terminal(ending=self._random.choice(LOCAL_OUTCOMES), reason=f"{self._bus.name} says so."),
        )

    def _look(self) -> None:
        self._ask(QueryStates())

    def _switch(self) -> None:
        target = self._random.choice(["ON", "ON", "OFF"])
        self._insist(FireExtern(resource="power", target=target, source=self._bus.name))

    def _sweep(self) -> None:
        self._insist(FireEvent(event="sweep", source=self._bus.name))

    def _take_the_place(self) -> None:
        self._incarnation = f"{self._bus.name}-{next(self._incarnations)}"
        self._insist(AttachManager(manager=self._manager, incarnation=self._incarnation))

    # --- calls -------------------------------------------------------------------------------------------------------

    def _insist(self, call: Call) -> Reply:
        """Repeat a call until it is answered. After each silence, wait until the resource manager answers a query."""
        while (answer := self._ask(call)) is None:
            deadline = time.monotonic() + PATIENCE
            while self._ask(QueryStates()) is None:
                if time.monotonic() > deadline:
                    raise NobodyAnswersError(f"{self._bus.name} was left without an answer for {PATIENCE:g} s.")
                self._bus.run_until(lambda: False, 0.05)
        return answer

    def _ask(self, call: Call) -> Reply | None:
        answers: list[Answered | Refused | NoReply] = []
        called = time.monotonic_ns()
        self._bus.ask(self._key(call), _encoded(call), answers.append)
        self._bus.run_until(lambda: bool(answers))
        reply = _reply(call, answers[0])
        self.notebook.write(call, reply, called)
        return reply

    def _key(self, call: Call) -> str:
        keys = self._keys
        match call:
            case BeginGoal() | EndGoal() | RecordOutcome() | RenewGoal():
                return keys.resource_goal
            case FireExtern():
                return keys.resource_extern
            case FireEvent():
                return keys.event(call.event)
            case AttachManager():
                return keys.resource_attach
            case QueryStates():
                return keys.resource_states
            case Lose():
                raise AssertionError("nobody calls for a loss")


@dataclass
class LossWatch:
    """Times at which the resource manager reports lost goals, which happens without a call."""

    bus: RunnableBus
    skillset: Skillset
    heard: dict[str, int] = field(default_factory=dict[str, int])

    def __post_init__(self) -> None:
        listen: Callable[..., None] = message_reader(_union(Violated | Lost), self._hear)
        self.bus.subscribe(Keys(self.skillset.name).verdict("*"), listen, events=True)

    def _hear(self, verdict: Violated | Lost) -> None:
        if isinstance(verdict, Lost):
            self.heard.setdefault(verdict.goal_id, time.monotonic_ns())

    def operations(self, history: list[Told]) -> list[Told]:
        """Losses as operations, each from the first begin of its goal to the report of its loss."""
        begun: dict[str, int] = {}
        for told in history:
            if isinstance(told.call, BeginGoal):
                begun[told.call.goal_id] = min(told.called, begun.get(told.call.goal_id, told.called))
        any_reply = Ended(goal_id="", held=True, reason="", step=0, record="")
        return [
            Operation("resource manager", Lose(goal_id), any_reply, begun[goal_id], at)
            for goal_id, at in self.heard.items()
            if goal_id in begun
        ]


@dataclass
class StepWatch:
    """Published steps, from the states before the first call to those after the last one."""

    bus: RunnableBus
    skillset: Skillset
    heard: list[ResourceStep] = field(default_factory=list[ResourceStep])

    def __post_init__(self) -> None:
        self._keys = Keys(self.skillset.name)
        self.bus.subscribe(self._keys.resource_steps, message_reader(ResourceStep, self.heard.append), events=True)
        self.begun = self._states()

    def observed(self, journal: Path | None, kills: int) -> Observed:
        """Wait until the last step has arrived, and return all. A step that never comes is for the check to find."""
        last = self._states().step
        self.bus.run_until(lambda: bool(self.heard) and self.heard[-1].number >= last, ARRIVAL)
        stored = None if journal is None else tuple(record.id for record in look_into(journal)[1].records)
        return Observed(self.begun, tuple(self.heard), stored, kills)

    def _states(self) -> ResourceStates:
        answers: list[Answered | Refused | NoReply] = []
        deadline = time.monotonic() + PATIENCE
        while not (answers and isinstance(answers[-1], Answered)):
            if time.monotonic() > deadline:
                raise NobodyAnswersError(f"The observer was left without an answer for {PATIENCE:g} s.")
            asked = len(answers)
            self.bus.ask(self._keys.resource_states, encode(QueryStates()), answers.append)
            self.bus.run_until(lambda asked=asked: len(answers) > asked)
        return decode(answers[-1].payload, ResourceStates)


@dataclass
class GoalUser:
    """User of a real skill manager: starts its goals, interrupts some, and switches the power off under others.

    heard: all statuses as they arrive, whether or not their steps have.
    """

    bus: RunnableBus
    skillset: Skillset
    skill: str
    seed: int
    heard: list[GoalStatus] = field(default_factory=list[GoalStatus])

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)
        statuses = Keys(self.skillset.name).status(self.skill)
        self.bus.subscribe(statuses, message_reader(GoalStatus, self.heard.append), events=True)
        self._interface = SkillsetInterface(self.bus, self.skillset, client=self.bus.name)
        self._wait(lambda: self._interface.ready)

    def use(self, goals: int) -> None:
        """Have so many goals, one after the other, each until its end has arrived."""
        for _ in range(goals):
            self.end(self.begin())

    def begin(self) -> GoalHandle:
        """Start a goal. In some cases wait until it runs, or has ended."""
        goal = self._interface.start(self.skill)
        if self._random.random() < 0.7:
            self._wait(lambda: goal.done or goal.state is State.RUNNING)
        return goal

    def end(self, goal: GoalHandle) -> None:
        """Let a goal be, interrupt it or switch the power off, and wait for its end."""
        how = self._random.choice(("wait", "interrupt", "violate"))
        if how == "interrupt":
            self._interface.interrupt(goal)
        elif how == "violate":
            self._switch("OFF")
        self._wait(lambda: any(status.goal_id == goal.goal_id and status.terminal for status in self.heard))
        self._wait(lambda: goal.done)
        if self._interface.state("power") == "OFF":
            self._switch("ON")

    def _switch(self, target: str) -> None:
        answers: list[object] = []
        self._interface.trigger("power", target, answers.append)
        self._wait(lambda: bool(answers))

    def _wait(self, done: Callable[[], bool]) -> None:
        if not self.bus.run_until(done, PATIENCE):
            raise NobodyAnswersError(f"{self.bus.name} was left without an answer for {PATIENCE:g} s.")


def _encoded(call: Call) -> bytes:
    assert not isinstance(call, Lose)
    return encode(call)


def _reply(call: Call, answer: Answered | Refused | NoReply) -> Reply | None:
    match answer:
        case Answered():
            kind = _kind_of_reply(call)
            return decode(answer.payload, kind)
        case Refused():
            return answer.error
        case NoReply():
            return None


def _kind_of_reply(call: Call) -> Any:
    match call:
        case BeginGoal() | EndGoal() | RecordOutcome() | RenewGoal():
            return GoalVerdict
        case _:
            return ResourceStates


def _union(kind: Any) -> Any:
    """A union of tagged messages as `decode` takes it; type checkers have no name for its type."""
    return kind
