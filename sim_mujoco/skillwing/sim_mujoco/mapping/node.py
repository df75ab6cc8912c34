"""Mapping as a process: LiDAR scans and poses in, a voxel map out."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np

from skillwing.services.bus import Bus, Publisher, Request
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import ErrorCode, ErrorReply, ProtocolError, decode, encode
from skillwing.sim_mujoco import topics
from skillwing.sim_mujoco.axis import Axis
from skillwing.sim_mujoco.frames.pose_history import PoseHistory
from skillwing.sim_mujoco.mapping.mapper import REACH, Mapper
from skillwing.sim_mujoco.mapping.occupancy import OccupancyGrid, Voxels, grid_shape
from skillwing.sim_mujoco.messaging import answer_with, stream_reader
from skillwing.sim_mujoco.options import OptionsError
from skillwing.sim_mujoco.sensors.scans import LidarScan

POSE_SOURCE = "simulated navigation solution (true pose + noise)"
STATUS_PERIOD, MAP_PERIOD = 0.5, 1.0
_LARGEST = 64_000_000


class MappingNode:
    """Shell around a `Mapper`. Publishes what has become occupied, or all of it once voxels were found free again."""

    name = "mapping"
    owns_clock = False

    def __init__(self, mapper: Mapper) -> None:
        self._mapper = mapper
        self._holder = Axis("map")
        self._poses = PoseHistory()
        self._waiting: LidarScan | None = None
        self._published: Voxels = np.empty(0, dtype=np.int64)
        self._bus: Bus | None = None
        self._status: Publisher | None = None
        self._map: Publisher | None = None

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._status = bus.advertise(topics.MAPPING_STATUS)
        self._map = bus.advertise(topics.MAP)
        bus.subscribe(topics.NAVIGATION, message_reader(topics.Navigation, self._on_navigation))
        bus.subscribe(topics.LIDAR, stream_reader(LidarScan.decode, self._on_scan), latest_only=True)
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
            holder.take(command.goal_id, command.token)
            self._mapper.start()
            return "mapping"
        if holder.goal == command.goal_id:
            self._release()
            return "stopped; the map is kept"
        return "this goal does not hold the map; nothing to stop"

    def _on_revoked(self, revoked: topics.Revoked) -> None:
        if self._holder.revoke(revoked.goal_id, revoked.token):
            self._release()

    def _release(self) -> None:
        self._holder.goal = None
        self._mapper.stop()

    # --- what it maps ----------------------------------------------------------------------------------------

    def _on_navigation(self, navigation: topics.Navigation) -> None:
        self._poses.add(navigation)
        self._place_scan()

    def _on_scan(self, scan: LidarScan) -> None:
        self._waiting = scan
        self._place_scan()

    def _place_scan(self) -> None:
        """A scan waits until the drone's pose is known up to its end."""
        scan = self._waiting
        if scan is None or not self._poses.covers(*scan.span):
            return
        self._waiting = None
        if self._mapper.running:
            self._mapper.add(scan.place(self._poses, REACH))

    # --- what it says ----------------------------------------------------------------------------------------

    def _publish_status(self) -> None:
        assert self._bus is not None
        assert self._status is not None
        mapper = self._mapper
        status = topics.MappingStatus(
            t=self._bus.now(),
            running=mapper.running,
            diverged=mapper.diverged,
            scans=mapper.scans,
            voxels=len(mapper.grid.occupied()),
            pose_source=POSE_SOURCE,
        )
        self._status.put(encode(status))

    def _publish_map(self) -> None:
        assert self._map is not None
        grid = self._mapper.grid
        change = grid.changed_since(self._published)
        if not len(change.appeared) and not len(change.vanished):
            return
        self._published = grid.occupied()
        complete = len(change.vanished) > 0
        self._map.put(*self._encoded(self._published if complete else change.appeared, complete=complete))

    def _on_snapshot(self, request: Request) -> None:
        try:
            decode(request.payload, topics.Empty)
        except ProtocolError as error:
            request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=str(error), help="send an empty message"))
            return
        request.reply(*self._encoded(self._mapper.grid.occupied(), complete=True))

    def _encoded(self, voxels: Voxels, *, complete: bool) -> tuple[bytes, bytes]:
        assert self._bus is not None
        grid = self._mapper.grid
        header = topics.MapHeader(t=self._bus.now(), voxel_size=grid.size, count=len(voxels), complete=complete)
        return grid.centres(voxels).tobytes(), encode(header)


class MappingOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of `make_mapping`: the corners of the box that is mapped, and the size of its voxels [m].

    The box is the courtyard and what can be seen from there.
    """

    low: topics.Vector3 = (-50.0, -50.0, -8.0)
    high: topics.Vector3 = (80.0, 70.0, 24.0)
    voxel_size: float = 0.4


def make_mapping(options: dict[str, Any]) -> MappingNode:
    """The mapping node. Raises OptionsError."""
    try:
        wanted = msgspec.convert(options, MappingOptions)
        shape = grid_shape(wanted.low, wanted.high, wanted.voxel_size)
    except ValueError as error:
        raise OptionsError(
            f"these options do not fit the mapping node: {error}; known are low, high and voxel_size"
        ) from error
    if (count := shape[0] * shape[1] * shape[2]) > _LARGEST:
        raise OptionsError(f"a map of {count} voxels does not fit into memory; choose a smaller box or larger voxels")
    return MappingNode(Mapper(OccupancyGrid(wanted.low, wanted.high, wanted.voxel_size)))
