"""The map of occupied space."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from skillwing.onboard.topics.common import Done, Empty
from skillwing.onboard.topics.processes import BRIDGE, MAPPING, RECORDER, SKILLS
from skillwing.onboard.topics.rows import arrays, query, stream
from skillwing.services.protocol import ErrorCode, Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty

MAPPING_COMMAND = "fl/mapping/command"
MAPPING_STATUS = "fl/mapping/status"
MAP = "fl/mapping/map"
MAP_SNAPSHOT = "fl/mapping/snapshot"
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


VOXELS = "float32 [n, 3]: centres of voxels, ENU in m"
ALL_VOXELS = "float32 [n, 3]: centres of all occupied voxels, ENU in m"
TOPICS: tuple[Channel, ...] = (
    query(MAPPING_COMMAND, ControlMapping, Done, MAPPING, (SKILLS,), Duty.SOME, ErrorCode.STALE_TOKEN),
    stream(MAPPING_STATUS, MappingStatus, MAPPING, (SKILLS, BRIDGE, RECORDER), Duty.SOME, rate=2.0),
    arrays(MAP, MapHeader, MAPPING, (BRIDGE, RECORDER), Duty.SOME, VOXELS, rate=1.0, when="while it maps"),
    query(MAP_SNAPSHOT, Empty, MapHeader, MAPPING, (RECORDER,), Duty.TRIALS, array=ALL_VOXELS),
)
