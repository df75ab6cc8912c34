"""The heading: turns at a limited rate to where its holder wants the nose, and holds it there."""

from __future__ import annotations

from skillwing.onboard.commands.authority import Axis
from skillwing.onboard.frames.vectors import clamp, wrap
from skillwing.onboard.topics.guidance import MotionState

TURN_RATE = 0.6
"""[rad/s]"""
ALIGNED = 0.05
"""Largest error of a heading that counts as reached [rad]."""


class HeadingControl:
    """Slews the heading setpoint and tells when the nose is there."""

    def __init__(self) -> None:
        self.axis = Axis("heading")
        self.setpoint = 0.0
        self._target = 0.0
        self._error = 0.0

    @property
    def aligned(self) -> bool:
        """The nose points where it should."""
        return abs(self._error) < ALIGNED

    def settle(self, heading: float) -> None:
        """Forget all targets: from now on `heading` is held."""
        self.setpoint = self._target = heading
        self._error = 0.0

    def turn_to(self, heading: float, actual: float) -> None:
        self._target = wrap(heading)
        self._error = wrap(self._target - actual)
        self.axis.become(MotionState.TURNING)

    def follow(self, heading: float) -> None:
        """From now on the nose should be there, while the holder's motion goes on."""
        self._target = wrap(heading)

    def stop(self, state: MotionState, text: str = "") -> None:
        """Stop turning at once and hold what is reached."""
        self._target = self.setpoint
        self.axis.become(state, text)

    def give_up(self, why: str) -> None:
        """Nobody can point the nose any more: whoever turned it or held it is told so."""
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
