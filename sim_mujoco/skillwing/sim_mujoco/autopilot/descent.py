"""Descent: sink speed, vertical speed from the range-finder, and detection of touchdown."""

from __future__ import annotations

from dataclasses import dataclass

from skillwing.onboard.frames.vectors import Quaternion, Vector, axes, norm
from skillwing.onboard.sensor_data.directions import RANGE_MOUNT
from skillwing.sim_mujoco.physics.hexacopter import GEAR_HEIGHT

LANDING_SPEED, FAST_DESCENT, FLARE_HEIGHT = 0.7, 1.5, 5.0
"""Sink speed near the ground and high above it [m/s], and the range at which it changes [m]."""
STANDING_RANGE = GEAR_HEIGHT + RANGE_MOUNT[2]
"""Range that the range-finder measures when the drone stands [m]."""
_HURRIED_DESCENT, _HURRIED_LANDING, _FLARE = 3.0, 0.5, 0.45
"""Descent without a valid velocity: the fastest that the maker of the M600 allows and that at touchdown [m/s], and its
growth with the height [1/s]."""
_AT_REST = 0.25
_SEEN, _BLIND, _CONTRADICTED = 0.4, 1.5, 3.0
"""Time at rest that counts as touchdown: if the range-finder sees the ground at the skids, sees nothing, or
contradicts [s]."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """The autopilot's estimate of its motion.

    `ground` is the range-finder's distance [m], measured at `ground_at`; None without a range or with a failed sensor.
    Position and velocity are dead reckoning while they are not valid (`valid`, `velocity_valid`).
    """

    position: Vector
    velocity: Vector
    quaternion: Quaternion
    ground: float | None
    ground_at: float = 0.0
    valid: bool = True
    velocity_valid: bool = True


def sink_speed(ground: float | None, *, hurry: bool = False) -> float:
    """Sink speed [m/s] at a distance from the ground; None if that is unknown.

    `hurry` is for an unknown velocity, whose error grows with each second.
    """
    if hurry and ground is not None:
        return min(_HURRIED_LANDING + _FLARE * max(0.0, ground - STANDING_RANGE), _HURRIED_DESCENT)
    return FAST_DESCENT if ground is not None and ground > FLARE_HEIGHT else LANDING_SPEED


class GroundSpeed:
    """Height above the ground and its rate: an alpha-beta filter of the range-finder's measurements alone."""

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
            # A jump of the measured height is an edge below the drone, not a motion of the drone.
            self._height = height if abs(miss) > self._STEP else expected + self._ALPHA * miss
            self.climb += 0.0 if abs(miss) > self._STEP else self._BETA * miss / dt
        self._at = now.ground_at


class Touchdown:
    """Detector of touchdown: the drone is commanded to sink and stays at rest."""

    def __init__(self) -> None:
        self._since: float | None = None

    def reset(self) -> None:
        self._since = None

    def noticed(self, t: float, now: Estimate, velocity: Vector, *, sinking: bool, insisting: bool) -> bool:
        """The drone has landed, as of `t` and its `velocity`.

        sinking: it is commanded to go down. insisting: the target is so far below that no drone in the air would stay.
        With the ground in view at the skids, `sinking` is enough. Otherwise a drone in the air could be at rest a
        little above its target, so it takes `insisting`.
        """
        standing = now.ground is not None and now.ground < STANDING_RANGE + 0.08
        if not (sinking if standing else insisting) or norm(velocity) > _AT_REST:
            self._since = None
            return False
        if self._since is None:
            self._since = t
        wait = _SEEN if standing else _BLIND if now.ground is None else _CONTRADICTED
        return t - self._since >= wait
