"""Every topic of the functional layer, by the place in which another process may stand.

`onboard.topics` has the keys and the messages, and this table the rows: which belong together, between whom, how often.
`functional-layer.md.template` explains each topic.
"""

from __future__ import annotations

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
from skillwing.services.protocol import CLOCK_KEY, ClockTick, ErrorCode
from skillwing.services.wire.channel import Channel, Duty, Each, Kind

VEHICLE, GUIDANCE, BRIDGE = "sim", "guidance", "bridge"
OBSTACLES, MAPPING = "obstacles", "mapping"
VIDEO, LINK, GROUND = "video", "link", "ground"
SKILLS, RECORDER, CAMPAIGNS = "skill managers", "recorder", "campaigns"
"""Names of processes. The managers of all skills have one name; `sim` stands for a vehicle."""

STREAM, ARRAYS, EVENTS, QUERY = Kind.STREAM, Kind.ARRAYS, Kind.EVENTS, Kind.QUERY
MUST, SHOULD, SOME, TRIALS = Duty.MUST, Duty.SHOULD, Duty.SOME, Duty.TRIALS
STALE, UNKNOWN = (ErrorCode.STALE_TOKEN,), (ErrorCode.UNKNOWN_NAME,)
COMMANDS = (*STALE, ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE, ErrorCode.UNKNOWN_GOAL)
DEPTHS = "uint16 [height, width]: depth along the optical axis in mm, 0 for no return"
RANGES = "float32 [columns, beams]: ranges in m, 0 for no return"
INERTIAL = "float32 [n, 7]: seconds since t0, acceleration [m/s2], angular rate [rad/s], FLU; 250 rows a second"
PACKET = "a packet of an H.264 access unit, or of its parity"
VOXELS = "float32 [n, 3]: centres of voxels, ENU in m"
ALL_VOXELS = "float32 [n, 3]: centres of all occupied voxels, ENU in m"
PIXELS = "uint8 [height, width, 3]: RGB"
SENDING, RECEIVING = "while a stream runs", "while a stream comes in"

FLYING = (
    Channel(
        navigation.NAVIGATION,
        STREAM,
        VEHICLE,
        (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, SKILLS, RECORDER),
        navigation.Navigation,
        duty=MUST,
        rate=50.0,
    ),
    Channel(
        flight.FLIGHT,
        STREAM,
        VEHICLE,
        (GUIDANCE, BRIDGE, SKILLS),
        flight.FlightState,
        duty=MUST,
        rate=10.0,
        when="and at each change",
    ),
    Channel(
        flight.AUTOPILOT_SETPOINT,
        STREAM,
        GUIDANCE,
        (VEHICLE,),
        flight.AutopilotSetpoint,
        duty=MUST,
        rate=50.0,
        when="in the air and during a takeoff, at the rate of navigation",
    ),
    Channel(flight.BATTERY, STREAM, VEHICLE, (BRIDGE, RECORDER), flight.Battery, duty=SHOULD, rate=1.0),
    Channel(sensors.RANGE, STREAM, VEHICLE, (GUIDANCE, OBSTACLES), sensors.Range, duty=SHOULD, rate=20.0),
    Channel(
        sensors.HEALTH,
        EVENTS,
        VEHICLE,
        (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, RECORDER),
        sensors.Health,
        each=Each.SENSOR,
        duty=SOME,
        when="at each change",
    ),
    Channel(
        CLOCK_KEY,
        STREAM,
        VEHICLE,
        ("everybody",),
        ClockTick,
        duty=SOME,
        rate=12.5,
        when="at up to 50 Hz while the pace is not kept",
    ),
)
SENSORS = (
    Channel(
        sensors.ZED_DEPTH,
        ARRAYS,
        VEHICLE,
        (OBSTACLES, RECORDER),
        sensors.DepthHeader,
        duty=SOME,
        rate=15.0,
        array=DEPTHS,
    ),
    Channel(
        sensors.LIDAR,
        ARRAYS,
        VEHICLE,
        (OBSTACLES, MAPPING, RECORDER),
        sensors.LidarHeader,
        duty=SOME,
        rate=10.0,
        array=RANGES,
    ),
    Channel(sensors.IMU, ARRAYS, VEHICLE, (MAPPING,), sensors.ImuHeader, duty=SOME, rate=50.0, array=INERTIAL),
    Channel(
        video.CAMERA,
        ARRAYS,
        VEHICLE,
        (VIDEO, GROUND),
        video.CameraHeader,
        duty=SOME,
        when="at the requested rate, while requested",
        array=PIXELS,
    ),
    Channel(video.CAMERA_COMMAND, QUERY, VEHICLE, (VIDEO,), video.ControlCamera, common.Done, duty=SOME),
    Channel(sensors.GNSS, STREAM, VEHICLE, (), sensors.Gnss, duty=TRIALS, rate=10.0),
)
COMMANDING = (
    Channel(
        guidance.GUIDANCE_COMMAND,
        QUERY,
        GUIDANCE,
        (SKILLS,),
        guidance.GuidanceCommand,
        common.Done,
        COMMANDS,
        duty=MUST,
    ),
    Channel(
        guidance.GUIDANCE_STATUS,
        STREAM,
        GUIDANCE,
        (SKILLS, OBSTACLES, RECORDER),
        guidance.GuidanceStatus,
        duty=MUST,
        rate=20.0,
    ),
    Channel(
        guidance.GEOFENCE, EVENTS, GUIDANCE, (SKILLS, OBSTACLES), guidance.Geofence, duty=SHOULD, when="at the start"
    ),
    Channel(
        guidance.AUTHORITY,
        EVENTS,
        BRIDGE,
        (GUIDANCE, OBSTACLES, MAPPING, VIDEO),
        guidance.Revoked,
        duty=MUST,
        when="when the resource manager has ended a goal",
    ),
)
SEEING = (
    Channel(
        obstacles.OBSTACLE_COMMAND,
        QUERY,
        OBSTACLES,
        (SKILLS,),
        obstacles.SelectObstacleSource,
        common.Done,
        STALE,
        duty=SOME,
    ),
    Channel(
        obstacles.OBSTACLE_STATUS,
        STREAM,
        OBSTACLES,
        (GUIDANCE, SKILLS, BRIDGE, RECORDER),
        obstacles.ObstacleStatus,
        duty=SHOULD,
        rate=10.0,
    ),
    Channel(obstacles.LANDING_PLACE, QUERY, OBSTACLES, (SKILLS,), common.Empty, obstacles.LandingPlace, duty=SHOULD),
    Channel(mapping.MAPPING_COMMAND, QUERY, MAPPING, (SKILLS,), mapping.ControlMapping, common.Done, STALE, duty=SOME),
    Channel(
        mapping.MAPPING_STATUS, STREAM, MAPPING, (SKILLS, BRIDGE, RECORDER), mapping.MappingStatus, duty=SOME, rate=2.0
    ),
    Channel(
        mapping.MAP,
        ARRAYS,
        MAPPING,
        (BRIDGE, RECORDER),
        mapping.MapHeader,
        duty=SOME,
        rate=1.0,
        when="while it maps",
        array=VOXELS,
    ),
    Channel(
        mapping.MAP_SNAPSHOT,
        QUERY,
        MAPPING,
        (CAMPAIGNS,),
        common.Empty,
        mapping.MapHeader,
        duty=TRIALS,
        array=ALL_VOXELS,
    ),
    Channel(
        odometry.SLAM_ODOMETRY,
        STREAM,
        MAPPING,
        (VEHICLE,),
        odometry.Odometry,
        duty=SHOULD,
        rate=10.0,
        when="once it has begun",
    ),
)
STREAMING = (
    Channel(video.VIDEO_COMMAND, QUERY, VIDEO, (SKILLS,), video.ControlVideo, common.Done, STALE, duty=SOME),
    Channel(video.VIDEO_ENCODER, STREAM, VIDEO, (SKILLS,), video.EncoderStatus, duty=SOME, rate=2.0, when=SENDING),
    Channel(video.VIDEO_SENT, ARRAYS, VIDEO, (LINK,), video.VideoPacket, duty=SOME, when=SENDING, array=PACKET),
    Channel(video.VIDEO_RECEIVED, ARRAYS, LINK, (GROUND,), video.VideoPacket, duty=SOME, when=SENDING, array=PACKET),
    Channel(video.VIDEO_REPORT, STREAM, GROUND, (LINK,), video.VideoStatus, duty=SOME, rate=4.0, when=RECEIVING),
    Channel(
        video.VIDEO_STATUS,
        STREAM,
        LINK,
        (VIDEO, SKILLS, BRIDGE, RECORDER),
        video.VideoStatus,
        duty=SOME,
        rate=4.0,
        when=RECEIVING,
    ),
    Channel(
        video.VIDEO_SHOWN,
        ARRAYS,
        GROUND,
        (RECORDER,),
        video.VideoShown,
        duty=TRIALS,
        when=f"at most 4 Hz, {RECEIVING}",
        array="a JPEG file",
    ),
    Channel(
        link.LINK_STATUS,
        STREAM,
        LINK,
        (VIDEO, BRIDGE, RECORDER),
        link.LinkStatus,
        duty=SOME,
        when="1 Hz; 5 Hz while something crosses the link",
    ),
)
TRYING = (
    Channel(truth.TRUTH, STREAM, VEHICLE, (LINK, RECORDER, CAMPAIGNS), truth.Truth, duty=TRIALS, rate=20.0),
    Channel(flight.PILOT, QUERY, VEHICLE, ("`skillwing pilot`",), flight.SetPilot, common.Done, duty=TRIALS),
    Channel(faults.FAULT, QUERY, VEHICLE, ("`skillwing fault`",), faults.SetFault, common.Done, UNKNOWN, duty=TRIALS),
    Channel(faults.FAULTS, QUERY, VEHICLE, ("`skillwing fault --list`",), common.Empty, faults.Faults, duty=TRIALS),
    Channel(
        faults.LINK_FAULT,
        QUERY,
        LINK,
        ("`skillwing fault link`",),
        faults.SetLinkFault,
        common.Done,
        UNKNOWN,
        duty=TRIALS,
    ),
)

PLACES: dict[str, tuple[Channel, ...]] = {
    "flying": FLYING,
    "sensors": SENSORS,
    "commanding": COMMANDING,
    "seeing": SEEING,
    "streaming": STREAMING,
    "trying": TRYING,
}
TOPICS: tuple[Channel, ...] = tuple(topic for topics in PLACES.values() for topic in topics)
