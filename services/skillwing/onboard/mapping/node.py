"""Odometry and map as a process: scans and inertial measurements in, poses and a voxel map out.

Odometry runs as long as the process, so that it has begun on the ground when a map is wanted in the air; mapping is
switched on and off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
import numpy as np

from skillwing.onboard import topics
from skillwing.onboard.axis import Axis
from skillwing.onboard.frames.vectors import Vector, add, subtract
from skillwing.onboard.geofence import Box
from skillwing.onboard.mapping.localiser import ByNavigation, ByOdometry, Localiser, Placement
from skillwing.onboard.mapping.mapper import Mapper
from skillwing.onboard.mapping.occupancy import OccupancyGrid, Voxels, grid_shape
from skillwing.onboard.messaging import answer_with, read_question, stream_reader
from skillwing.onboard.odometry.gicp import MissingLibraryError, gicp_matcher
from skillwing.onboard.odometry.inertial import Inertial
from skillwing.onboard.options import OptionsError, Poses, read_options
from skillwing.onboard.sensor_data.names import IMU, LIDAR
from skillwing.onboard.sensor_data.scans import LidarScan
from skillwing.services.bus import Bus, Publisher, Request
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import encode

S = TypeVar("S")

MISFITS = "the scans no longer fit the map"
STATUS_PERIOD, MAP_PERIOD = 0.5, 1.0
_LARGEST = 64_000_000
VOXEL_SIZE = 0.4
"""Usual edge of a voxel [m]."""
BEYOND: Vector = (30.0, 30.0, 10.0)
"""So much farther than the map odometry holds on to what it sees, to each side [m]."""


class MappingNode:
    """Shell around a `Mapper`. Publishes what has become occupied, or all of it once voxels were found free again."""

    name = "mapping"
    owns_clock = False

    def __init__(self, mapper: Mapper, localiser: Localiser) -> None:
        self._mapper, self._localiser = mapper, localiser
        self._holder = Axis("map")
        self._failed: dict[str, str] = {}
        """Sensors that do not believe themselves, and in what words they say so."""
        self._published: Voxels = np.empty(0, dtype=np.int64)
        self._bus: Bus | None = None
        self._status: Publisher | None = None
        self._map: Publisher | None = None
        self._odometry: Publisher | None = None

    @property
    def pose_source(self) -> str:
        """Where the poses come from, in words."""
        return self._localiser.source

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._status = bus.advertise(topics.MAPPING_STATUS)
        self._map = bus.advertise(topics.MAP)
        self._odometry = bus.advertise(topics.SLAM_ODOMETRY)
        bus.subscribe(topics.NAVIGATION, message_reader(topics.Navigation, self._on_navigation))
        inertial = self._unless_failed(IMU, self._localiser.imu)
        scans = self._unless_failed(LIDAR, self._localiser.scan)
        bus.subscribe(topics.IMU, stream_reader(Inertial.decode, inertial))
        bus.subscribe(topics.LIDAR, stream_reader(LidarScan.decode, scans), latest_only=True)
        for sensor in self._localiser.sensors:
            bus.subscribe(topics.health_key(sensor), message_reader(topics.Health, self._on_health), events=True)
        bus.subscribe(topics.AUTHORITY, message_reader(topics.Revoked, self._on_revoked), events=True)
        bus.serve(topics.MAPPING_COMMAND, answer_with(topics.ControlMapping, self._on_command))
        bus.serve(topics.MAP_SNAPSHOT, self._on_snapshot)
        bus.every(STATUS_PERIOD, self._publish_status)
        bus.every(MAP_PERIOD, self._publish_map)

    def detach(self) -> None:
        """The map lives as long as this process."""

    # --- who controls it -------------------------------------------------------------------------------------

    def _on_command(self, command: topics.ControlMapping) -> str:
        holder = self._holder
        holder.require_fresh(command.goal_id, command.token)
        if command.run:
            return self._start(command)
        if holder.goal == command.goal_id:
            self._release()
            return "stopped; the map is kept"
        return "this goal does not hold the map; nothing to stop"

    def _start(self, command: topics.ControlMapping) -> str:
        """A new goal after a divergence begins a new odometry and a new map; a repeated command changes nothing."""
        holder = self._holder
        is_new = holder.goal != command.goal_id
        holder.take(command.goal_id, command.token)
        self._mapper.start()
        if is_new and self._diverged:
            self._localiser.restart()
            self._mapper.renew()
            return "mapping anew"
        return "mapping"

    @property
    def _diverged(self) -> bool:
        return self._mapper.diverged or bool(self._localiser.lost)

    def _on_revoked(self, revoked: topics.Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._release()

    def _release(self) -> None:
        self._holder.goal = None
        self._mapper.stop()

    # --- what it maps ----------------------------------------------------------------------------------------

    def _on_navigation(self, navigation: topics.Navigation) -> None:
        self._take(self._localiser.navigation(navigation))

    def _unless_failed(self, sensor: str, place: Callable[[S], Placement | None]) -> Callable[[S], None]:
        """A reader that leaves out what a failed sensor makes up: to the localiser measurements are missing then."""

        def on_measurement(measurement: S) -> None:
            if sensor not in self._failed:
                self._take(place(measurement))

        return on_measurement

    def _on_health(self, health: topics.Health) -> None:
        if health.status is topics.SensorStatus.FAILED:
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

    # --- what it says ----------------------------------------------------------------------------------------

    def _publish_status(self) -> None:
        assert self._bus is not None
        assert self._status is not None
        mapper, localiser = self._mapper, self._localiser
        localiser.check(self._bus.now())
        status = topics.MappingStatus(
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
        """What is wrong or waited for, the sensors first; empty while all is well."""
        complaint = self._localiser.text or (MISFITS if self._mapper.diverged else "")
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
        if read_question(request, topics.Empty) is not None:
            request.reply(*self._encoded(self._mapper.grid.occupied(), complete=True))

    def _encoded(self, voxels: Voxels, *, complete: bool) -> tuple[bytes, bytes]:
        assert self._bus is not None
        grid = self._mapper.grid
        header = topics.MapHeader(t=self._bus.now(), voxel_size=grid.size, count=len(voxels), complete=complete)
        return grid.centres(voxels).tobytes(), encode(header)


class MappingOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_mapping`: corners of the mapped box, size of its voxels [m], and source of the poses."""

    low: topics.Vector3
    high: topics.Vector3
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
