"""Leaf that runs a skill.

A tick never waits: it starts the skill, reads the state of its goal, and returns. Phases of the leaf:
`IDLE -> (WAITING ->) SENT -> RUNNING -> DONE`, or `CANCELLING -> DONE` after a halt. In phase `HELD` a pause gate has
interrupted the goal; the leaf stays RUNNING. When no gate blocks it, the leaf waits for the end of that goal. Then it
starts another one, unless the first has come to its own end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry, MissingValueError
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.bt_missions.leaves.pause_gate import HELD, PauseGate, PauseGates
from skillwing.bt_missions.leaves.reaper import StartRetry
from skillwing.bt_missions.leaves.skill_inputs import SkillInputs, plain_inputs
from skillwing.bt_missions.leaves.source_location import set_caller_location
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidInputError
from skillwing.services.protocol import Ending, ProtocolError, State, Terminal

DEFAULT_PATIENCE = 15.0
"""Time in which cancelled goals have to release resources that a leaf needs, in seconds of robot time."""


class GoalPhase(StrEnum):
    """Phase of a leaf with respect to its goal."""

    IDLE = "idle"
    WAITING = "waiting"
    SENT = "sent"
    RUNNING = "running"
    HELD = "held"
    CANCELLING = "cancelling"
    DONE = "done"


class SkillAction(Behaviour):
    """Runs one skill. Its terminal label decides between SUCCESS and FAILURE, as `outcomes` maps it.

    inputs: value of each input of the skill, or a function that returns it at the start: a BlackboardEntry, or a
    LatestReading of the robot's data. A structure may be a mapping, or one of the generated interface.
    outputs: entries for outputs of the skill. They are written when a goal has ended with an output.
    outcomes: status for each terminal label (`S_ARRIVED`, `S_BLOCKED`, `RI`, `IT`, ...). A label without an entry is
    SUCCESS for a success result that held, else FAILURE. `IT` is never SUCCESS: an interrupted skill has not done its
    work. A leaf that was held starts another goal, or, if `outcomes` has `HELD`, ends with that.
    on_end: called with the terminal of the goal, unless the leaf was halted before; `IT` or `RI` if it was held.
    done: inputs that a held goal works off, each with the feedback field that counts it: `{"laps": "laps_done"}`.
    patience: longest wait for cancelled goals that hold what this skill needs, in seconds of robot time.
    robot: name of the robot, in a mission on several robots. FAILURE while that robot cannot be reached.

    A halt (`terminate(INVALID)`) is immediate for the tree, also before the manager has replied, and may be repeated.
    The reaper follows the goal until the robot has stopped.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        *,
        outputs: Mapping[str, BlackboardEntry] | None = None,
        outcomes: Mapping[str, Status] | None = None,
        on_end: Callable[[Terminal], None] | None = None,
        done: Mapping[str, str] | None = None,
        patience: float = DEFAULT_PATIENCE,
        robot: str | None = None,
    ) -> None:
        super().__init__(name)
        set_caller_location(self)
        self._context = context.of(robot)
        self.robot = self._context.robot
        self.skillset = self._context.skillset
        self.skill = skill
        self.inputs = plain_inputs(inputs or {})
        self.outputs = dict(outputs or {})
        self.outcomes = dict(outcomes or {})
        self.on_end = on_end
        self.done = dict(done or {})
        self.patience = patience
        self._phase = GoalPhase.IDLE
        self._goal: GoalView | None = None
        self._ending: str | None = None
        self._asked_at = 0.0
        self._gates = PauseGates(skill)
        self._held_goal: GoalView | None = None
        self._values = SkillInputs(skill, self.inputs, self.done)
        self._retry = StartRetry(skill, self._context.reaper)
        _refuse_bad_outcomes(name, self.outcomes)
        for entry in self.outputs.values():
            entry.announce()

    @property
    def phase(self) -> GoalPhase:
        """Phase of the leaf; a cancelled goal is DONE when the robot has stopped."""
        cancelled = self._phase is GoalPhase.CANCELLING and self._goal is not None and self._goal.done
        return GoalPhase.DONE if cancelled else self._phase

    @property
    def goal(self) -> GoalView | None:
        """The latest goal of this leaf."""
        return self._goal

    @property
    def terminal(self) -> Terminal | None:
        """The terminal of the latest goal; None until it has ended."""
        return self._goal.terminal if self._goal else None

    @property
    def ending(self) -> str | None:
        """The label of the goal with which this leaf ended, or `HELD`. None before the end and without a goal."""
        return self._ending

    def follow(self, gate: PauseGate) -> None:
        """Let `gate` hold this leaf from now on. The node above calls this when the tree is built."""
        self._gates.add(gate)

    # --- ticks

    def initialise(self) -> None:
        self._values.reset()
        self._held_goal = None
        self._begin()

    def _begin(self) -> None:
        self._asked_at = self._context.now()
        self._retry.begin()
        self._ending = None
        self._phase = GoalPhase.WAITING

    def update(self) -> Status:
        if self._phase is GoalPhase.HELD:
            return self._continue_when_open()
        if self._phase is GoalPhase.WAITING:
            return self._start_when_free()
        assert self._goal is not None, "a leaf that has sent something has a goal"
        return self._follow_goal(self._goal)

    def _follow_goal(self, goal: GoalView) -> Status:
        if goal.terminal is not None:
            if self._gates.explain(goal.terminal):
                return self._hold(goal, goal.terminal.reason)
            return self._conclude(goal, goal.terminal)
        if self._context.absence:
            self._context.cancel(goal)
            return self._fail(f"{self.skill} cannot be followed: {self._context.absence}", None)
        reason = self._gates.blocked_by()
        if reason is not None:
            self._context.cancel(goal)
            return self._hold(goal, reason)
        if goal.state in (State.RUNNING, State.INTERRUPTING):
            self._phase = GoalPhase.RUNNING
        self.feedback_message = str(self._phase)
        return Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        if new_status is not Status.INVALID:
            return
        if self._goal is not None and not self._goal.done:
            self._context.cancel(self._goal)
            self._phase = GoalPhase.CANCELLING
            self.feedback_message = "halted; its goal is being interrupted"
        elif self._phase in (GoalPhase.WAITING, GoalPhase.HELD):
            self._phase = GoalPhase.IDLE
            self.feedback_message = ""
        elif self._phase in (GoalPhase.SENT, GoalPhase.RUNNING):
            self._phase = GoalPhase.DONE
            self.feedback_message = "halted just after its goal had ended"

    # --- start

    def _start_when_free(self) -> Status:
        held = self._held_goal
        if held is not None and (terminal := self._own_end(held)) is not None:
            return self._conclude(held, terminal)
        if self._context.absence:
            return self._fail(f"{self.skill} was not started: {self._context.absence}", None)
        try:
            reason = self._gates.blocked_by()
            if reason is not None:
                return self._hold(held, reason)
            holders = self._retry.holders()
            if holders:
                return self._wait_for(holders)
            self._values.count(held)
            self._held_goal = None
            self._retry.note_start()
            self._goal = self._context.start(self.skill, self._values.values(self._context.skillset))
        except (UnknownNameError, InvalidInputError, MissingValueError, ProtocolError) as error:
            return self._fail(f"{self.skill} was not started: {error}", None)
        self._phase = GoalPhase.SENT
        self.feedback_message = str(self._phase)
        return Status.RUNNING

    def _wait_for(self, holders: tuple[GoalView, ...]) -> Status:
        names = ", ".join(sorted({goal.skill for goal in holders}))
        if self._is_patient():
            self.feedback_message = f"waiting until {names} has stopped"
            return Status.RUNNING
        return self._fail(f"{self.skill} was not started: {names} did not stop within {self.patience:g} s", None)

    def _is_patient(self) -> bool:
        return self._context.now() - self._asked_at <= self.patience

    # --- holds

    def _hold(self, goal: GoalView | None, reason: str) -> Status:
        """Enter the phase HELD. goal: the one that the gate interrupts."""
        self._phase = GoalPhase.HELD
        self._held_goal = goal
        self.feedback_message = f"held: {reason}"
        return Status.RUNNING

    def _continue_when_open(self) -> Status:
        goal = self._held_goal
        if goal is not None and (terminal := self._own_end(goal)) is not None:
            return self._conclude(goal, terminal)
        if self._context.absence:
            return self._fail(f"{self.skill} was held: {self._context.absence}", None)
        reason = self._gates.blocked_by()
        if reason is not None:
            self.feedback_message = f"held: {reason}"
            return Status.RUNNING
        if HELD in self.outcomes:
            return self._end_held(goal)
        self._begin()
        return self._start_when_free()

    def _end_held(self, goal: GoalView | None) -> Status:
        self._ending = HELD
        if self.on_end is not None:
            ended = None if goal is None else goal.terminal
            self.on_end(ended or Terminal(ending=Ending.INTERRUPTED, reason="held before it had begun"))
        if self.outcomes[HELD] is Status.FAILURE:
            return self._fail(f"{self.skill} was held and does not begin again", None)
        self._phase = GoalPhase.DONE
        self.feedback_message = HELD
        return Status.SUCCESS

    def _own_end(self, goal: GoalView) -> Terminal | None:
        """The end of a held goal that ended by itself, before the interruption could reach it; None for any other."""
        terminal = goal.terminal
        if terminal is None or terminal.ending is Ending.INTERRUPTED or self._gates.explain(terminal):
            return None
        return terminal

    # --- end

    def _conclude(self, goal: GoalView, terminal: Terminal) -> Status:
        self._held_goal = None
        if self._is_patient() and self._retry.note_refusal(terminal):
            self._phase = GoalPhase.WAITING
            return self._start_when_free()
        if terminal.ending is Ending.LOST:
            self._context.reaper.take(goal)
        self._ending = terminal.label
        self._write_outputs(terminal)
        if self.on_end is not None:
            self.on_end(terminal)
        if self._status_of(terminal) is Status.FAILURE:
            return self._fail(f"{self.skill} ended {terminal.label}: {terminal.reason}", goal.record)
        self._phase = GoalPhase.DONE
        self.feedback_message = terminal.label
        self._context.observe(f"{self.skill} ended {terminal.label}", goal.record)
        return Status.SUCCESS

    def _write_outputs(self, terminal: Terminal) -> None:
        output = terminal.output or {}
        for name, entry in self.outputs.items():
            if name in output:
                entry.write(output[name])

    def _status_of(self, terminal: Terminal) -> Status:
        succeeded = terminal.ending is Ending.SUCCEEDED and terminal.success
        return self.outcomes.get(terminal.label, Status.SUCCESS if succeeded else Status.FAILURE)

    def _fail(self, reason: str, record: str | None) -> Status:
        self._phase = GoalPhase.DONE
        self.feedback_message = reason
        self._context.observe(reason, record, failed=True)
        return Status.FAILURE


def _refuse_bad_outcomes(name: str, outcomes: Mapping[str, Status]) -> None:
    """Raise ValueError for a mapping with which a tree would hang, or count an interruption as success."""
    for label, status in outcomes.items():
        if status not in (Status.SUCCESS, Status.FAILURE):
            raise ValueError(f"Leaf `{name}` maps {label} to {status.name}; map it to SUCCESS or FAILURE.")
    if outcomes.get(Ending.INTERRUPTED) is Status.SUCCESS:
        raise ValueError(f"Leaf `{name}` maps IT to SUCCESS, but an interrupted skill has not done its work.")
