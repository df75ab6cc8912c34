"""Heading control: turns at a limited rate to the holder's heading, and holds it."""

from __future__ import annotations

from skillwing.onboard.commands.authority import CommandAuthority
from skillwing.onboard.frames.vectors import clamp, wrap
from skillwing.onboard.topics.guidance import MotionState

TURN_RATE = 0.6
"""Rate of the heading setpoint [rad/s]."""
ALIGNED = 0.05
"""Largest error of a heading that counts as reached [rad]."""


class HeadingControl:
    """Control of the heading setpoint, and of the state of the heading axis."""

    def __init__(self) -> None:
        self.axis = CommandAuthority("heading")
        self.setpoint = 0.0
        self._target = 0.0
        self._error = 0.0

    @property
    def aligned(self) -> bool:
        """The heading is reached."""
        return abs(self._error) < ALIGNED

    def hold(self, heading: float) -> None:
        """Drop the target, and hold `heading` from now on."""
        self.setpoint = self._target = heading
        self._error = 0.0

    def turn_to(self, heading: float, actual: float) -> None:
        self._target = wrap(heading)
        self._error = wrap(self._target - actual)
        self.axis.become(MotionState.TURNING)

    def follow(self, heading: float) -> None:
        """Set the target during the holder's motion, without a new turn."""
        self._target = wrap(heading)

    def stop(self, state: MotionState, text: str = "") -> None:
        """Stop turning at once, and hold the heading reached."""
        self._target = self.setpoint
        self.axis.become(state, text)

    def give_up(self, why: str) -> None:
        """Abort the holder's turn or hold: the drone can no longer control its heading."""
        if self.axis.state in (MotionState.TURNING, MotionState.DONE):
            self.stop(MotionState.ABORTED, why)

    def advance(self, dt: float, actual: float) -> None:
        """Move the setpoint on by `dt` seconds; `actual` is the heading now."""
        step = TURN_RATE * dt
        self.setpoint = wrap(self.setpoint + clamp(wrap(self._target - self.setpoint), -step, step))
        self._error = wrap(self._target - actual)
        self.axis.remaining = abs(self._error)
        if self.axis.state is MotionState.TURNING and self.aligned:
            self.axis.become(MotionState.DONE)
