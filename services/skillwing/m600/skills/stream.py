"""The manager of `stream`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractStreamManager
from skillwing.m600.generated.types import StreamFeedback, StreamInputs
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.link_trouble import LinkTrouble
from skillwing.m600.skills.switch import Switch
from skillwing.m600.skills.timers import LeakyTimer
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.onboard.topics.video import (
    VIDEO_COMMAND,
    VIDEO_ENCODER,
    VIDEO_STATUS,
    ControlVideo,
    EncoderStatus,
    VideoStatus,
)
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import RecordKind, ResourceStep, Terminal
from skillwing.services.timeline import Timeline

MOST_FPS = 25.0
"""Highest rate that a goal may demand: the camera takes 30 pictures a second, and some are late or lost."""
START_TIME = 3.0
"""Time for a stream to begin before its quality counts [s]."""
TOLERANCE = 4.0
"""Limit of the leaky timer of time below the demands [s]."""
REPORT_LIMIT = 1.5
"""Largest age of the ground's report, which comes over the link four times a second [s]."""
PATIENCE = 4.0
"""Time without a status after which the goal fails [s]."""
CHECK_PERIOD = 0.25
LINK = "link_status"
VIDEO = "video"
"""Subject of the timeline record about a video that does not meet the demands."""


class StreamManager(AbstractStreamManager):
    """Live video by the video process, checked against the ground's reports: both demands have to be met at once.

    The video process adapts its rates to meet them; this manager decides when to give up.
    """

    def setup(self) -> None:
        self._video = Switch(self, VIDEO_COMMAND, _control, node="video process")
        self._ground = Latest(self.bus, VIDEO_STATUS, VideoStatus, at_rest=True)
        self._encoder = Latest(self.bus, VIDEO_ENCODER, EncoderStatus, at_rest=True)
        self._modem = Latest(self.bus, LINK_STATUS, LinkStatus, at_rest=True)
        self._steps = Latest(self.bus, KEYS.resource_steps, ResourceStep, self._note_link, events=True, at_rest=True)
        self._trouble = LinkTrouble()
        self._timeline = Timeline(self.bus, KEYS)
        self._bad_since: float | None = None
        self._watch: Handle | None = None

    def validate(self, goal: Goal[StreamInputs]) -> str | None:
        if goal.inputs.min_fps > MOST_FPS:
            return f"The camera cannot promise {goal.inputs.min_fps:g} pictures a second. Ask for up to {MOST_FPS:g}."
        return None

    def on_dispatch(self, goal: Goal[StreamInputs]) -> None:
        self._ground.follow()
        self._encoder.follow()
        self._modem.follow()
        self._steps.follow()
        self._bad_since = None
        begun = self.bus.now()
        timer = LeakyTimer(begun + START_TIME)
        self._watch = self.bus.every(CHECK_PERIOD, lambda: self._check(goal, begun, timer))
        self._video.on(goal)

    def progress(self, goal: Goal[StreamInputs]) -> StreamFeedback | None:
        seen = self._seen(goal)
        if seen is None:
            return None
        return StreamFeedback(fps=seen.fps, quality=seen.quality or 0.0, bitrate=seen.bitrate / 1e6)

    def on_interrupt(self, goal: Goal[StreamInputs]) -> None:
        self._video.off(goal)

    def on_ended(self, goal: Goal[StreamInputs], terminal: Terminal) -> None:
        if self._watch is not None:
            self._watch.cancel()
        self._ground.rest()
        self._encoder.rest()
        self._modem.rest()
        self._steps.rest()
        self._video.release(goal)

    def _seen(self, goal: Goal[StreamInputs]) -> VideoStatus | None:
        """The ground's report about this goal's stream; None without a fresh one."""
        status = self._ground.value
        is_known = status is not None and status.stream == goal.id and self._ground.is_fresh(REPORT_LIMIT)
        return status if is_known else None

    def _check(self, goal: Goal[StreamInputs], begun: float, timer: LeakyTimer) -> None:
        now = self.bus.now()
        if now - begun >= PATIENCE and not self._encoder.is_fresh(PATIENCE):
            self.failed(goal.id, f"The video process has not reported for {PATIENCE:g} s. Check that it runs.")
            return
        seen = self._seen(goal)
        good = (
            seen is not None
            and seen.quality is not None
            and seen.fps >= goal.inputs.min_fps
            and seen.quality >= goal.inputs.min_quality
        )
        total = timer.observe(now, good=good)
        self._bad_since = (self._bad_since or now) if total > 0.0 else None
        if total >= TOLERANCE:
            figures = _figures(goal.inputs, seen)
            self.terminated_FPS_LOST(goal.id, cause=self._record_bad_video(goal, figures), why=figures)

    def _note_link(self, step: ResourceStep) -> None:
        for change in step.changes:
            if change.subject == LINK:
                self._trouble.note(change)

    def _record_bad_video(self, goal: Goal[StreamInputs], figures: str) -> str:
        """Record the measured figures. Their cause is the link's change, else a simulated fault of the link, else none.

        The record keeps the chain true: the link may be too slow without a change of `link_status`, or before it.
        """
        modem = self._modem.value
        fault = None if modem is None else modem.fault
        cause = self._trouble.cause_of_trouble(self._bad_since or self.bus.now()) or fault
        return self._timeline.record(RecordKind.HEALTH, VIDEO, None, "BAD", text=figures, cause=cause, goal_id=goal.id)


def _figures(wanted: StreamInputs, seen: VideoStatus | None) -> str:
    if seen is None:
        return f"no report of the ground for {REPORT_LIMIT:g} s"
    quality = "no picture" if seen.quality is None else f"quality {seen.quality:.2f} of {wanted.min_quality:g}"
    return (
        f"{seen.fps:.1f} of {wanted.min_fps:g} pictures a second, {quality}, {seen.bitrate / 1e6:.2f} Mbit/s received"
    )


def _control(goal: Goal[StreamInputs], on: bool) -> ControlVideo:
    return ControlVideo(
        goal_id=goal.id,
        token=goal.token,
        run=on,
        min_fps=goal.inputs.min_fps,
        min_quality=goal.inputs.min_quality,
    )
