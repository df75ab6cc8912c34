"""All topics of the functional layer, by the place in which somebody else may stand."""

from __future__ import annotations

from skillwing.sim_mujoco.interface.flying import COMMANDING
from skillwing.sim_mujoco.interface.live_video import STREAMING
from skillwing.sim_mujoco.interface.perception import SEEING
from skillwing.sim_mujoco.interface.topic import Topic
from skillwing.sim_mujoco.interface.trials import TRYING
from skillwing.sim_mujoco.interface.vehicle import FLYING, SENSORS

PLACES: dict[str, tuple[Topic, ...]] = {
    "The vehicle": FLYING,
    "The vehicle's sensors": SENSORS,
    "Guidance": COMMANDING,
    "Obstacles and map": SEEING,
    "Live video and link": STREAMING,
    "For trials": TRYING,
}
TOPICS: tuple[Topic, ...] = tuple(topic for topics in PLACES.values() for topic in topics)
