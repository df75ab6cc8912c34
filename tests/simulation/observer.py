"""Promises on everything that managers publish and answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from simulation.order import LAW, CausalOrder
from simulation.plan import Plan
from simulation.world import Client
from skillwing.services.bus import Bus
from skillwing.services.bus.inprocess import SentMessage
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.protocol import (
    Ending,
    ErrorCode,
    ErrorReply,
    GoalStatus,
    Granted,
    Keys,
    Record,
    ResourceStates,
    ResourceStep,
    State,
    Terminal,
    decode,
)

_RANK = {state: rank for rank, state in enumerate(State)}


@dataclass(frozen=True)
class Problem:
    """A broken promise. law: its name; text: what happened."""

    t: float
    law: str
    text: str

    def __str__(self) -> str:
        return f"{self.t:8.4f}  {self.law}: {self.text}"


class Observer:
    """Observes every message at its source, even one that gets lost later."""

    def __init__(self, plan: Plan) -> None:
        skillset = plan.subject.skillset
        self._keys = keys = Keys(skillset.name)
        self.problems: list[Problem] = []
        self.records: dict[str, Record] = {}
        self._causes: dict[str, str] = {}
        self.terminals: dict[str, Terminal] = {}
        self.answers: dict[str, set[str]] = {}
        self._told: dict[tuple[Bus, str], Terminal] = {}
        # Goals in the resource manager's books: granted, or ended by their managers' own word.
        self._known: set[str] = set()
        self._binding: dict[str, Terminal] = {}
        self._ranks: dict[tuple[Bus, str], tuple[int, int]] = {}
        self._interrupted_early: set[tuple[Bus, str]] = set()
        self.verdicts: dict[str, Ending] = {}
        self._last_token = 0
        self._tokens: dict[str, int] = {}
        self._initial = {resource.name: resource.initial for resource in skillset.resources}
        self.states = dict(self._initial)
        self.step: int | None = None
        """Number of the latest step; None until one is known."""
        self.order = CausalOrder()
        self._listeners: dict[tuple[str, str], Callable[[SentMessage], None]] = {
            ("put", keys.timeline): self._on_record,
            ("reply", keys.resource_goal): self._on_verdict,
        }
        self._listeners["put", keys.resource_steps] = self._on_step
        self._listeners["reply", keys.resource_attach] = self._on_states
        for key in (keys.resource_states, keys.resource_extern):
            self._listeners["reply", key] = self._on_states
        for event in skillset.events:
            self._listeners["reply", keys.event(event.name)] = self._on_states
        for skill in skillset.skills:
            self._listeners["put", keys.status(skill.name)] = self._on_status
            self._listeners["put", keys.verdict(skill.name)] = self._on_push
            asked = (keys.start, keys.interrupt, keys.modify, keys.goal)
            for key in (spell(skill.name) for spell in asked):
                self._listeners["reply", key] = self._on_answer
            self._listeners["refuse", keys.interrupt(skill.name)] = self._on_refusal_to_interrupt

    def hear(self, said: SentMessage) -> None:
        listener = self._listeners.get((said.what, said.key))
        if listener is not None:
            listener(said)

    def expect_new_books(self) -> None:
        """A resource manager without a journal was killed: its successor begins from scratch."""
        self.states, self.step = dict(self._initial), None
        self._tokens.clear()
        self.order.expect_new_books()
        self._known.clear()
        self._binding.clear()

    def note(self, t: float, law: str, text: str) -> None:
        self.problems.append(Problem(t, law, text))

    def _note_law(self, t: float, law: str, text: str | None) -> None:
        if text is not None:
            self.note(t, law, text)

    # --- clients -----------------------------------------------------------------------------------------------------

    def see_goal(self, t: float, client: Client, goal: GoalHandle) -> None:
        """Judge a change of a goal that a client sees."""
        self._note_law(t, LAW, self.order.judge_goal(client, goal))

    def see_states(self, t: float, client: Client) -> None:
        """Judge the states that a client sees."""
        self._note_law(t, LAW, self.order.judge_states(client))

    # --- goals -------------------------------------------------------------------------------------------------------

    def _on_status(self, said: SentMessage) -> None:
        status = decode(said.payload, GoalStatus)
        # A process that has replaced another may be asked for the same goal again, as long as nobody got an answer.
        rank, which = (_RANK[status.state], status.revision), (said.source, status.goal_id)
        if rank <= self._ranks.get(which, (-1, 0)):
            self.note(said.t, "goals move forward", f"{status.goal_id} is {status.state} again")
        self._ranks[which] = rank
        if (record := status.as_record()) is not None:
            self._note_record(record, said.t)
        self._note_law(said.t, LAW, self.order.judge_status(status))
        if which in self._interrupted_early and status.state is State.DISPATCHING:
            self.note(
                said.t, "interrupts count", f"{status.goal_id} is dispatched, and was interrupted before its start"
            )
        self._judge_terminal(said, status)

    def _on_refusal_to_interrupt(self, said: SentMessage) -> None:
        """A process that does not know the goal remembers the interrupt, should the start still arrive there."""
        refusal = decode(said.payload, ErrorReply)
        if refusal.code is ErrorCode.UNKNOWN_GOAL:
            self._interrupted_early.add((said.source, refusal.message.rstrip(".").rpartition(" ")[2]))

    def _on_answer(self, said: SentMessage) -> None:
        self._judge_terminal(said, decode(said.payload, GoalStatus))

    def _judge_terminal(self, said: SentMessage, status: GoalStatus) -> None:
        goal, terminal = status.goal_id, status.terminal
        told = self._told.get((said.source, goal))
        if terminal is None:
            if told is not None:
                text = f"{goal} ended {told.label}, and is {status.state} afterwards"
                self.note(said.t, "one terminal answer", text)
            return
        self._told[said.source, goal] = terminal
        self.answers.setdefault(goal, set()).add(terminal.label)
        # A process that has replaced another knows of its goals what the resource manager knows. For others it may
        # find another answer, for a client that asks again because none has arrived.
        known = told or self._binding.get(goal)
        if known is not None and (known != terminal if told else known.label != terminal.label):
            text = f"{goal} ended {known.label} ({known.reason}) and {terminal.label} ({terminal.reason})"
            self.note(said.t, "one terminal answer", text)
        self.terminals[goal] = terminal
        if goal in self._known:
            self._binding[goal] = terminal

    def _on_push(self, said: SentMessage) -> None:
        pushed: dict[str, Any] = msgspec.msgpack.decode(said.payload)
        verdict = Ending.LOST if pushed["type"] == "lost" else Ending.INVARIANT_VIOLATED
        self.verdicts[pushed["goal_id"]] = verdict

    # --- resources ---------------------------------------------------------------------------------------------------

    def _on_step(self, said: SentMessage) -> None:
        step = decode(said.payload, ResourceStep)
        if self.step is not None and step.number != self.step + 1:
            self.note(said.t, "no step lost", f"step {step.number} came after step {self.step}")
        self.step = step.number
        for change in step.changes:
            if self.states[change.subject] != change.before:
                text = f"step {step.number} brings {change.subject} from {change.before} to {change.after}"
                self.note(said.t, "no step lost", f"{text}; it was {self.states[change.subject]}")
            self.states[change.subject] = change.after
        self.order.note_step(step, self.states)
        for record in step.records:
            self._note_record(record, said.t)

    def _on_states(self, said: SentMessage) -> None:
        told = decode(said.payload, ResourceStates)
        self.step = told.step if self.step is None else self.step
        if (told.step, told.states) != (self.step, self.states):
            text = f"told {told.states} after step {told.step}, published {self.states} after {self.step}"
            self.note(said.t, "no step lost", text)
        self.order.note_states(told)

    def _on_verdict(self, said: SentMessage) -> None:
        verdict: dict[str, Any] = msgspec.msgpack.decode(said.payload)
        if verdict["type"] == "ended" and verdict["terminal"] is not None:
            self._known.add(verdict["goal_id"])
        if verdict["type"] != "granted":
            return
        granted = msgspec.convert(verdict, Granted)
        known = self._tokens.get(granted.goal_id)
        if known is None and granted.token <= self._last_token:
            text = f"{granted.goal_id} got {granted.token} after {self._last_token} was given"
            self.note(said.t, "tokens grow", text)
        elif known is not None and known != granted.token:
            self.note(said.t, "tokens grow", f"{granted.goal_id} got {granted.token} and before {known}")
        self._known.add(granted.goal_id)
        self._tokens[granted.goal_id] = granted.token
        self._last_token = max(self._last_token, granted.token)

    # --- the timeline ------------------------------------------------------------------------------------------------

    def _on_record(self, said: SentMessage) -> None:
        self._note_record(decode(said.payload, Record), said.t)

    def _note_record(self, record: Record, t: float) -> None:
        known = self.records.get(record.id)
        if known is not None and known != record:
            self.note(t, "records have ids of their own", f"{record.id}: {known.text!r} and {record.text!r}")
        self.records[record.id] = record
        self.order.note_record(record)
        if record.cause is not None and record.cause not in self.records:
            self.note(t, "causes can be looked up", f"{record.id} comes of {record.cause}, which nobody wrote")
