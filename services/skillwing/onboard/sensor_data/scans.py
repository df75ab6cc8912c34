"""Measurements of the two ranging sensors, decoded, and placed in the world by the drone's poses."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.pose_history import PoseHistory
from skillwing.onboard.sensor_data.directions import depth_directions, lidar_directions
from skillwing.onboard.topics.sensors import DepthHeader, LidarHeader
from skillwing.services.bus import Sample
from skillwing.services.protocol import ProtocolError, decode

Points = NDArray[np.float32]
S = TypeVar("S")
_log = logging.getLogger(__name__)
OWN_BODY = 0.9
"""Radius around the drone's centre within which returns are the drone itself [m]."""
BLOCK = 4
"""Side of the blocks of pixels that make one point each."""


def measurement_reader(read: Callable[[bytes, bytes], S], use: Callable[[S], object]) -> Callable[[Sample], None]:
    """A subscriber for payloads with attachments; `read` decodes the two, or raises ProtocolError."""

    def on_sample(sample: Sample) -> None:
        try:
            value = read(sample.payload, sample.attachment)
        except ProtocolError as error:
            _log.warning("dropped a publication on %s: %s", sample.key, error)
            return
        use(value)

    return on_sample


@dataclass(frozen=True, slots=True)
class PlacedPoints:
    """Points (N, 3) of one measurement in the world frame. It ended at `stamp`, with the body's axes as the columns of
    `turn` (3, 3). `origin` (3,) is the sensor's position in the middle of it."""

    stamp: float
    turn: NDArray[np.float64]
    origin: NDArray[np.float64]
    points: Points


@dataclass(frozen=True, slots=True)
class LidarScan:
    """One revolution; `ranges` (columns, beams) [m], 0 = no return."""

    header: LidarHeader
    ranges: Points

    @staticmethod
    def decode(payload: bytes, attachment: bytes) -> LidarScan:
        """Raises ProtocolError for anything but a scan."""
        header = decode(attachment, LidarHeader)
        if min(header.columns, header.beams) < 1 or len(payload) != 4 * header.columns * header.beams:
            raise ProtocolError(
                f"{len(payload)} bytes are no scan of {header.columns} columns and {header.beams} beams"
            )
        if header.t1 < header.t0:
            raise ProtocolError("the scan ends before it begins")
        ranges = np.frombuffer(payload, np.float32).reshape(header.columns, header.beams)
        return LidarScan(header, np.where(np.isfinite(ranges) & (ranges > 0.0), ranges, np.float32(0.0)))

    @property
    def span(self) -> tuple[float, float]:
        """Start and end of the measurement."""
        return self.header.t0, self.header.t1

    def in_body(self) -> Points:
        """Returns (columns, beams, 3) in body axes at the moment of each column [m]."""
        return self._in_body(np.arange(self.header.columns))

    def place(self, history: PoseHistory, reach: float) -> PlacedPoints:
        """All returns within `reach` [m], each column from the drone's pose at its moment."""
        header = self.header
        within = (self.ranges > 0.0) & (self.ranges <= reach)
        columns = np.flatnonzero(within.any(axis=1))  # the others look into the sky
        steps = np.array([*(columns + 0.5) / header.columns, 0.5, 1.0])
        positions, turns = history.at(header.t0 + steps * (header.t1 - header.t0))
        mount = np.array(header.mount)
        in_body = self._in_body(columns)
        points = np.matmul(in_body, turns[:-2].transpose(0, 2, 1).astype(np.float32))
        points += positions[:-2, None].astype(np.float32)
        kept = within.take(columns, axis=0)
        kept &= np.einsum("ijk,ijk->ij", in_body, in_body) > OWN_BODY**2
        return PlacedPoints(header.t1, turns[-1], positions[-2] + turns[-2] @ mount, points[kept])

    def _in_body(self, columns: NDArray[np.intp]) -> Points:
        header = self.header
        directions = lidar_directions(header.columns, header.beams).take(columns, axis=0)
        return directions * self.ranges.take(columns, axis=0)[:, :, None] + np.array(header.mount, dtype=np.float32)


@dataclass(frozen=True)
class DepthPicture:
    """One depth picture; `depth` (height, width) along the optical axis [mm], 0 = no return."""

    header: DepthHeader
    depth: NDArray[np.uint16]

    @staticmethod
    def decode(payload: bytes, attachment: bytes) -> DepthPicture:
        """Raises ProtocolError for anything but a depth picture."""
        header = decode(attachment, DepthHeader)
        if min(header.width, header.height) < BLOCK or len(payload) != 2 * header.width * header.height:
            raise ProtocolError(f"{len(payload)} bytes are no picture of {header.width} x {header.height} pixels")
        if min(header.fx, header.fy) <= 0.0:
            raise ProtocolError("a camera's focal length has to be positive")
        return DepthPicture(header, np.frombuffer(payload, np.uint16).reshape(header.height, header.width))

    @property
    def span(self) -> tuple[float, float]:
        """Start and end of the measurement."""
        return self.header.t, self.header.t

    @cached_property
    def in_blocks(self) -> Points:
        """Depth [m] of the second nearest pixel of each block, 0 for a block with fewer than two."""
        return _nearest_but_one(self.depth)

    def place(self, history: PoseHistory, reach: float) -> PlacedPoints:
        """One point for each block of 4 x 4 pixels: the second nearest of its pixels, if within `reach` [m].

        A sixteenth of the points is enough for obstacles of the size of a pole. Near pixels do not miss thin obstacles,
        and the second nearest one makes a single wrong pixel harmless.
        """
        header = self.header
        positions, turns = history.at(np.array([header.t]))
        mount = np.array(header.mount, dtype=np.float32)
        depth = self.in_blocks
        in_view = (depth > 0.0) & (depth <= reach)
        in_body = _block_directions(msgspec.structs.replace(header, t=0.0))[in_view] * depth[in_view, None] + mount
        in_body = in_body[np.einsum("ij,ij->i", in_body, in_body) > OWN_BODY**2]
        points = (in_body @ turns[0].T + positions[0]).astype(np.float32)
        return PlacedPoints(header.t, turns[0], positions[0] + turns[0] @ mount, points)


def _nearest_but_one(depth: NDArray[np.uint16]) -> Points:
    rows, columns = depth.shape[0] // BLOCK, depth.shape[1] // BLOCK
    blocks = depth[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK)
    pixels = blocks.transpose(1, 3, 0, 2).reshape(BLOCK * BLOCK, rows, columns) - np.uint16(1)  # none becomes far
    nearest = pixels[0]
    second = np.full_like(nearest, np.iinfo(np.uint16).max)
    for pixel in pixels[1:]:
        second = np.minimum(second, np.maximum(nearest, pixel))
        nearest = np.minimum(nearest, pixel)
    return (second + np.uint16(1)) * np.float32(0.001)


@lru_cache(maxsize=2)
def _block_directions(header: DepthHeader) -> Points:
    """Directions of the middles of the blocks."""
    directions = depth_directions(header)
    rows, columns = header.height // BLOCK, header.width // BLOCK
    blocks = directions[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK, 3)
    return blocks.mean(axis=(1, 3), dtype=np.float32)
