"""The vehicle's navigation solution."""

from __future__ import annotations

from skillwing.onboard.topics.common import Quaternion, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GUIDANCE, MAPPING, OBSTACLES, RECORDER, SKILLS, VEHICLE
from skillwing.onboard.topics.rows import stream
from skillwing.services.protocol import Message, Time
from skillwing.services.wire.channel import Channel, Duty

NAVIGATION = "fl/navigation"


class Navigation(Message, frozen=True, kw_only=True):
    """Navigation solution at `t`: position and velocity ENU, attitude as quaternion (w, x, y, z) body to world,
    angular velocity FLU, heading in radians.

    `sigma` and `height_sigma` are the standard deviations of the position, level and in height [m]. While `valid` is
    False, position and velocity are dead reckoning that has drifted too far for flight; the attitude is still good."""

    t: Time
    position: Vector3
    velocity: Vector3
    quaternion: Quaternion
    angular_velocity: Vector3
    heading: float
    valid: bool = True
    sigma: float = 0.0
    height_sigma: float = 0.0


TOPICS: tuple[Channel, ...] = (
    stream(
        NAVIGATION, Navigation, VEHICLE, (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, SKILLS, RECORDER), Duty.MUST, rate=50.0
    ),
)
