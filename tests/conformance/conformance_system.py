"""A system under test as any client sees it, and a `Stage` for what a client cannot do.

The cases use only the wire protocol (docs/protocol.md). An implementation in any other language can be tested with a
`Stage` of its own.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, NoReturn, Protocol, TypeAlias

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, NoReply, Refused, RunnableBus, Sample
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.ids import new_goal_id
from skillwing.services.mocking import MockRun
from skillwing.services.protocol import (
    DataReading,
    ErrorReply,
    FireEvent,
    FireExtern,
    GoalProgress,
    GoalStatus,
    InterruptGoal,
    Keys,
    Lost,
    Message,
    QueryData,
    QueryGoal,
    QueryReady,
    QueryStates,
    ReadyReport,
    Record,
    ResourceStates,
    ResourceStep,
    SkillReady,
    StartGoal,
    State,
    Terminal,
    Violated,
    decode,
    encode,
)
from skillwing.services.testing.data_feed import DataFeed

CLIENT = "suite"
PATIENCE = 15.0
"""Longest wait on a busy machine [s]."""
SILENT = 0.5
"""Seconds after which a question counts as unanswered."""
PRESSURE = 4.0
AT_REST = {"door": "SHUT", "part": "ABSENT", "gripper": "OPEN", "table": "LOW", "lamp": "DARK"}
"""States to which the robot can bring resources by itself. Only skills move the arm."""

Told: TypeAlias = GoalStatus | ErrorReply | None
"""Answer to a request about a goal; None is silence."""


class Stage(Protocol):
    """A running system of the workbench, and its controls."""

    skillset: Skillset
    apart: bool
    """True if each manager has a process of its own."""

    def bus(self, name: str) -> RunnableBus:
        """Open the connection of another client."""
        ...

    def plan(self, skill: str, run: MockRun) -> None:
        """Plan the next goal that the skill dispatches. A goal without a plan runs until it is interrupted."""
        ...

    def end_now(self, skill: str, result: str) -> None:
        """Have the skill report a result for its goal at once, in any state of the goal."""
        ...

    def kill(self, process: str) -> None:
        """Kill a process as `kill -9` does."""
        ...

    def restart(self, process: str) -> None:
        """Start a killed process again."""
        ...

    def freeze(self, process: str) -> None:
        """Stop a process as SIGSTOP does."""
        ...

    def thaw(self, process: str) -> None:
        """Continue a process as SIGCONT does."""
        ...

    def hang(self, skill: str) -> None:
        """Hang the manager of a skill: its process and its session live, but it does nothing."""
        ...

    def tidy(self) -> None:
        """Bring back the initial state: frozen processes continue, hung and killed ones start again."""
        ...

    def close(self) -> None: ...


class System:
    """Client of the workbench, which stores all messages to it."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.skillset = stage.skillset
        self.keys = Keys(stage.skillset.name)
        self.bus = stage.bus(CLIENT)
        self.statuses: list[GoalStatus] = []
        self.feedback: list[GoalProgress] = []
        self.verdicts: list[Violated | Lost] = []
        self.steps: list[ResourceStep] = []
        """Published steps of the resource manager, in the order of their arrival."""
        self.records: dict[str, Record] = {}
        self._asked_for: dict[str, str] = {}
        self._replaced: Counter[str] = Counter()
        self._listen(self.keys.verdict("*"), Violated | Lost, self.verdicts.append)
        self._listen(self.keys.resource_steps, ResourceStep, self.steps.append)
        follow_records(self.bus, self.keys, self._note, self.statuses.append)
        self.bus.subscribe(
            self.keys.progress("*"), lambda each: self.feedback.append(decode(each.payload, GoalProgress))
        )
        self._feed = DataFeed(self.bus, stage.skillset)
        self.set_pressure(PRESSURE)
        # Any answer shows that a manager is there, even a refusal.
        assert self.asked_states() is not None
        assert all(self.goal(skill.name, "none") is not None for skill in stage.skillset.skills)

    # --- goals -------------------------------------------------------------------------------------------------------

    def start(
        self,
        skill: str,
        goal_id: str | None = None,
        inputs: dict[str, Any] | None = None,
        *,
        patience: float = PATIENCE,
        **said: Any,
    ) -> tuple[str, Told]:
        """Request a goal. said: fields of `StartGoal` with unusual values. Returns the goal's id and the answer."""
        goal_id = goal_id or new_goal_id()
        return goal_id, self._about(self.keys.start(skill), self.start_of(skill, goal_id, inputs, **said), patience)

    def start_of(self, skill: str, goal_id: str, inputs: dict[str, Any] | None = None, **said: Any) -> StartGoal:
        """Message that requests a goal."""
        self._asked_for[goal_id] = skill
        usual: dict[str, Any] = {"client": CLIENT, "schema": self.skillset.schema_hash}
        return StartGoal(goal_id=goal_id, inputs=inputs or {}, **(usual | said))

    def run(self, skill: str, inputs: dict[str, Any] | None = None, **plan: Any) -> str:
        """Start a planned goal, and wait until it runs or has ended. Returns its id."""
        self.stage.plan(skill, MockRun(**plan))
        goal_id, _ = self.start(skill, inputs=inputs)
        self.until(lambda: self.state(goal_id) in (State.RUNNING, State.TERMINATED), f"the goal of {skill} to run")
        return goal_id

    def interrupt(self, skill: str, goal_id: str) -> Told:
        return self._about(self.keys.interrupt(skill), InterruptGoal(goal_id=goal_id, client=CLIENT))

    def goal(self, skill: str, goal_id: str | None) -> Told:
        return self._about(self.keys.goal(skill), QueryGoal(goal_id=goal_id))

    def replace(self, skill: str) -> None:
        """Kill a skill's manager, and start another process under its name."""
        self._replaced[skill] += 1
        self.stage.kill(f"skill/{skill}")
        self.stage.restart(f"skill/{skill}")

    # --- published messages ------------------------------------------------------------------------------------------

    def story(self, goal_id: str) -> list[State]:
        """Published states of the goal, in order."""
        return [status.state for status in self.statuses if status.goal_id == goal_id]

    def state(self, goal_id: str) -> State | None:
        """State of the goal that was published last."""
        return next(reversed(self.story(goal_id)), None)

    def terminals(self, goal_id: str) -> list[Terminal]:
        return [each.terminal for each in self.statuses if each.goal_id == goal_id and each.terminal is not None]

    def end(self, goal_id: str, within: float = PATIENCE) -> Terminal:
        """Wait for the one terminal answer."""
        self.until(lambda: bool(self.terminals(goal_id)), f"the end of {goal_id}", within)
        return self.terminals(goal_id)[0]

    def verdict(self, goal_id: str) -> Violated | Lost:
        """Wait until the resource manager has ended the goal."""
        self.until(lambda: any(each.goal_id == goal_id for each in self.verdicts), f"a verdict on {goal_id}")
        return next(each for each in self.verdicts if each.goal_id == goal_id)

    def causes(self, goal_id: str) -> list[str]:
        """Causes of the goal's last state, the root first, as `subject STATE`."""
        record_id = [status.record for status in self.statuses if status.goal_id == goal_id][-1]
        chain: list[str] = []
        while record_id is not None:
            self.until(lambda wanted=record_id: wanted in self.records, f"the record {record_id}")
            record = self.records[record_id]
            chain.append(f"{record.subject} {record.after}")
            record_id = record.cause
        return chain[::-1]

    # --- resources and data ------------------------------------------------------------------------------------------

    @property
    def states(self) -> dict[str, str]:
        """Current states of the resources, from the resource manager."""
        asked = self.asked_states()
        return {} if asked is None else asked.states

    def asked_states(self, patience: float = PATIENCE) -> ResourceStates | None:
        """States of all resources, with the number of the step; None without an answer."""
        answer = self.ask(self.keys.resource_states, encode(QueryStates()), patience)
        return decode(answer.payload, ResourceStates) if isinstance(answer, Answered) else None

    def ready(
        self, skill: str, inputs: dict[str, Any] | None = None, schema: str | None = None
    ) -> tuple[SkillReady, ...] | ErrorReply:
        """Readiness of a skill, or of all for an empty name."""
        query = QueryReady(skill=skill, inputs=inputs, schema=schema or self.skillset.schema_hash)
        answer = self.ask(self.keys.resource_ready, encode(query))
        assert not isinstance(answer, NoReply), "the resource manager does not answer"
        return answer.error if isinstance(answer, Refused) else decode(answer.payload, ReadyReport).skills

    def trigger(self, resource: str, target: str) -> ResourceStates | ErrorReply:
        """Report a transition of the robot. The answer holds the states after all its consequences."""
        return self._fired(self.keys.resource_extern, FireExtern(resource=resource, target=target, source=CLIENT))

    def fire(self, event: str) -> ResourceStates | ErrorReply:
        return self._fired(self.keys.event(event), FireEvent(event=event, source=CLIENT))

    def set_pressure(self, value: float) -> None:
        """Publish the pressure from now on, and wait until the data manager has it."""
        self._feed.set({"pressure": value})
        self.until(lambda: self.reading().value == value, "the data manager to have the pressure")

    def reading(self) -> DataReading:
        """Current pressure, from the data manager."""
        answer = self.ask(self.keys.data("pressure"), encode(QueryData()))
        assert isinstance(answer, Answered)
        return decode(answer.payload, DataReading)

    def stop_pressure(self) -> None:
        """Stop the publication of the pressure: it is stale after three periods."""
        self._feed.stop("pressure")

    # --- time --------------------------------------------------------------------------------------------------------

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        self.bus.run_until(lambda: False, seconds)

    def until(self, condition: Callable[[], bool], what: str, within: float = PATIENCE) -> None:
        """Let time pass until a condition holds. Conditions may ask questions."""
        deadline = self.bus.wall() + within
        while not condition():
            if self.bus.wall() > deadline:
                self._fail(f"Waited {within:g} s in vain for {what}.")
            self.wait(0.02)

    def until_states(self, **states: str) -> None:
        self.until(lambda: states.items() <= self.states.items(), f"{states}")

    # --- asking ------------------------------------------------------------------------------------------------------

    def ask(self, key: str, payload: bytes, patience: float = PATIENCE) -> Answer:
        """Send any bytes to any key, again after each silence until `patience` is over. Repeats have to be harmless."""
        give_up = self.bus.wall() + patience
        while True:
            answers: list[Answer] = []
            self.bus.ask(key, payload, answers.append, timeout=SILENT)
            self.bus.run_until(lambda answers=answers: bool(answers), PATIENCE)
            if not isinstance(answers[0], NoReply) or self.bus.wall() >= give_up:
                return answers[0]
            self.wait(0.02)

    def _about(self, key: str, message: Message, patience: float = PATIENCE) -> Told:
        match self.ask(key, encode(message), patience):
            case Answered(payload):
                return decode(payload, GoalStatus)
            case Refused(error):
                return error
            case NoReply():
                return None

    def _fired(self, key: str, message: Message) -> ResourceStates | ErrorReply:
        answer = self.ask(key, encode(message))
        assert not isinstance(answer, NoReply), f"nobody answers on {key}"
        return answer.error if isinstance(answer, Refused) else decode(answer.payload, ResourceStates)

    # --- afterwards --------------------------------------------------------------------------------------------------

    def leave(self) -> None:
        """End all goals, and check the laws of every case: one end per goal, and every resource free."""
        try:
            self.stage.tidy()
            self.set_pressure(PRESSURE)
            for goal_id, skill in self._asked_for.items():
                # A manager that was started again does not know the goals of the killed one, which are lost.
                if not self.terminals(goal_id) and isinstance(self.interrupt(skill, goal_id), GoalStatus):
                    self.end(goal_id)
            for resource, state in AT_REST.items():
                if self.states[resource] != state:
                    assert isinstance(self.trigger(resource, state), ResourceStates)
            self.until_states(arm="FREE", **AT_REST)
            for goal_id, skill in self._asked_for.items():
                ends = self.terminals(goal_id)
                assert all(end == ends[0] for end in ends), f"{goal_id} has several ends: {ends}"
                assert len(ends) <= 1 + self._replaced[skill], f"one process told more than once how {goal_id} ended"
        finally:
            self.bus.close()

    # --- inside ------------------------------------------------------------------------------------------------------

    def _listen(self, key: str, kind: Any, take: Callable[[Any], None]) -> None:
        def hear(sample: Sample) -> None:
            take(decode(sample.payload, kind))

        self.bus.subscribe(key, hear, events=True)

    def _note(self, record: Record) -> None:
        self.records[record.id] = record

    def _fail(self, sentence: str) -> NoReturn:
        told = "\n".join(
            f"  {status.goal_id} {status.skill} {status.state} {status.terminal}" for status in self.statuses
        )
        raise AssertionError(f"{sentence}\nStates: {self.states}\nTold:\n{told}")
