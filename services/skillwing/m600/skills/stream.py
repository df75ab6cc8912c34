"""The manager of `stream`."""

from __future__ import annotations

from skillwing.m600.generated.managers import AbstractStreamManager
from skillwing.m600.generated.types import StreamFeedback, StreamInputs
from skillwing.m600.keys import KEYS
from skillwing.m600.latest import Latest
from skillwing.m600.skills.shortfall import Shortfall
from skillwing.m600.skills.switch import Switch
from skillwing.onboard.topics import (
    VIDEO_COMMAND,
    VIDEO_ENCODER,
    VIDEO_STATUS,
    ControlVideo,
    EncoderStatus,
    VideoStatus,
)
from skillwing.services.bus import Handle
from skillwing.services.managers.skill_manager import Goal
from skillwing.services.protocol import ResourceChange, Terminal

MOST_FPS = 25.0
"""The camera takes 30 pictures a second, and some are late or lost."""
SETTLING = 3.0
"""A stream has this long to begin before it is judged [s]."""
TOLERANCE = 4.0
"""How much longer it may be worse than demanded than it was good since [s]."""
NEWS = 1.5
"""The ground's last report counts for so long; it comes over the link, four times a second [s]."""
PATIENCE = 4.0
"""Without a status for this long the video process is gone [s]."""
CHECK_PERIOD = 0.25
LINK = KEYS.resource("link_status")


class StreamManager(AbstractStreamManager):
    """Has the video process stream, and judges what the ground reports of it: both demands have to be met at once.

    How to meet them is the video process's business, which alone is fast enough for it; when to give up is decided
    here.
    """

    def setup(self) -> None:
        self._video = Switch(self, VIDEO_COMMAND, _control, node="video process")
        self._ground = Latest(self.bus, VIDEO_STATUS, VideoStatus, at_rest=True)
        self._encoder = Latest(self.bus, VIDEO_ENCODER, EncoderStatus, at_rest=True)
        self._link = Latest(self.bus, LINK, ResourceChange, events=True)
        self._watch: Handle | None = None

    def validate(self, goal: Goal[StreamInputs]) -> str | None:
        if goal.inputs.min_fps > MOST_FPS:
            return f"The camera cannot promise {goal.inputs.min_fps:g} pictures a second. Ask for up to {MOST_FPS:g}."
        return None

    def on_dispatch(self, goal: Goal[StreamInputs]) -> None:
        self._ground.follow()
        self._encoder.follow()
        begun = self.bus.now()
        shortfall = Shortfall(begun + SETTLING)
        self._watch = self.bus.every(CHECK_PERIOD, lambda: self._judge(goal, begun, shortfall))
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
        self._video.release(goal)

    def _seen(self, goal: Goal[StreamInputs]) -> VideoStatus | None:
        """What the ground says of this goal's stream; None where that is not known any more."""
        status = self._ground.value
        return status if status is not None and status.stream == goal.id and self._ground.is_fresh(NEWS) else None

    def _judge(self, goal: Goal[StreamInputs], begun: float, shortfall: Shortfall) -> None:
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
        if shortfall.observe(now, good=good) >= TOLERANCE:
            self.terminated_FPS_LOST(goal.id, cause=self._trouble)

    @property
    def _trouble(self) -> str | None:
        """The record of what became of the link, if it is not good now."""
        change = self._link.value
        return None if change is None or change.after == "GOOD" else change.record


def _control(goal: Goal[StreamInputs], on: bool) -> ControlVideo:
    return ControlVideo(
        goal_id=goal.id,
        token=goal.token,
        run=on,
        min_fps=goal.inputs.min_fps,
        min_quality=goal.inputs.min_quality,
    )
