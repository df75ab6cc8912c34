"""The functional layer's telemetry as the skillset's data."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from skillwing.dsl.model import Skillset
from skillwing.m600.latest import Latest, M
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.flight import BATTERY, Battery
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.onboard.topics.mapping import MAP, MAPPING_STATUS, MapHeader, MappingStatus
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.onboard.topics.obstacles import OBSTACLE_STATUS, ObstacleStatus
from skillwing.onboard.topics.video import VIDEO_STATUS, VideoStatus
from skillwing.services.bus import Bus, Sample
from skillwing.services.protocol import DataSample, Keys, ProtocolError, decode, encode

_log = logging.getLogger(__name__)
DEFAULT_PERIOD = 1.0
"""Period of data for which the model promises none [s]."""


@dataclass(frozen=True, slots=True)
class Stamped:
    """A value and the robot time of its measurement."""

    value: Any
    t: float


def position(navigation: Navigation) -> Stamped:
    return Stamped(_xyz(navigation.position), navigation.t)


def velocity(navigation: Navigation) -> Stamped:
    return Stamped(_xyz(navigation.velocity), navigation.t)


def heading(navigation: Navigation) -> Stamped:
    return Stamped(navigation.heading, navigation.t)


def battery(message: Battery) -> Stamped:
    return Stamped(message.percent, message.t)


def obstacle_distance(status: ObstacleStatus) -> Stamped | None:
    """Free distance on the way to the target; without a target, distance of the next obstacle; None if unknown."""
    distance = status.free_distance if status.free_distance is not None else status.ahead
    return None if distance is None or status.stamp is None else Stamped(distance, status.stamp)


def link_bandwidth(status: LinkStatus) -> Stamped:
    return Stamped(status.bandwidth / 1e6, status.t)


def video_quality(status: VideoStatus) -> Stamped | None:
    """Quality of pictures on the ground; None while there are none."""
    return None if status.quality is None else Stamped(status.quality, status.t)


class MapFeed:
    """Statistics of the map; the size of a voxel comes with the map itself."""

    def __init__(self, bus: Bus) -> None:
        self._status = Latest(bus, MAPPING_STATUS, MappingStatus)
        self._voxel_size: float | None = None
        bus.subscribe(MAP, self._on_map, latest_only=True)

    def read(self) -> Stamped | None:
        status = self._status.value
        if status is None or self._voxel_size is None:
            return None
        volume = status.voxels * self._voxel_size**3
        return Stamped({"voxels": status.voxels, "volume": volume, "scans": status.scans}, status.t)

    def _on_map(self, sample: Sample) -> None:
        try:
            self._voxel_size = decode(sample.attachment, MapHeader).voxel_size
        except ProtocolError as error:
            _log.warning("dropped a map on %s: %s", sample.key, error)


class Telemetry:
    """Publisher of the skillset's data that the functional layer provides, at each datum's promised period.

    It publishes a measurement once, so that data without new measurements become stale at their readers.
    """

    def __init__(self, bus: Bus, skillset: Skillset) -> None:
        navigation = Latest(bus, NAVIGATION, Navigation)
        self._sources: dict[str, Callable[[], Stamped | None]] = {
            "position": partial(_read, navigation, position),
            "velocity": partial(_read, navigation, velocity),
            "heading": partial(_read, navigation, heading),
            "battery": partial(_read, Latest(bus, BATTERY, Battery), battery),
            "obstacle_distance": partial(_read, Latest(bus, OBSTACLE_STATUS, ObstacleStatus), obstacle_distance),
            "link_bandwidth": partial(_read, Latest(bus, LINK_STATUS, LinkStatus), link_bandwidth),
            "video_quality": partial(_read, Latest(bus, VIDEO_STATUS, VideoStatus), video_quality),
            "map_statistics": MapFeed(bus).read,
        }
        self._published_at: dict[str, float] = {}
        keys = Keys(skillset.name)
        for item in skillset.data:
            if item.name in self._sources:
                publisher = bus.advertise(keys.data(item.name))
                bus.every(item.period or DEFAULT_PERIOD, partial(self._publish, item.name, publisher.put))

    def _publish(self, name: str, put: Callable[[bytes], None]) -> None:
        reading = self._sources[name]()
        if reading is None or reading.t <= self._published_at.get(name, float("-inf")):
            return
        self._published_at[name] = reading.t
        put(encode(DataSample(name=name, value=reading.value, t=reading.t)))


def _read(latest: Latest[M], translate: Callable[[M], Stamped | None]) -> Stamped | None:
    return None if latest.value is None else translate(latest.value)


def _xyz(vector: Vector3) -> dict[str, float]:
    x, y, z = vector
    return {"x": x, "y": y, "z": z}
