"""Ground truth of a simulated vehicle."""

from __future__ import annotations

from skillwing.onboard.topics.common import Quaternion, Vector3
from skillwing.services.protocol import Message, Time

TRUTH = "fl/truth"  # Truth, 20 Hz: for judges and recordings only, never for the robot


class Truth(Message, frozen=True, kw_only=True):
    """Ground truth for judges: `clearance` is the distance of the blades' tips from the nearest obstacle, at `t`."""

    t: Time
    position: Vector3
    quaternion: Quaternion
    velocity: Vector3
    collisions: int
    clearance: float
    inside_fence: bool
