"""The leaf that runs a skill.

A tick never waits: it starts the skill, looks at what has become of it, and returns. Between two ticks the goal
lives in its managers; `IDLE -> (WAITING ->) SENT -> RUNNING -> DONE`, or `CANCELLING -> DONE` once halted. A leaf that
is held (`HELD`) has its goal interrupted and stays RUNNING; when nothing holds it any more it begins again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from skillwing.bt_missions.leaves.context import SETTLE_TIME, MissionContext
from skillwing.bt_missions.leaves.interface import GoalView
from skillwing.bt_missions.leaves.pause_gate import HELD, PauseGate
from skillwing.bt_missions.leaves.reaper import Mark
from skillwing.bt_missions.leaves.source_location import set_caller_location
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidInputError
from skillwing.services.protocol import Ending, State, Terminal

DEFAULT_PATIENCE = 15.0
"""How long a leaf waits for resources of goals that are being cancelled, in seconds of robot time."""


class GoalPhase(StrEnum):
    """Where a leaf is with its goal."""

    IDLE = "idle"
    WAITING = "waiting"
    SENT = "sent"
    RUNNING = "running"
    HELD = "held"
    CANCELLING = "cancelling"
    DONE = "done"


class SkillAction(Behaviour):
    """Runs one skill; SUCCESS or FAILURE as `outcomes` says of its terminal label.

    inputs: value of each input of the skill, or a function that gives it at the moment of the start.
    outcomes: what each terminal label (`S_ARRIVED`, `S_BLOCKED`, `RI`, `IT`, ...) means for the tree. Labels that are
    not named mean SUCCESS for a success result of the skill that held, and FAILURE for everything else. An interrupted
    skill has not done its work: `IT` is never SUCCESS. A leaf that was held starts another goal as soon as it may, or,
    if `outcomes` names `HELD`, ends with that.
    on_end: told how the goal ended, unless the leaf was halted before; `IT` or `RI` for one that was held.
    done: inputs of which a goal that is held has done a part, each with the feedback that says how much: the goal that
    goes on is asked for the rest, `{"laps": "laps_done"}`.
    patience: how long to wait for goals that are being cancelled and hold what this skill needs, in robot seconds.

    Halting (`terminate(INVALID)`) is immediate for the tree, also before the manager has answered, and may be
    repeated; the reaper follows the goal until the robot has really stopped.
    """

    def __init__(
        self,
        name: str,
        context: MissionContext,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        *,
        outcomes: Mapping[str, Status] | None = None,
        on_end: Callable[[Terminal], None] | None = None,
        done: Mapping[str, str] | None = None,
        patience: float = DEFAULT_PATIENCE,
    ) -> None:
        super().__init__(name)
        set_caller_location(self)
        self.skill = skill
        self.inputs = dict(inputs or {})
        self.outcomes = dict(outcomes or {})
        self._phase = GoalPhase.IDLE
        self._context = context
        self.on_end = on_end
        self.done = dict(done or {})
        self.patience = patience
        self._goal: GoalView | None = None
        self._sent_at: Mark = 0
        self._refused_at: Mark | None = None
        self._asked_at = 0.0
        self._ending: str | None = None
        self._gates: list[PauseGate] = []
        self._held_goal: GoalView | None = None
        self._held_at = 0.0
        self._done_so_far: dict[str, float] = {}
        _refuse_bad_outcomes(name, self.outcomes)

    @property
    def phase(self) -> GoalPhase:
        """Where the leaf is with its goal; a cancelled goal is DONE when the robot has really stopped."""
        cancelled = self._phase is GoalPhase.CANCELLING and self._goal is not None and self._goal.done
        return GoalPhase.DONE if cancelled else self._phase

    @property
    def goal(self) -> GoalView | None:
        """The latest goal of this leaf."""
        return self._goal

    @property
    def terminal(self) -> Terminal | None:
        """How the latest goal ended, once it has."""
        return self._goal.terminal if self._goal else None

    @property
    def ending(self) -> str | None:
        """How this leaf came to its end: the label of its goal, or `HELD`. None before that, and for a goal that was
        never asked for."""
        return self._ending

    def follow(self, hold: PauseGate) -> None:
        """From now on `hold` may keep this leaf from running. Whoever stands above it calls this when the tree is
        built."""
        self._gates.append(hold)

    def initialise(self) -> None:
        self._done_so_far = dict.fromkeys(self.done, 0.0)
        self._begin()

    def _begin(self) -> None:
        self._asked_at = self._context.now()
        self._refused_at = None
        self._ending = None
        self._phase = GoalPhase.WAITING

    def update(self) -> Status:
        if self._phase is GoalPhase.HELD:
            return self._go_on_when_let_go()
        if self._phase is GoalPhase.WAITING:
            return self._start_when_free()
        goal = self._goal
        assert goal is not None, "a leaf that has sent something has a goal"
        if goal.terminal is not None:
            if any(hold.explains(self.skill, goal.terminal) for hold in self._gates):
                return self._wait_while_held(goal, goal.terminal.reason)
            return self._conclude(goal, goal.terminal)
        reason = self._kept()
        if reason is not None:
            self._context.cancel(goal)
            return self._wait_while_held(goal, reason)
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

    def _kept(self) -> str | None:
        """Why this leaf must not run now, if anything holds it."""
        return next((reason for hold in self._gates if (reason := hold.blocks(self.skill)) is not None), None)

    def _wait_while_held(self, goal: GoalView | None, reason: str) -> Status:
        """goal: what ran until now, and ends because of the hold."""
        self._phase = GoalPhase.HELD
        self._held_goal = goal
        self._held_at = self._context.now()
        self.feedback_message = f"held: {reason}"
        return Status.RUNNING

    def _go_on_when_let_go(self) -> Status:
        goal = self._held_goal
        if goal is not None and goal.terminal is not None and not self._ended_for_the_hold(goal.terminal):
            # It came to its own end before the hold could reach it.
            return self._conclude(goal, goal.terminal)
        reason = self._kept()
        if reason is not None:
            self.feedback_message = f"held: {reason}"
            return Status.RUNNING
        if self._context.now() - self._held_at < SETTLE_TIME:
            return Status.RUNNING
        if HELD not in self.outcomes:
            self._count_what_is_done(goal)
            self._begin()
            return self._start_when_free()
        self._ending = HELD
        if self.on_end is not None:
            ended = None if goal is None else goal.terminal
            self.on_end(ended or Terminal(ending=Ending.INTERRUPTED, reason="held before it had begun"))
        if self.outcomes[HELD] is Status.FAILURE:
            return self._fail(f"{self.skill} was held and does not begin again", None)
        self._phase = GoalPhase.DONE
        self.feedback_message = HELD
        return Status.SUCCESS

    def _ended_for_the_hold(self, terminal: Terminal) -> bool:
        interrupted = terminal.ending is Ending.INTERRUPTED
        return interrupted or any(hold.explains(self.skill, terminal) for hold in self._gates)

    def _start_when_free(self) -> Status:
        try:
            reason = self._kept()
            if reason is not None:
                return self._wait_while_held(None, reason)
            holders = self._holders()
            if holders:
                return self._wait_for(holders)
            self._sent_at = self._context.reaper.mark()
            self._goal = self._context.start(self.skill, self._input_values())
        except (UnknownNameError, InvalidInputError) as error:
            return self._fail(f"{self.skill} was not started: {error}", None)
        self._phase = GoalPhase.SENT
        self.feedback_message = str(self._phase)
        return Status.RUNNING

    def _holders(self) -> tuple[GoalView, ...]:
        """Whom to wait for: goals on their way out that are in the way, and after a refusal any that may have been."""
        reaper = self._context.reaper
        if self._refused_at is not None and reaper.unchanged_since(self._refused_at):
            return reaper.unfinished
        return reaper.blocking(self.skill)

    def _wait_for(self, holders: tuple[GoalView, ...]) -> Status:
        names = ", ".join(sorted({goal.skill for goal in holders}))
        if self._is_patient():
            self.feedback_message = f"waiting until {names} has stopped"
            return Status.RUNNING
        return self._fail(f"{self.skill} was not started: {names} did not stop within {self.patience:g} s", None)

    def _is_patient(self) -> bool:
        return self._context.now() - self._asked_at <= self.patience

    def _input_values(self) -> dict[str, Any]:
        values = {name: value() if callable(value) else value for name, value in self.inputs.items()}
        for name, done in self._done_so_far.items():
            if done > 0.0:
                wanted = self._context.skillset.skill(self.skill).input(name)
                whole: Any = values.get(name, wanted.default)
                values[name] = whole - done if wanted.low is None else max(whole - done, wanted.low)
        return values

    def _count_what_is_done(self, goal: GoalView | None) -> None:
        told = {} if goal is None else goal.progress or {}
        for name, feedback in self.done.items():
            self._done_so_far[name] += float(told.get(feedback, 0.0))

    def _conclude(self, goal: GoalView, terminal: Terminal) -> Status:
        refused = terminal.ending in (Ending.NOT_READY, Ending.BUSY)
        reaper = self._context.reaper
        if refused and self._is_patient() and reaper.busy_since(self._sent_at):
            # py_trees starts a new branch before it halts the old one, so this goal may have met one that is on its
            # way out. Its resources come back when it has stopped; then a new goal may ask again.
            self._refused_at = reaper.mark()
            self._phase = GoalPhase.WAITING
            return self._start_when_free()
        if terminal.ending is Ending.LOST:
            reaper.take(goal)
        self._ending = terminal.label
        if self.on_end is not None:
            self.on_end(terminal)
        if self._status_of(terminal) is Status.FAILURE:
            return self._fail(f"{self.skill} ended {terminal.label}: {terminal.reason}", goal.record)
        self._phase = GoalPhase.DONE
        self.feedback_message = terminal.label
        self._context.observe(f"{self.skill} ended {terminal.label}", goal.record)
        return Status.SUCCESS

    def _status_of(self, terminal: Terminal) -> Status:
        succeeded = terminal.ending is Ending.SUCCEEDED and terminal.success
        return self.outcomes.get(terminal.label, Status.SUCCESS if succeeded else Status.FAILURE)

    def _fail(self, reason: str, record: str | None) -> Status:
        self._phase = GoalPhase.DONE
        self.feedback_message = reason
        self._context.observe(reason, record, failed=True)
        return Status.FAILURE


def _refuse_bad_outcomes(name: str, outcomes: Mapping[str, Status]) -> None:
    """Raise ValueError for a mapping that would make a tree hang or lie."""
    for label, status in outcomes.items():
        if status not in (Status.SUCCESS, Status.FAILURE):
            raise ValueError(f"Leaf `{name}` maps {label} to {status.name}; map it to SUCCESS or FAILURE.")
    if outcomes.get(Ending.INTERRUPTED) is Status.SUCCESS:
        raise ValueError(f"Leaf `{name}` maps IT to SUCCESS, but an interrupted skill has not done its work.")
