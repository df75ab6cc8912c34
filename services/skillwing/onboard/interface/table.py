"""Every topic of the functional layer, by its section of the page.

The modules of `onboard.topics` have keys, messages and rows. `functional-layer.md.template` explains each topic that a
process uses.
"""

from __future__ import annotations

from skillwing.onboard.topics import (
    faults,
    flight,
    guidance,
    link,
    mapping,
    navigation,
    obstacles,
    odometry,
    sensors,
    truth,
    video,
)
from skillwing.onboard.topics.processes import VEHICLE
from skillwing.onboard.topics.rows import stream
from skillwing.services.protocol import CLOCK_KEY, ClockTick
from skillwing.services.wire.channel import EVERYBODY, Channel, Duty

CLOCK = stream(
    CLOCK_KEY, ClockTick, VEHICLE, EVERYBODY, Duty.SOME, 6.25, when="at up to 50 Hz while the pace is not kept"
)
PLACES: dict[str, tuple[Channel, ...]] = {
    "flying": (*navigation.TOPICS, *flight.TOPICS, CLOCK),
    "sensors": sensors.TOPICS,
    "commanding": guidance.TOPICS,
    "seeing": (*obstacles.TOPICS, *mapping.TOPICS, *odometry.TOPICS),
    "streaming": (*video.TOPICS, *link.TOPICS),
    "trying": (*truth.TOPICS, *faults.TOPICS),
}
TOPICS: tuple[Channel, ...] = tuple(topic for topics in PLACES.values() for topic in topics)
