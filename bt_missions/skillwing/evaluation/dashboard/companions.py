"""Other drones of the same world in the dashboard: their positions, paths and maps, as they know them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import rerun as rr

from skillwing.evaluation.dashboard.drone_shape import draw_drone
from skillwing.evaluation.dashboard.geometry import Throttle, by_height
from skillwing.evaluation.dashboard.voxel_pieces import VoxelPieces
from skillwing.onboard.topics import common, mapping, navigation
from skillwing.services.bus import Bus, MultiRobotBus
from skillwing.services.bus.reading import message_reader, stream_reader
from skillwing.services.recording.mission_view import at

COLOUR = (255, 209, 102)
"""Colour of other drones' noses and paths, red, green and blue."""
PIECE_OF_PATH = 100
"""Number of points in a strip of a path."""


class Companion:
    """One other drone. Entities are in `world/ROBOT`. ceiling: height of the reddest voxel [m]."""

    def __init__(self, recording: rr.RecordingStream, robot: str, ceiling: float) -> None:
        self._recording = recording
        self._entity = f"world/{robot}"
        self._ceiling = ceiling
        self._path: list[common.Vector3] = []
        self._strips = 0
        self._voxels: VoxelPieces | None = None
        self._pose_due, self._path_due = Throttle(0.1), Throttle(0.2)

    def attach(self, bus: Bus) -> None:
        """bus: in the namespace of the other robot."""
        self.restate()
        navigate = message_reader(navigation.Navigation, self._on_navigation)
        bus.subscribe(navigation.NAVIGATION, navigate, latest_only=True)
        bus.subscribe(mapping.MAP, stream_reader(mapping.MapHeader, self._on_map))

    def restate(self) -> None:
        """Draw again what does not change, and the whole map: at the start and in each new part of the recording."""
        draw_drone(self._recording, f"{self._entity}/drone", COLOUR)
        if self._voxels is not None:
            self._draw_voxels(self._voxels, self._voxels.pieces)

    def _on_navigation(self, pose: navigation.Navigation) -> None:
        if not self._pose_due.due(pose.t):
            return
        at(self._recording, pose.t)
        w, x, y, z = pose.quaternion
        turn = rr.Quaternion(xyzw=(x, y, z, w))
        self._recording.log(f"{self._entity}/drone", rr.Transform3D(translation=pose.position, rotation=turn))
        if self._path_due.due(pose.t):
            self._extend_path(pose.position)

    def _extend_path(self, position: common.Vector3) -> None:
        self._path.append(position)
        strip = rr.LineStrips3D([self._path], colors=[COLOUR], radii=0.09)
        self._recording.log(f"{self._entity}/path/{self._strips:03}", strip)
        if len(self._path) >= PIECE_OF_PATH:
            self._path = self._path[-1:]
            self._strips += 1

    def _on_map(self, header: mapping.MapHeader, payload: bytes) -> None:
        at(self._recording, header.t)
        centres = np.frombuffer(payload, np.float32).reshape(-1, 3)
        if self._voxels is None:
            self._voxels = VoxelPieces(header.voxel_size)
        self._draw_voxels(self._voxels, self._voxels.add(centres))

    def _draw_voxels(self, voxels: VoxelPieces, pieces: Iterable[int]) -> None:
        for number in sorted(pieces):
            piece = voxels.centres(number)
            points = rr.Points3D(piece, colors=by_height(piece, self._ceiling), radii=voxels.size * 0.5)
            self._recording.log(f"{self._entity}/map/{number:03}", points)


def attach_companions(
    recording: rr.RecordingStream, bus: Bus, robots: Sequence[str], ceiling: float
) -> tuple[Companion, ...]:
    """Draw the other robots of the same world from now on. Raises TypeError for a bus without their namespaces."""
    companions = tuple(Companion(recording, robot, ceiling) for robot in robots)
    for robot, companion in zip(robots, companions, strict=True):
        if not isinstance(bus, MultiRobotBus):
            raise TypeError(f"other robots need a bus with namespaces, not a {type(bus).__name__}")
        companion.attach(bus.beside(robot))
    return companions
