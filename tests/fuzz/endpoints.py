"""Every key of the m600 that anybody serves or subscribes to, and what is expected there.

`test_every_key_is_fuzzed` holds this table to what the processes really declare: a key that is missing here fails it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skillwing.m600.robot import ROBOT
from skillwing.onboard import topics
from skillwing.services import protocol
from skillwing.services.wire.channel import Kind
from skillwing.services.wire.channels import CHANNELS, keys_in

SKILLSET = ROBOT.load_skillset()
KEYS = protocol.Keys(SKILLSET.name)


@dataclass(frozen=True)
class Endpoint:
    """A key without wildcards and the kind of its messages; array: the message is the header, in the attachment."""

    key: str
    kind: Any
    array: bool = False


def of_the_table(*kinds: Kind) -> tuple[Endpoint, ...]:
    """Every key of the wire protocol's table that is used so; for what the m600 has none of, a key of no meaning."""
    return tuple(
        Endpoint(key, channel.message)
        for channel in CHANNELS
        if channel.kind in kinds
        for key in keys_in(SKILLSET, channel) or (channel.spell(KEYS, "sweep"),)
    )


QUERIES = (
    *of_the_table(Kind.QUERY),
    Endpoint(topics.FAULT, topics.SetFault),
    Endpoint(topics.FAULTS, topics.Empty),
    Endpoint(topics.PILOT, topics.SetPilot),
    Endpoint(topics.GUIDANCE_COMMAND, topics.GuidanceCommand),
    Endpoint(topics.OBSTACLE_COMMAND, topics.SelectObstacleSource),
    Endpoint(topics.LANDING_PLACE, topics.Empty),
    Endpoint(topics.MAPPING_COMMAND, topics.ControlMapping),
    Endpoint(topics.MAP_SNAPSHOT, topics.Empty),
    Endpoint(topics.CAMERA_COMMAND, topics.ControlCamera),
    Endpoint(topics.VIDEO_COMMAND, topics.ControlVideo),
    Endpoint(topics.LINK_FAULT, topics.SetLinkFault),
)

PUBLICATIONS = (
    *of_the_table(Kind.EVENTS, Kind.STREAM),
    Endpoint(topics.NAVIGATION, topics.Navigation),
    Endpoint(topics.FLIGHT, topics.FlightState),
    Endpoint(topics.BATTERY, topics.Battery),
    Endpoint(topics.RANGE, topics.Range),
    Endpoint(topics.IMU, topics.ImuHeader, array=True),
    Endpoint(topics.LIDAR, topics.LidarHeader, array=True),
    Endpoint(topics.ZED_DEPTH, topics.DepthHeader, array=True),
    *(Endpoint(topics.health_key(sensor), topics.Health) for sensor in ("zed", "lidar", "imu", "range")),
    Endpoint(topics.SLAM_ODOMETRY, topics.Odometry),
    Endpoint(topics.TRUTH, topics.Truth),
    Endpoint(topics.AUTOPILOT_SETPOINT, topics.AutopilotSetpoint),
    Endpoint(topics.GEOFENCE, topics.Geofence),
    Endpoint(topics.GUIDANCE_STATUS, topics.GuidanceStatus),
    Endpoint(topics.AUTHORITY, topics.Revoked),
    Endpoint(topics.OBSTACLE_STATUS, topics.ObstacleStatus),
    Endpoint(topics.MAPPING_STATUS, topics.MappingStatus),
    Endpoint(topics.MAP, topics.MapHeader, array=True),
    Endpoint(topics.CAMERA, topics.CameraHeader, array=True),
    Endpoint(topics.VIDEO_SENT, topics.VideoPiece, array=True),
    Endpoint(topics.VIDEO_RECEIVED, topics.VideoPiece, array=True),
    Endpoint(topics.VIDEO_REPORT, topics.VideoStatus),
    Endpoint(topics.VIDEO_STATUS, topics.VideoStatus),
    Endpoint(topics.VIDEO_SHOWN, topics.VideoShown, array=True),
    Endpoint(topics.LINK_STATUS, topics.LinkStatus),
)

WORDS = (
    "",
    "x",
    "goal-1",
    "goal-2",
    "skill/takeoff",
    "client/me",
    SKILLSET.schema_hash,
    *(skill.name for skill in SKILLSET.skills),
    *(result.name for skill in SKILLSET.skills for result in skill.results),
    *(resource.name for resource in SKILLSET.resources),
    *(state for resource in SKILLSET.resources for state in resource.states),
    *(datum.name for datum in SKILLSET.data),
    *("result", "interrupt", "error"),
    *("zed", "blackout", "é\u0000\u202e", "\U0001f681" * 9, "../../etc", "*/**"),
)
"""Texts that get a message further than random ones would, and a few that do not."""
