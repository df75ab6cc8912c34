"""Ground truth of a simulated vehicle."""

from __future__ import annotations

from skillwing.onboard.topics.common import Quaternion, Vector3
from skillwing.onboard.topics.processes import LINK, RECORDER, VEHICLE
from skillwing.onboard.topics.rows import stream
from skillwing.services.protocol import Message, Time
from skillwing.services.wire.channel import Channel, Duty

TRUTH = "fl/truth"


class Truth(Message, frozen=True, kw_only=True):
    """Ground truth for judges: `clearance` is the distance of the blades' tips from the nearest obstacle, at `t`.

    `separation`: distance to the nearest other vehicle, tip to tip, at `t`; None for a vehicle that is alone."""

    t: Time
    position: Vector3
    quaternion: Quaternion
    velocity: Vector3
    collisions: int
    clearance: float
    inside_fence: bool
    separation: float | None = None


TOPICS: tuple[Channel, ...] = (stream(TRUTH, Truth, VEHICLE, (LINK, RECORDER), Duty.TRIALS, rate=20.0),)
