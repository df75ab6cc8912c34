"""Coming down and noticing the ground: sink speed, vertical speed from the range-finder, touchdown."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Quaternion, Vector, axes, norm
from skillwing.onboard.sensor_data.directions import RANGE_MOUNT
from skillwing.sim_mujoco.physics.hexacopter import GEAR_HEIGHT

LANDING_SPEED, FAST_DESCENT, FLARE_HEIGHT = 0.7, 1.5, 5.0
"""Sink speed near the ground and high above it [m/s], and the distance that the range-finder measures between [m]."""
STANDING_RANGE = GEAR_HEIGHT + RANGE_MOUNT[2]
"""What the range-finder measures when the drone stands [m]."""
_HURRIED_DESCENT, _HURRIED_LANDING, _FLARE = 3.0, 0.5, 0.45
"""In a hurry: the fastest descent that the maker of the M600 allows, the sink speed at touchdown [m/s], and how much
faster for each metre above it [1/s]."""
_AT_REST = 0.25
_SEEN, _BLIND, _CONTRADICTED = 0.4, 1.5, 3.0
"""How long the drone has to be at rest to have landed: with the ground in view at the skids, without a range-finder,
and against what it says [s]."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the autopilot knows of its motion.

    `ground` is the range-finder's distance [m], measured at `ground_at`; None if it sees none or cannot be trusted.
    `valid` and `velocity_valid` tell whether navigation vouches for the position and for the velocity; while it does
    not, they are dead reckoning.
    """

    position: Vector
    velocity: Vector
    quaternion: Quaternion
    ground: float | None
    ground_at: float = 0.0
    valid: bool = True
    velocity_valid: bool = True


def sink_speed(ground: float | None, *, hurry: bool = False) -> float:
    """How fast to come down [m/s] at a distance from the ground, if it is known.

    In a `hurry` it is a matter of seconds: the velocity that is not known grows with them.
    """
    if hurry and ground is not None:
        return min(_HURRIED_LANDING + _FLARE * max(0.0, ground - STANDING_RANGE), _HURRIED_DESCENT)
    return FAST_DESCENT if ground is not None and ground > FLARE_HEIGHT else LANDING_SPEED


class GroundSpeed:
    """Height above the ground and its rate, by an alpha-beta filter of the range-finder's measurements alone."""

    _ALPHA, _BETA, _STEP = 0.5, 0.2, 0.6

    def __init__(self) -> None:
        self._at: float | None = None
        self._height, self.climb = 0.0, 0.0
        """Rate of the height above the ground [m/s]."""

    def update(self, now: Estimate) -> None:
        """Take a measurement, if it is a new one."""
        if now.ground is None:
            self._at, self.climb = None, 0.0
            return
        height = now.ground * axes(now.quaternion)[2][2]
        dt = 0.0 if self._at is None else now.ground_at - self._at
        if self._at is None or dt > 0.5:
            self._height, self.climb = height, 0.0
        elif dt > 0.0:
            expected = self._height + self.climb * dt
            miss = height - expected
            # Ground that jumps is an edge below the drone, not a jump of the drone.
            self._height = height if abs(miss) > self._STEP else expected + self._ALPHA * miss
            self.climb += 0.0 if abs(miss) > self._STEP else self._BETA * miss / dt
        self._at = now.ground_at


class Touchdown:
    """Notices that the drone has landed: told to sink, it stays where it is."""

    def __init__(self) -> None:
        self._since: float | None = None

    def reset(self) -> None:
        self._since = None

    def noticed(self, t: float, now: Estimate, velocity: Vector, *, sinking: bool, insisting: bool) -> bool:
        """At `t`, moving with `velocity`; `sinking` if it was told to go down at all, `insisting` if so far down that
        no drone in the air would be where it is.

        The ground in view at the skids is proof enough with a word to sink. Without it, or against what the
        range-finder says, a drone in the air could be at rest a little above where it should be.
        """
        standing = now.ground is not None and now.ground < STANDING_RANGE + 0.08
        if not (sinking if standing else insisting) or norm(velocity) > _AT_REST:
            self._since = None
            return False
        if self._since is None:
            self._since = t
        wait = _SEEN if standing else _BLIND if now.ground is None else _CONTRADICTED
        return t - self._since >= wait
