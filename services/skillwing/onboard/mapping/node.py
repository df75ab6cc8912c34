"""Odometry and map as a process: scans and inertial measurements in, poses and a voxel map out.

Odometry runs as long as the process, so that it is initialised on the ground; mapping is switched on and off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import numpy as np

from skillwing.onboard.commands.authority import CommandAuthority
from skillwing.onboard.commands.service import answer_with, read_question
from skillwing.onboard.frames.extent import Box
from skillwing.onboard.frames.vectors import Vector, add, subtract
from skillwing.onboard.mapping.localiser import ByNavigation, ByOdometry, Localiser, Placement
from skillwing.onboard.mapping.mapper import Mapper
from skillwing.onboard.mapping.occupancy import OccupancyGrid, Voxels, grid_shape
from skillwing.onboard.odometry.gicp import MissingLibraryError, gicp_matcher
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.sensor_data.names import IMU, LIDAR
from skillwing.onboard.sensor_data.scans import LidarScan, measurement_reader
from skillwing.onboard.topics import common, guidance, mapping, odometry, sensors
from skillwing.onboard.topics.mapping import Poses
from skillwing.onboard.topics.navigation import NAVIGATION, Navigation
from skillwing.services.bus import Bus, Publisher, Request
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError, read_options
from skillwing.services.protocol import encode

S = TypeVar("S")

MAP_DIVERGED = "the scans no longer fit the map"
STATUS_PERIOD, MAP_PERIOD = 0.5, 1.0
_LARGEST = 64_000_000
VOXEL_SIZE = 0.4
"""Usual edge of a voxel [m]."""
BEYOND: Vector = (30.0, 30.0, 10.0)
"""Margin of odometry's box around that of the map, to each side [m]."""


class MappingNode:
    """Shell around a `Mapper`. It publishes newly occupied voxels, or all of them after some became free again."""

    name = "mapping"
    owns_clock = False

    def __init__(self, mapper: Mapper, localiser: Localiser) -> None:
        self._mapper, self._localiser = mapper, localiser
        self._holder = CommandAuthority("map")
        self._failed: dict[str, str] = {}
        """Sensors whose health is FAILED, with a sentence on the reason."""
        self._published: Voxels = np.empty(0, dtype=np.int64)
        self._bus: Bus | None = None
        self._status: Publisher | None = None
        self._map: Publisher | None = None
        self._odometry: Publisher | None = None

    @property
    def pose_source(self) -> str:
        """Source of the poses, in words."""
        return self._localiser.source

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._status = bus.advertise(mapping.MAPPING_STATUS)
        self._map = bus.advertise(mapping.MAP)
        self._odometry = bus.advertise(odometry.SLAM_ODOMETRY)
        bus.subscribe(NAVIGATION, message_reader(Navigation, self._on_navigation))
        inertial = self._unless_failed(IMU, self._localiser.imu)
        scans = self._unless_failed(LIDAR, self._localiser.scan)
        bus.subscribe(sensors.IMU, measurement_reader(Inertial.decode, inertial))
        bus.subscribe(sensors.LIDAR, measurement_reader(LidarScan.decode, scans), latest_only=True)
        for sensor in self._localiser.sensors:
            bus.subscribe(sensors.health_key(sensor), message_reader(sensors.Health, self._on_health), events=True)
        bus.subscribe(guidance.AUTHORITY, message_reader(guidance.Revoked, self._on_revoked), events=True)
        bus.serve(mapping.MAPPING_COMMAND, answer_with(mapping.ControlMapping, self._on_command))
        bus.serve(mapping.MAP_SNAPSHOT, self._on_snapshot)
        bus.every(STATUS_PERIOD, self._publish_status)
        bus.every(MAP_PERIOD, self._publish_map)

    def detach(self) -> None:
        """Do nothing: the map ends with this process."""

    # --- commands --------------------------------------------------------------------------------------------

    def _on_command(self, command: mapping.ControlMapping) -> str:
        holder = self._holder
        holder.require_fresh(command.goal_id, command.token)
        if command.run:
            return self._start(command)
        if holder.goal == command.goal_id:
            self._release()
            return "stopped; the map is kept"
        return "this goal does not hold the map; nothing to stop"

    def _start(self, command: mapping.ControlMapping) -> str:
        """Start mapping, after a divergence with new odometry and a new map; a repeated command changes nothing."""
        holder = self._holder
        is_new = holder.goal != command.goal_id
        holder.take(command.goal_id, command.token)
        self._mapper.start()
        if is_new and self._diverged:
            self._localiser.restart()
            self._mapper.renew()
            return "mapping, from an empty map"
        return "mapping"

    @property
    def _diverged(self) -> bool:
        return self._mapper.diverged or bool(self._localiser.lost)

    def _on_revoked(self, revoked: guidance.Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._release()

    def _release(self) -> None:
        self._holder.goal = None
        self._mapper.stop()

    # --- measurements ----------------------------------------------------------------------------------------

    def _on_navigation(self, navigation: Navigation) -> None:
        self._take(self._localiser.navigation(navigation))

    def _unless_failed(self, sensor: str, place: Callable[[S], Placement | None]) -> Callable[[S], None]:
        """A reader that drops measurements of a failed sensor; the localiser then treats them as missing."""

        def on_measurement(measurement: S) -> None:
            if sensor not in self._failed:
                self._take(place(measurement))

        return on_measurement

    def _on_health(self, health: sensors.Health) -> None:
        if health.status is sensors.SensorStatus.FAILED:
            self._failed[health.sensor] = f"{health.sensor} is FAILED: {health.reason or 'it does not say why'}"
        else:
            self._failed.pop(health.sensor, None)

    def _take(self, placement: Placement | None) -> None:
        if placement is None:
            return
        if placement.odometry is not None and self._odometry is not None:
            self._odometry.put(encode(placement.odometry))
        if placement.points is not None and not self._localiser.lost:
            self._mapper.add(placement.points)

    # --- publications ----------------------------------------------------------------------------------------

    def _publish_status(self) -> None:
        assert self._bus is not None
        assert self._status is not None
        mapper, localiser = self._mapper, self._localiser
        localiser.check(self._bus.now())
        status = mapping.MappingStatus(
            t=self._bus.now(),
            running=mapper.running,
            diverged=self._diverged,
            scans=mapper.scans,
            voxels=mapper.grid.count_occupied(),
            pose_source=self.pose_source,
            text=self._text,
        )
        self._status.put(encode(status))

    @property
    def _text(self) -> str:
        """Problems, or a reason to wait, the sensors first; empty in normal operation."""
        complaint = self._localiser.text or (MAP_DIVERGED if self._mapper.diverged else "")
        return "; ".join(filter(None, (*self._failed.values(), complaint)))

    def _publish_map(self) -> None:
        assert self._map is not None
        grid = self._mapper.grid
        change = grid.changed_since(self._published)
        if not len(change.appeared) and not len(change.vanished):
            return
        self._published = change.occupied
        complete = len(change.vanished) > 0
        self._map.put(*self._encoded(self._published if complete else change.appeared, complete=complete))

    def _on_snapshot(self, request: Request) -> None:
        if read_question(request, common.Empty) is not None:
            request.reply(*self._encoded(self._mapper.grid.occupied(), complete=True))

    def _encoded(self, voxels: Voxels, *, complete: bool) -> tuple[bytes, bytes]:
        assert self._bus is not None
        grid = self._mapper.grid
        header = mapping.MapHeader(t=self._bus.now(), voxel_size=grid.size, count=len(voxels), complete=complete)
        return grid.centres(voxels).tobytes(), encode(header)


class MappingOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_mapping`: corners of the mapped box, size of its voxels [m], and source of the poses."""

    low: common.Vector3
    high: common.Vector3
    voxel_size: float = VOXEL_SIZE
    poses: Poses = "odometry"


def make_mapping(options: dict[str, Any]) -> MappingNode:
    """The mapping node. Raises OptionsError."""
    wanted = read_options(options, MappingOptions)
    box = Box(wanted.low, wanted.high)
    try:
        shape = grid_shape(box.low, box.high, wanted.voxel_size)
    except ValueError as error:
        raise OptionsError(f"these options do not fit the mapping node: {error}") from error
    if (count := shape[0] * shape[1] * shape[2]) > _LARGEST:
        raise OptionsError(f"a map of {count} voxels does not fit into memory; choose a smaller box or larger voxels")
    mapper = Mapper(OccupancyGrid(box.low, box.high, wanted.voxel_size))
    return MappingNode(mapper, _localiser(wanted.poses, box))


def _localiser(poses: Poses, box: Box) -> Localiser:
    if poses == "navigation":
        return ByNavigation()
    low, high = subtract(box.low, BEYOND), add(box.high, BEYOND)
    if poses == "odometry":
        return ByOdometry(low, high)
    try:
        return ByOdometry(low, high, gicp_matcher(), "LiDAR-inertial odometry with small_gicp")
    except MissingLibraryError as error:
        raise OptionsError(str(error)) from error
