"""All topics of the functional layer, by the place in which somebody else may stand."""

from __future__ import annotations

from skillwing.onboard.interface.flying import COMMANDING
from skillwing.onboard.interface.live_video import STREAMING
from skillwing.onboard.interface.perception import SEEING
from skillwing.onboard.interface.topic import Topic
from skillwing.onboard.interface.trials import TRYING
from skillwing.onboard.interface.vehicle import FLYING, SENSORS

PLACES: dict[str, tuple[Topic, ...]] = {
    "The vehicle": FLYING,
    "The vehicle's sensors": SENSORS,
    "Guidance": COMMANDING,
    "Obstacles and map": SEEING,
    "Live video and link": STREAMING,
    "For trials": TRYING,
}
TOPICS: tuple[Topic, ...] = tuple(topic for topics in PLACES.values() for topic in topics)
