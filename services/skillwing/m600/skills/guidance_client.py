"""Client of guidance: commands one motion at a time for a skill manager, and follows its progress."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any

from skillwing.m600.functional_layer_client import SentCommand, send_command
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.view_loss import ViewLoss
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
from skillwing.services.protocol import RecordKind
from skillwing.services.timeline import Timeline

AT_REST = frozenset({MotionState.IDLE, MotionState.STOPPED, MotionState.DONE, MotionState.BLOCKED, MotionState.ABORTED})
"""States in which the drone no longer moves for the goal that commanded the axis."""
GIVEN_BACK = frozenset({MotionState.IDLE, MotionState.STOPPED, MotionState.ABORTED})
"""States in which the axis has no commander: guidance lands the drone unless a new goal commands it."""
SILENCE_LIMIT = 2.0
"""Time without a report, or without one that names the goal, after which the goal fails [s]."""
VERDICT_PATIENCE = 1.0
"""Longest wait for the resource manager to end a goal that has lost its authority [s]. Its verdict takes some
milliseconds."""
CAUSE_PATIENCE = 0.5
"""Longest wait for the change that ended the view of a motion [s]: its step may come after the report, or get lost."""
ENDED_EARLY = frozenset({MotionState.BLOCKED, MotionState.ABORTED})
"""States of a motion that did not get to its end. The timeline gets their reason."""
SUBJECT = "guidance"
"""Subject of the timeline records about motions that end early."""
UNDER_WAY = 0.15
"""Longest delay of a report: shortly after a new motion, reports can still be about the previous one [s]."""


class Axis(StrEnum):
    """Axis that a skill commands and reads the state of."""

    BODY = "body"
    HEADING = "heading"


class GuidanceClient:
    """Client of guidance for the manager of one skill. It asks `fl/guidance/command` itself, without the bridge.

    `on_report` gets each report about the current goal's motion, while it flies and while it stops. The client fails
    the goal if guidance refuses the motion, does not answer, or drops it. It confirms an interruption when guidance
    reports that the drone is at rest.

    A motion that is ABORTED because the authority is lost is reported after `VERDICT_PATIENCE` only. The resource
    manager ends such a goal (`RI`), but guidance may hear of the pilot before it, and a drone at rest aborts at once.

    view: observes the depth map while the goal flies. Its loss is the cause of a motion that ends for want of a view.
    While it is unknown, the report of such an end waits for `CAUSE_PATIENCE`.
    record: timeline record of the reason for which the goal's motion ended early; None if it did not. why: that reason
    in words, empty if guidance gave none.
    """

    def __init__(
        self,
        hooks: SkillHooks[Any, Any, Any],
        axis: Axis,
        on_report: Callable[[Goal[Any], AxisStatus], None],
        view: ViewLoss | None = None,
    ) -> None:
        self._view = view
        self._hooks, self._bus, self._axis, self._on_report = hooks, hooks.bus, axis, on_report
        self._status = Latest(hooks.bus, GUIDANCE_STATUS, GuidanceStatus, self._receive, at_rest=True)
        self._goal: Goal[Any] | None = None
        self._command: SentCommand | None = None
        self._watchdog: Handle | None = None
        self._accepted_at: float | None = None
        self._named_at = 0.0
        self._stopping = False
        self._given_back = False
        self._timeline = Timeline(hooks.bus, KEYS)
        self._ended_at: float | None = None
        self.record: str | None = None
        self.why = ""

    @property
    def remaining(self) -> float | None:
        """Rest of the motion [m; rad for the heading]; None while it is unknown."""
        axis = self._axis_status()
        return axis.remaining if axis is not None and self._goal is not None and axis.goal_id == self._goal.id else None

    @property
    def laps_done(self) -> float | None:
        """Laps flown of the goal's orbit; None while they are unknown."""
        status = self._status.value
        if status is None or self._goal is None or status.body.goal_id != self._goal.id:
            return None
        return status.laps_done

    @property
    def free_distance(self) -> float | None:
        """Free metres on the way to the target; None while they are unknown."""
        return None if self._status.value is None else self._status.value.free_distance

    def fly(self, goal: Goal[Any], motion: Motion, on_refused: Callable[[str], None] | None = None) -> None:
        """Start a motion for the goal, in place of the goal's earlier one.

        on_refused: called with the reason of a refusal, instead of failing the goal.
        """
        self._forget()
        self._goal = goal
        self._status.follow()
        if self._view is not None:
            self._view.follow()
        self._named_at = self._bus.now()
        self._watchdog = self._bus.every(SILENCE_LIMIT / 4, self._watch)
        self._send(goal, motion, self._accepted, on_refused or self._refused)

    def stop(self, goal: Goal[Any]) -> None:
        """Brake, and confirm the goal's interruption once the drone is at rest."""
        if self._goal is None or self._goal.id != goal.id:
            self._hooks.interrupted(goal.id)
            return
        self._stopping = True
        self._accepted_at = None
        # A refusal means that guidance does not fly for this goal; its reports show when the axis is at rest.
        self._send(goal, Stop(), self._accepted, lambda _: self._accepted())

    def release(self, goal: Goal[Any]) -> None:
        """Stop the goal's motion at its end, and give the axis back to guidance."""
        if self._goal is None or self._goal.id != goal.id:
            return
        given_back = self._given_back
        self._forget()
        self._status.rest()
        if self._view is not None:
            self._view.rest()
        if given_back:
            return
        # Not cancelled by the next goal: its command has a newer token, so guidance refuses this one after it.
        send_command(self._bus, GUIDANCE_COMMAND, GuidanceCommand(goal_id=goal.id, token=goal.token, motion=Stop()))

    def _send(
        self, goal: Goal[Any], motion: Motion, on_accepted: Callable[[], None], on_refused: Callable[[str], None]
    ) -> None:
        if self._command is not None:
            self._command.cancel()
        self._command = send_command(
            self._bus,
            GUIDANCE_COMMAND,
            GuidanceCommand(goal_id=goal.id, token=goal.token, motion=motion),
            on_accepted=on_accepted,
            on_refused=on_refused,
            on_silence=lambda: self._fail("Guidance does not answer. Check that its process runs."),
        )

    def _accepted(self) -> None:
        self._accepted_at = self._named_at = self._bus.now()

    def _refused(self, sentence: str) -> None:
        self._given_back = True
        self._fail(f"Guidance refused the motion. {sentence}")

    def _receive(self, status: GuidanceStatus) -> None:
        goal, accepted_at = self._goal, self._accepted_at
        if goal is None or accepted_at is None or status.t < accepted_at + UNDER_WAY:
            return
        axis = status.body if self._axis is Axis.BODY else status.heading
        if axis.goal_id == goal.id:
            self._named_at = self._bus.now()
            self._given_back = axis.state in GIVEN_BACK
            if self._stopping and axis.state is MotionState.STOPPED:
                self._hooks.interrupted(goal.id)
            elif not (self._may_get_verdict(axis) or self._may_get_cause(axis)):
                self._report(goal, axis)
        elif self._stopping and axis.state in AT_REST:
            self._given_back = True
            self._hooks.interrupted(goal.id)

    def _may_get_verdict(self, axis: AxisStatus) -> bool:
        """True while the end of a goal without authority is left to the resource manager."""
        return axis.state is MotionState.ABORTED and axis.authority_lost and self._may_wait(VERDICT_PATIENCE)

    def _may_get_cause(self, axis: AxisStatus) -> bool:
        """True while the change that ended the view may still come."""
        if not axis.no_view or self._view is None or self._view.record is not None:
            return False
        self._view.recall()
        return self._may_wait(CAUSE_PATIENCE)

    def _may_wait(self, patience: float) -> bool:
        """True for `patience` seconds from the first report of a motion's end on."""
        now = self._bus.now()
        self._ended_at = now if self._ended_at is None else self._ended_at
        return now - self._ended_at < patience

    def _report(self, goal: Goal[Any], axis: AxisStatus) -> None:
        if axis.state in ENDED_EARLY and self.record is None:
            self.why = axis.text
            cause = self._view.record if self._view is not None and axis.no_view else None
            self.record = self._timeline.record(
                RecordKind.HEALTH, SUBJECT, None, axis.state, text=axis.text, cause=cause, goal_id=goal.id
            )
        self._on_report(goal, axis)

    def _watch(self) -> None:
        """Fail the goal if there are no reports, or none about it."""
        if self._bus.now() - self._named_at < SILENCE_LIMIT:
            return
        if not self._status.is_fresh(SILENCE_LIMIT):
            self._fail(f"Guidance has not reported for {SILENCE_LIMIT:g} s. Check that its process runs.")
        elif self._accepted_at is not None:
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
        self._ended_at = self.record = None
        self.why = ""
        self._goal = self._command = self._watchdog = self._accepted_at = None
        self._stopping = self._given_back = False
