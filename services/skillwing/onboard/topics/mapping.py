"""The map of occupied space."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from skillwing.services.protocol import Label, Message, Time

MAPPING_COMMAND = "fl/mapping/command"  # query ControlMapping -> Done
MAPPING_STATUS = "fl/mapping/status"  # MappingStatus, 2 Hz
MAP = "fl/mapping/map"  # float32 [n, 3] centres of occupied voxels that changed since the last one, MapHeader, 1 Hz
MAP_SNAPSHOT = "fl/mapping/snapshot"  # query Empty -> float32 [n, 3] all occupied voxel centres + MapHeader
Poses = Literal["odometry", "navigation", "small-gicp"]
"""Sources of the map's poses (docs/mapping.md)."""


class ControlMapping(Message, frozen=True, kw_only=True):
    goal_id: Label
    token: int
    run: bool


class MappingStatus(Message, frozen=True, kw_only=True):
    """`diverged`: the map is no longer reliable, for the reason in `text`. `pose_source` names the source of poses."""

    t: Time
    running: bool
    diverged: bool
    scans: int
    voxels: int
    pose_source: Label
    text: str = ""


class MapHeader(Message, frozen=True, kw_only=True):
    t: Time
    voxel_size: Annotated[float, msgspec.Meta(gt=0.0, le=100.0)]
    count: int
    complete: bool
