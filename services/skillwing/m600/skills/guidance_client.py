"""How a skill manager flies: it gives guidance one motion at a time and follows what becomes of it."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any

from skillwing.m600.functional_layer_client import Command
from skillwing.m600.latest import Latest
from skillwing.onboard.topics.guidance import (
    GUIDANCE_COMMAND,
    GUIDANCE_STATUS,
    AxisStatus,
    GuidanceCommand,
    GuidanceStatus,
    Motion,
    MotionState,
    Stop,
)
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal, SkillHooks

AT_REST = frozenset({MotionState.IDLE, MotionState.STOPPED, MotionState.DONE, MotionState.BLOCKED, MotionState.ABORTED})
"""States in which the drone no longer moves for whoever commanded the axis."""
GIVEN_BACK = frozenset({MotionState.IDLE, MotionState.STOPPED, MotionState.ABORTED})
"""States in which guidance counts on nobody to command the axis: unless somebody takes it, the drone is landed."""
SILENCE_LIMIT = 2.0
"""Guidance that has not reported for this long is gone, and so is a goal that its reports do not name [s]."""
UNDER_WAY = 0.15
"""Reports may take this long: right after a new motion they can still speak of the one before [s]."""


class Axis(StrEnum):
    """What a skill commands, and reads the state of."""

    BODY = "body"
    HEADING = "heading"


class GuidanceClient:
    """Guidance, as the manager of one skill sees it.

    `on_report` gets each report about the current goal's motion while it flies and while it is being stopped.
    The rest happens here: a motion that guidance refuses, does not answer, or drops without a word fails the goal with
    a sentence; an interrupted goal is confirmed when guidance reports that the drone is at rest.
    """

    def __init__(
        self, hooks: SkillHooks[Any, Any, Any], axis: Axis, on_report: Callable[[Goal[Any], AxisStatus], None]
    ) -> None:
        self._hooks, self._bus, self._axis, self._on_report = hooks, hooks.bus, axis, on_report
        self._status = Latest(hooks.bus, GUIDANCE_STATUS, GuidanceStatus, self._receive, at_rest=True)
        self._goal: Goal[Any] | None = None
        self._command: Command | None = None
        self._watchdog: Handle | None = None
        self._taken_at: float | None = None
        self._named_at = 0.0
        self._stopping = False
        self._given_back = False

    @property
    def remaining(self) -> float:
        """How far the motion still has to go [m; rad for the heading], 0 while nothing is known."""
        axis = self._axis_status()
        return axis.remaining if axis is not None and self._goal is not None and axis.goal_id == self._goal.id else 0.0

    @property
    def laps_done(self) -> float:
        """Of the goal's orbit, 0 while nothing is known."""
        status = self._status.value
        if status is None or self._goal is None or status.body.goal_id != self._goal.id:
            return 0.0
        return status.laps_done or 0.0

    @property
    def free_distance(self) -> float | None:
        """Metres that are free on the way to the target; None where nobody can tell."""
        return None if self._status.value is None else self._status.value.free_distance

    def fly(self, goal: Goal[Any], motion: Motion, on_refused: Callable[[str], None] | None = None) -> None:
        """Start a motion for the goal, in place of the goal's earlier one.

        on_refused: what to do about a refusal, told in a sentence, in place of failing the goal.
        """
        self._forget()
        self._goal = goal
        self._status.follow()
        self._named_at = self._bus.now()
        self._watchdog = self._bus.every(SILENCE_LIMIT / 4, self._watch)
        self._send(goal, motion, self._taken, on_refused or self._refused)

    def stop(self, goal: Goal[Any]) -> None:
        """Brake, and confirm the goal's interruption when the drone is at rest."""
        if self._goal is None or self._goal.id != goal.id:
            self._hooks.interrupted(goal.id)
            return
        self._stopping = True
        self._taken_at = None
        # Refused means that guidance does not fly for this goal; its reports tell when the axis is at rest.
        self._send(goal, Stop(), self._taken, lambda _: self._taken())

    def release(self, goal: Goal[Any]) -> None:
        """The goal is over: what may still move for it stops, and guidance knows that nobody commands the axis."""
        if self._goal is None or self._goal.id != goal.id:
            return
        given_back = self._given_back
        self._forget()
        self._status.rest()
        if given_back:
            return
        # Not followed, and not cancelled by the next goal: its command carries a newer token anyway.
        Command(self._bus, GUIDANCE_COMMAND, GuidanceCommand(goal_id=goal.id, token=goal.token, motion=Stop()))

    def _send(
        self, goal: Goal[Any], motion: Motion, on_taken: Callable[[], None], on_refused: Callable[[str], None]
    ) -> None:
        if self._command is not None:
            self._command.cancel()
        self._command = Command(
            self._bus,
            GUIDANCE_COMMAND,
            GuidanceCommand(goal_id=goal.id, token=goal.token, motion=motion),
            on_taken=on_taken,
            on_refused=on_refused,
            on_silence=lambda: self._fail("Guidance does not answer. Check that its process runs."),
        )

    def _taken(self) -> None:
        self._taken_at = self._named_at = self._bus.now()

    def _refused(self, sentence: str) -> None:
        self._given_back = True
        self._fail(f"Guidance refused the motion. {sentence}")

    def _receive(self, status: GuidanceStatus) -> None:
        goal, taken_at = self._goal, self._taken_at
        if goal is None or taken_at is None or status.t < taken_at + UNDER_WAY:
            return
        axis = status.body if self._axis is Axis.BODY else status.heading
        if axis.goal_id == goal.id:
            self._named_at = self._bus.now()
            self._given_back = axis.state in GIVEN_BACK
            if self._stopping and axis.state is MotionState.STOPPED:
                self._hooks.interrupted(goal.id)
            else:
                self._on_report(goal, axis)
        elif self._stopping and axis.state in AT_REST:
            self._given_back = True
            self._hooks.interrupted(goal.id)

    def _watch(self) -> None:
        """Notice what no report would tell: that there are none, or none about this goal."""
        if self._bus.now() - self._named_at < SILENCE_LIMIT:
            return
        if not self._status.is_fresh(SILENCE_LIMIT):
            self._fail(f"Guidance has not reported for {SILENCE_LIMIT:g} s. Check that its process runs.")
        elif self._taken_at is not None:
            self._fail("Guidance no longer flies for this goal. Start the skill again.")

    def _fail(self, sentence: str) -> None:
        if self._goal is not None:
            self._hooks.failed(self._goal.id, sentence)

    def _axis_status(self) -> AxisStatus | None:
        status = self._status.value
        if status is None:
            return None
        return status.body if self._axis is Axis.BODY else status.heading

    def _forget(self) -> None:
        if self._command is not None:
            self._command.cancel()
        if self._watchdog is not None:
            self._watchdog.cancel()
        self._goal = self._command = self._watchdog = self._taken_at = None
        self._stopping = self._given_back = False
