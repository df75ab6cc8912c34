"""The resource manager for one client at a time: `ResourceCore` itself, made again for each call.

A state is what a core has to remember, as a journal would keep it. So the check also says that what the core wants
remembered is enough to go on from.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import msgspec
from linearizability import Operation

from skillwing.dsl.model import Skillset
from skillwing.services.core.events import GoalSilent
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import (
    EMPTY_SNAPSHOT,
    Entry,
    FinishedGoal,
    GrantEntry,
    ManagerEntry,
    ResourceEntry,
    Snapshot,
)
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    EndGoal,
    ErrorReply,
    FireEvent,
    FireExtern,
    GoalCall,
    GoalVerdict,
    Granted,
    Lost,
    QueryStates,
    RecordOutcome,
    ResourceStates,
    Violated,
)


@dataclass(frozen=True, slots=True)
class Lose:
    """The resource manager takes a goal away from a manager that is silent: an operation that nobody calls."""

    goal_id: str


Call: TypeAlias = GoalCall | FireExtern | FireEvent | AttachManager | QueryStates | Lose
Reply: TypeAlias = GoalVerdict | ResourceStates | ErrorReply
Told: TypeAlias = Operation[Call, Reply]


@dataclass(frozen=True)
class Memory:
    """A state of the model."""

    kept: Snapshot

    @cached_property
    def _hash(self) -> int:
        kept = self.kept
        grants = tuple(grant.granted.goal_id for grant in kept.grants)
        goals = tuple((over.goal_id, type(over.verdict)) for over in kept.goals)
        return hash((kept.resources, grants, goals, kept.managers, kept.last_token))

    def __hash__(self) -> int:
        return self._hash


class SequentialManager:
    """A `Model` of the resource manager for the history that is given.

    Fencing tokens may be any that grow. So the model grants with the token that the history says each goal was given.
    Numbers of steps may be any that do not fall, since not every step is the answer to a call.
    """

    def __init__(self, skillset: Skillset, history: Iterable[Told]) -> None:
        self._skillset = skillset
        self._tokens: dict[str, int] = {}
        self._clients: dict[str, set[str]] = {}
        self._open_ended: set[str] = set()
        self._at: tuple[Memory, ResourceCore] | None = None
        for told in history:
            if isinstance(told.answer, (Granted, Violated, Lost)):
                self._tokens[told.answer.goal_id] = told.answer.token
            if isinstance(told.call, (BeginGoal, EndGoal, RecordOutcome)):
                self._clients.setdefault(told.call.goal_id, set()).add(told.client)
            if told.answer is None and isinstance(told.call, (BeginGoal, EndGoal, RecordOutcome)):
                self._open_ended.add(told.call.goal_id)

    @property
    def initial(self) -> Memory:
        core = ResourceCore(self._skillset, source="model", new_record_id=_no_id)
        return Memory(add_up(EMPTY_SNAPSHOT, core.initial_entries()))

    def step(self, state: Memory, call: Call, answer: Reply | None) -> Memory | None:
        """State after the call, if the core would have given that answer."""
        core = self._core_at(state)
        try:
            step = self._perform(core, call)
        except RefusedError as refusal:
            return state if answer is None or _same(answer, refusal.reply) else None
        if step.entries:
            self._at = None
        if not (answer is None or isinstance(call, Lose) or _same(answer, step.reply)):
            return None
        kept = state.kept
        if isinstance(answer, ResourceStates):
            if answer.step < kept.step:
                return None
            kept = msgspec.structs.replace(kept, step=answer.step)
        if not step.entries:
            return state if kept == state.kept else Memory(kept)
        kept = add_up(kept, step.entries)
        return Memory(self._without_the_settled(kept, call))

    def _core_at(self, state: Memory) -> ResourceCore:
        """A core in this state: that of the last step, if it is still there, for making one takes most of the time."""
        if self._at is None or self._at[0] is not state:
            self._at = state, ResourceCore(self._skillset, source="model", new_record_id=_no_id, snapshot=state.kept)
        return self._at[1]

    def _perform(self, core: ResourceCore, call: Call) -> Step:
        match call:
            case QueryStates():
                return Step(core.resource_states(0.0), core.last_step)
            case Lose():
                return core.step(GoalSilent(call.goal_id, "silent"), 0.0)
            case BeginGoal():
                return core.step(call, self._time_of_grant(call.goal_id))
            case _:
                return core.step(call, 0.0)

    def _time_of_grant(self, goal_id: str) -> float:
        """The robot time in seconds at which a grant gets the token that the goal was given; 0 for any token."""
        token = self._tokens.get(goal_id)
        return 0.0 if token is None else (token + 0.5) / 1000

    def _without_the_settled(self, kept: Snapshot, call: Call) -> Snapshot:
        """Forget goals of which no call will speak any more, so that states do not grow with the history.

        A client asks for the next goal when it is done with the one before; another one may come back to that, and
        calls without an answer may come later.
        """
        if not isinstance(call, (BeginGoal, EndGoal, RecordOutcome)):
            return kept
        clients = self._clients[call.goal_id]
        if len(clients) > 1:
            return kept
        goals = tuple(
            over
            for over in kept.goals
            if over.goal_id == call.goal_id
            or over.goal_id in self._open_ended
            or self._clients[over.goal_id] != clients
        )
        return msgspec.structs.replace(kept, goals=goals)


def add_up(kept: Snapshot, entries: Sequence[Entry]) -> Snapshot:
    """Snapshot after a step; equal for steps in any order that end alike, so that the search meets itself."""
    resources = {each.resource: each for each in kept.resources}
    grants = {each.granted.goal_id: each for each in kept.grants}
    goals = {each.goal_id: each for each in kept.goals}
    managers, last_token = list(kept.managers), kept.last_token
    for entry in entries:
        match entry:
            case ResourceEntry():
                resources[entry.resource] = entry
            case GrantEntry():
                grants[entry.granted.goal_id] = entry
                last_token = max(last_token, entry.granted.token)
            case FinishedGoal():
                grants.pop(entry.goal_id, None)
                goals[entry.goal_id] = entry
            case ManagerEntry():
                managers.append(entry)
            case _:
                raise AssertionError(f"the workshop has no data, and the core keeps {entry}")
    return msgspec.structs.replace(
        kept,
        resources=tuple(resources.values()),
        grants=tuple(grants.values()),
        goals=tuple(sorted(goals.values(), key=lambda over: over.goal_id)),
        managers=tuple(sorted(managers, key=lambda noted: noted.manager)),
        last_token=last_token,
    )


def _same(answer: Reply, reply: Reply | None) -> bool:
    """Refusals by their codes, everything else as a whole but for times, step numbers and record ids.

    The reason of a loss is left out: the model does not know whether the manager was silent or gone.
    """
    if isinstance(answer, ErrorReply):
        return isinstance(reply, ErrorReply) and answer.code == reply.code
    return reply is not None and _without_stamps(answer) == _without_stamps(reply)


def _without_stamps(reply: Reply) -> Reply:
    stamps: dict[str, object] = {"t": 0.0, "record": "", "step": 0, "epoch": ""}
    if isinstance(reply, Lost):
        stamps["reason"] = ""
    fields = {name: value for name, value in stamps.items() if name in reply.__struct_fields__}
    return msgspec.structs.replace(reply, **fields)


def _no_id() -> str:
    return ""
