"""Every key of the m600 with a server or a subscriber, and the kind of its messages.

`test_every_key_is_fuzzed` holds this table to what the processes really declare: a key that is missing here fails it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics import (
    common,
    faults,
    flight,
    guidance,
    link,
    mapping,
    navigation,
    obstacles,
    odometry,
    sensors,
    truth,
    video,
)
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
    """All keys of these kinds in the table of the wire protocol, for rows without one in the m600 a meaningless key."""
    return tuple(
        Endpoint(key, channel.message)
        for channel in CHANNELS
        if channel.kind in kinds
        for key in keys_in(SKILLSET, channel) or (channel.spell(KEYS, "sweep"),)
    )


QUERIES = (
    *of_the_table(Kind.QUERY),
    Endpoint(faults.FAULT, faults.SetFault),
    Endpoint(faults.FAULTS, common.Empty),
    Endpoint(flight.PILOT, flight.SetPilot),
    Endpoint(guidance.GUIDANCE_COMMAND, guidance.GuidanceCommand),
    Endpoint(obstacles.OBSTACLE_COMMAND, obstacles.SelectObstacleSource),
    Endpoint(obstacles.LANDING_PLACE, common.Empty),
    Endpoint(mapping.MAPPING_COMMAND, mapping.ControlMapping),
    Endpoint(mapping.MAP_SNAPSHOT, common.Empty),
    Endpoint(video.CAMERA_COMMAND, video.ControlCamera),
    Endpoint(video.VIDEO_COMMAND, video.ControlVideo),
    Endpoint(faults.LINK_FAULT, faults.SetLinkFault),
)

PUBLICATIONS = (
    *of_the_table(Kind.EVENTS, Kind.STREAM),
    Endpoint(navigation.NAVIGATION, navigation.Navigation),
    Endpoint(flight.FLIGHT, flight.FlightState),
    Endpoint(flight.BATTERY, flight.Battery),
    Endpoint(sensors.RANGE, sensors.Range),
    Endpoint(sensors.IMU, sensors.ImuHeader, array=True),
    Endpoint(sensors.LIDAR, sensors.LidarHeader, array=True),
    Endpoint(sensors.ZED_DEPTH, sensors.DepthHeader, array=True),
    *(Endpoint(sensors.health_key(sensor), sensors.Health) for sensor in ("zed", "lidar", "imu", "range")),
    Endpoint(odometry.SLAM_ODOMETRY, odometry.Odometry),
    Endpoint(truth.TRUTH, truth.Truth),
    Endpoint(flight.AUTOPILOT_SETPOINT, flight.AutopilotSetpoint),
    Endpoint(guidance.GEOFENCE, guidance.Geofence),
    Endpoint(guidance.GUIDANCE_STATUS, guidance.GuidanceStatus),
    Endpoint(guidance.AUTHORITY, guidance.Revoked),
    Endpoint(obstacles.OBSTACLE_STATUS, obstacles.ObstacleStatus),
    Endpoint(mapping.MAPPING_STATUS, mapping.MappingStatus),
    Endpoint(mapping.MAP, mapping.MapHeader, array=True),
    Endpoint(video.CAMERA, video.CameraHeader, array=True),
    Endpoint(video.VIDEO_SENT, video.VideoPacket, array=True),
    Endpoint(video.VIDEO_RECEIVED, video.VideoPacket, array=True),
    Endpoint(video.VIDEO_REPORT, video.VideoStatus),
    Endpoint(video.VIDEO_STATUS, video.VideoStatus),
    Endpoint(video.VIDEO_SHOWN, video.VideoShown, array=True),
    Endpoint(link.LINK_STATUS, link.LinkStatus),
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
"""Texts that get a message further than random ones, and a few that do not."""
