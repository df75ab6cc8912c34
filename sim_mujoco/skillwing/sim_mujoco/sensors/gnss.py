"""Satellite receiver: position, velocity and heading at 10 Hz, 0.1 s late.

Two antennas give the heading, as moving-base pairs of RTK receivers do. Position errors wander slowly (a first-order
Gauss-Markov process: multipath, atmosphere, geometry) with a little jitter on top. Antennas sit at the body's centre: a
receiver's own lever arms are known to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion, heading_of
from skillwing.onboard.topics.common import LARGEST_COMPONENT

PERIOD, DELAY = 0.1, 0.1
FARTHEST = 10_000.0
"""No fix can be farther from the home pad [m]."""
LARGEST_ERROR = 0.1 * LARGEST_COMPONENT
"""Noise and bias of a fault are no larger, so that both together, and navigation that believes them, stay within what a
message holds [m]."""


@dataclass(frozen=True, slots=True)
class Receiver:
    """A class of receivers. Standard deviations of what it gives, and what a navigator may ask of it.

    `level` and `height` [m] are how far the position wanders, within about `correlation` seconds; `jitter` [m], `speed`
    [m/s] and `heading` [rad] are white. Navigation with it is `trusted` up to that horizontal uncertainty [m].
    """

    level: float
    height: float
    correlation: float
    jitter: float
    speed: float
    heading: float
    trusted: float


ReceiverName: TypeAlias = Literal["rtk", "standalone"]
RECEIVERS: dict[ReceiverName, Receiver] = {
    "rtk": Receiver(0.02, 0.03, 30.0, 0.005, 0.03, math.radians(0.2), 1.0),
    "standalone": Receiver(1.0, 1.8, 100.0, 0.1, 0.08, math.radians(0.5), 4.0),
}
"""With fixed carrier-phase ambiguities (makers promise 1 cm + 1 ppm), and without corrections (1.5 to 2.5 m)."""


def receiver_class(name: str) -> Receiver:
    """The class of that name. Raises ValueError, which says what is known."""
    if name not in RECEIVERS:
        raise ValueError(f"there is no class of receivers {name!r}; choose one of {', '.join(RECEIVERS)}")
    return RECEIVERS[name]


class Gnss:
    """One receiver."""

    def __init__(self, receiver: Receiver, rng: np.random.Generator) -> None:
        self._receiver, self._rng = receiver, rng
        self._spread = np.array([receiver.level, receiver.level, receiver.height])
        self._keep = math.exp(-PERIOD / receiver.correlation)
        self._wander = self._spread * rng.standard_normal(3)

    def measure(self, motion: Motion) -> NDArray[np.float32]:
        """Position (3) [m], velocity (3) [m/s], heading [rad]: (7,)."""
        draws = self._rng.standard_normal(10)
        self._wander = self._keep * self._wander + math.sqrt(1.0 - self._keep**2) * self._spread * draws[:3]
        position = motion.position + self._wander + self._receiver.jitter * draws[3:6]
        velocity = motion.velocity + self._receiver.speed * draws[6:9]
        heading = heading_of(motion.quaternion) + self._receiver.heading * draws[9]
        return np.array([*position, *velocity, heading], dtype=np.float32)
