# Generated from m600.skillset by `skillwing generate`. Do not edit: change the skillset instead.
"""Types of the skillset `m600`, and inputs, outputs and feedback of its skills."""

from __future__ import annotations

import typing

import msgspec


class Position(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Type `Position`."""

    x: float
    """[m]"""

    y: float
    """[m]"""

    z: float
    """[m]"""


class Velocity(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Type `Velocity`."""

    x: float
    """[m/s]"""

    y: float
    """[m/s]"""

    z: float
    """[m/s]"""


class MapStatistics(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Type `MapStatistics`."""

    voxels: int

    volume: float
    """[m^3]"""

    scans: int


class TakeoffInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `takeoff`."""

    height: float = 5.0
    """[m] in 1.0..50.0"""

    speed: float = 1.0
    """[m/s] in 0.1..3.0"""


class TakeoffFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `takeoff`."""

    height: float
    """[m]"""


class LandInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `land`."""

    speed: float = 0.7
    """[m/s] in 0.1..2.0"""


class LandFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `land`."""

    height: float
    """[m]"""


class HoverInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `hover`."""

    duration: float = 5.0
    """[s] in 0.0..3600.0"""


class HoverFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `hover`."""

    remaining: float
    """[s]"""


class GotoInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `goto`."""

    target: Position

    speed: float = 2.0
    """[m/s] in 0.1..5.0"""


class GotoOutputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Outputs of the skill `goto`."""

    stopped_at: Position

    obstacle_distance: float = 1000.0
    """[m]"""


class GotoFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `goto`."""

    distance: float
    """[m]"""


class GotoStraightInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `goto_straight`."""

    target: Position

    speed: float = 2.0
    """[m/s] in 0.1..5.0"""


class GotoStraightOutputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Outputs of the skill `goto_straight`."""

    stopped_at: Position

    obstacle_distance: float = 1000.0
    """[m]"""


class GotoStraightFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `goto_straight`."""

    distance: float
    """[m]"""


class ReturnHomeInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `return_home`."""

    height: float = 5.0
    """[m] in 1.0..50.0"""

    speed: float = 2.0
    """[m/s] in 0.1..5.0"""


class ReturnHomeFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `return_home`."""

    distance: float
    """[m]"""


class RotateHeadInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `rotate_head`."""

    heading: float
    """[rad] in -6.3..6.3"""


class RotateHeadFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `rotate_head`."""

    error: float
    """[rad]"""


class LockHeadInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `lock_head`."""

    heading: float
    """[rad] in -6.3..6.3"""


class LockHeadFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `lock_head`."""

    error: float
    """[rad]"""


class ZedDepthmapInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `zed_depthmap`."""


class ZedDepthmapFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `zed_depthmap`."""

    obstacle_distance: float
    """[m]"""


class LidarDepthmapInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `lidar_depthmap`."""


class LidarDepthmapFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `lidar_depthmap`."""

    obstacle_distance: float
    """[m]"""


class LidarMappingInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `lidar_mapping`."""


class LidarMappingFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `lidar_mapping`."""

    voxels: int


class InspectInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `inspect`."""

    center: Position

    radius: float
    """[m] in 2.0..100.0"""

    height: float
    """[m] in 1.0..50.0"""

    laps: float = 1.0
    """in 0.1..20.0"""

    speed: float = 2.0
    """[m/s] in 0.1..5.0"""


class InspectFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `inspect`."""

    laps_done: float


class StreamInputs(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the skill `stream`."""

    min_fps: float = 10.0
    """[1/s] in 1.0..60.0"""

    min_quality: float = 0.7
    """in 0.0..1.0"""


class StreamFeedback(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Feedback of the skill `stream`."""

    fps: float
    """[1/s]"""

    quality: float

    bitrate: float
    """[Mbit/s]"""


TakeoffResult: typing.TypeAlias = typing.Literal["AT_ALTITUDE", "BLOCKED", "ABORTED"]
LandResult: typing.TypeAlias = typing.Literal["LANDED", "BLOCKED"]
HoverResult: typing.TypeAlias = typing.Literal["DONE"]
GotoResult: typing.TypeAlias = typing.Literal["ARRIVED", "BLOCKED", "ABORTED"]
GotoStraightResult: typing.TypeAlias = typing.Literal["ARRIVED", "BLOCKED", "ABORTED"]
ReturnHomeResult: typing.TypeAlias = typing.Literal["ARRIVED", "ABORTED"]
RotateHeadResult: typing.TypeAlias = typing.Literal["ALIGNED"]
LockHeadResult: typing.TypeAlias = typing.Never
ZedDepthmapResult: typing.TypeAlias = typing.Literal["NO_DATA"]
LidarDepthmapResult: typing.TypeAlias = typing.Literal["NO_DATA"]
LidarMappingResult: typing.TypeAlias = typing.Literal["DIVERGED"]
InspectResult: typing.TypeAlias = typing.Literal["COMPLETED", "BLOCKED", "ABORTED"]
StreamResult: typing.TypeAlias = typing.Literal["FPS_LOST"]
SDKAuthorityState: typing.TypeAlias = typing.Literal["UNAVAILABLE", "AVAILABLE"]
FlightStatusState: typing.TypeAlias = typing.Literal["ON_GROUND", "IN_AIR"]
HomepointStatusState: typing.TypeAlias = typing.Literal["INVALID", "VALID"]
ZedStatusState: typing.TypeAlias = typing.Literal["UNKNOWN", "OK", "FAILED"]
LidarStatusState: typing.TypeAlias = typing.Literal["UNKNOWN", "OK", "FAILED"]
BatteryStatusState: typing.TypeAlias = typing.Literal["NORMAL", "LOW", "CRITICAL"]
LinkStatusState: typing.TypeAlias = typing.Literal["GOOD", "DEGRADED", "LOST"]
AxesAuthorityState: typing.TypeAlias = typing.Literal["AVAILABLE", "USED"]
HeadingAuthorityState: typing.TypeAlias = typing.Literal["AVAILABLE", "USED"]
DepthmapSourceState: typing.TypeAlias = typing.Literal["NONE", "ZED", "LIDAR"]
SlamStatusState: typing.TypeAlias = typing.Literal["IDLE", "RUNNING", "DIVERGED"]
