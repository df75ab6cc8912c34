"""Every topic of the functional layer, by the place in which another process may stand.

`topics` spells the keys and has the messages. This table says which belong together; `functional-layer.md.template`
explains each topic.
"""

from __future__ import annotations

from skillwing.onboard import topics
from skillwing.services.protocol import ClockTick, ErrorCode
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
PIECE = "a piece of an H.264 access unit, or of its parity"
VOXELS = "float32 [n, 3]: centres of voxels, ENU in m"
ALL_VOXELS = "float32 [n, 3]: centres of all occupied voxels, ENU in m"
PIXELS = "uint8 [height, width, 3]: RGB"
SENDING, RECEIVING = "while a stream runs", "while a stream comes in"

FLYING = (
    Channel(
        topics.NAVIGATION,
        STREAM,
        VEHICLE,
        (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, SKILLS, RECORDER),
        topics.Navigation,
        duty=MUST,
        rate=50.0,
    ),
    Channel(
        topics.FLIGHT,
        STREAM,
        VEHICLE,
        (GUIDANCE, BRIDGE, SKILLS),
        topics.FlightState,
        duty=MUST,
        rate=10.0,
        when="and at each change",
    ),
    Channel(
        topics.AUTOPILOT_SETPOINT,
        STREAM,
        GUIDANCE,
        (VEHICLE,),
        topics.AutopilotSetpoint,
        duty=MUST,
        rate=50.0,
        when="in the air and during a takeoff, at the rate of navigation",
    ),
    Channel(topics.BATTERY, STREAM, VEHICLE, (BRIDGE, RECORDER), topics.Battery, duty=SHOULD, rate=1.0),
    Channel(topics.RANGE, STREAM, VEHICLE, (GUIDANCE, OBSTACLES), topics.Range, duty=SHOULD, rate=20.0),
    Channel(
        topics.HEALTH,
        EVENTS,
        VEHICLE,
        (GUIDANCE, BRIDGE, OBSTACLES, MAPPING, RECORDER),
        topics.Health,
        each=Each.SENSOR,
        duty=SOME,
        when="at each change",
    ),
    Channel(
        topics.CLOCK,
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
        topics.ZED_DEPTH, ARRAYS, VEHICLE, (OBSTACLES, RECORDER), topics.DepthHeader, duty=SOME, rate=15.0, array=DEPTHS
    ),
    Channel(
        topics.LIDAR,
        ARRAYS,
        VEHICLE,
        (OBSTACLES, MAPPING, RECORDER),
        topics.LidarHeader,
        duty=SOME,
        rate=10.0,
        array=RANGES,
    ),
    Channel(topics.IMU, ARRAYS, VEHICLE, (MAPPING,), topics.ImuHeader, duty=SOME, rate=50.0, array=INERTIAL),
    Channel(
        topics.CAMERA,
        ARRAYS,
        VEHICLE,
        (VIDEO, GROUND),
        topics.CameraHeader,
        duty=SOME,
        when="at the requested rate, while requested",
        array=PIXELS,
    ),
    Channel(topics.CAMERA_COMMAND, QUERY, VEHICLE, (VIDEO,), topics.ControlCamera, topics.Done, duty=SOME),
    Channel(topics.GNSS, STREAM, VEHICLE, (), topics.Gnss, duty=TRIALS, rate=10.0),
)
COMMANDING = (
    Channel(
        topics.GUIDANCE_COMMAND, QUERY, GUIDANCE, (SKILLS,), topics.GuidanceCommand, topics.Done, COMMANDS, duty=MUST
    ),
    Channel(
        topics.GUIDANCE_STATUS,
        STREAM,
        GUIDANCE,
        (SKILLS, OBSTACLES, RECORDER),
        topics.GuidanceStatus,
        duty=MUST,
        rate=20.0,
    ),
    Channel(topics.GEOFENCE, EVENTS, GUIDANCE, (SKILLS, OBSTACLES), topics.Geofence, duty=SHOULD, when="at the start"),
    Channel(
        topics.AUTHORITY,
        EVENTS,
        BRIDGE,
        (GUIDANCE, OBSTACLES, MAPPING, VIDEO),
        topics.Revoked,
        duty=MUST,
        when="when the resource manager has ended a goal",
    ),
)
SEEING = (
    Channel(
        topics.OBSTACLE_COMMAND, QUERY, OBSTACLES, (SKILLS,), topics.SelectObstacleSource, topics.Done, STALE, duty=SOME
    ),
    Channel(
        topics.OBSTACLE_STATUS,
        STREAM,
        OBSTACLES,
        (GUIDANCE, SKILLS, BRIDGE, RECORDER),
        topics.ObstacleStatus,
        duty=SHOULD,
        rate=10.0,
    ),
    Channel(topics.LANDING_PLACE, QUERY, OBSTACLES, (SKILLS,), topics.Empty, topics.LandingPlace, duty=SHOULD),
    Channel(topics.MAPPING_COMMAND, QUERY, MAPPING, (SKILLS,), topics.ControlMapping, topics.Done, STALE, duty=SOME),
    Channel(
        topics.MAPPING_STATUS, STREAM, MAPPING, (SKILLS, BRIDGE, RECORDER), topics.MappingStatus, duty=SOME, rate=2.0
    ),
    Channel(
        topics.MAP,
        ARRAYS,
        MAPPING,
        (BRIDGE, RECORDER),
        topics.MapHeader,
        duty=SOME,
        rate=1.0,
        when="while it maps",
        array=VOXELS,
    ),
    Channel(
        topics.MAP_SNAPSHOT, QUERY, MAPPING, (CAMPAIGNS,), topics.Empty, topics.MapHeader, duty=TRIALS, array=ALL_VOXELS
    ),
    Channel(
        topics.SLAM_ODOMETRY,
        STREAM,
        MAPPING,
        (VEHICLE,),
        topics.Odometry,
        duty=SHOULD,
        rate=10.0,
        when="once it has begun",
    ),
)
STREAMING = (
    Channel(topics.VIDEO_COMMAND, QUERY, VIDEO, (SKILLS,), topics.ControlVideo, topics.Done, STALE, duty=SOME),
    Channel(topics.VIDEO_ENCODER, STREAM, VIDEO, (SKILLS,), topics.EncoderStatus, duty=SOME, rate=2.0, when=SENDING),
    Channel(topics.VIDEO_SENT, ARRAYS, VIDEO, (LINK,), topics.VideoPiece, duty=SOME, when=SENDING, array=PIECE),
    Channel(topics.VIDEO_RECEIVED, ARRAYS, LINK, (GROUND,), topics.VideoPiece, duty=SOME, when=SENDING, array=PIECE),
    Channel(topics.VIDEO_REPORT, STREAM, GROUND, (LINK,), topics.VideoStatus, duty=SOME, rate=4.0, when=RECEIVING),
    Channel(
        topics.VIDEO_STATUS,
        STREAM,
        LINK,
        (VIDEO, SKILLS, BRIDGE, RECORDER),
        topics.VideoStatus,
        duty=SOME,
        rate=4.0,
        when=RECEIVING,
    ),
    Channel(
        topics.VIDEO_SHOWN,
        ARRAYS,
        GROUND,
        (RECORDER,),
        topics.VideoShown,
        duty=TRIALS,
        when=f"at most 4 Hz, {RECEIVING}",
        array="a JPEG file",
    ),
    Channel(
        topics.LINK_STATUS,
        STREAM,
        LINK,
        (VIDEO, BRIDGE, RECORDER),
        topics.LinkStatus,
        duty=SOME,
        when="1 Hz; 5 Hz while something crosses the link",
    ),
)
TRYING = (
    Channel(topics.TRUTH, STREAM, VEHICLE, (LINK, RECORDER, CAMPAIGNS), topics.Truth, duty=TRIALS, rate=20.0),
    Channel(topics.PILOT, QUERY, VEHICLE, ("`skillwing pilot`",), topics.SetPilot, topics.Done, duty=TRIALS),
    Channel(topics.FAULT, QUERY, VEHICLE, ("`skillwing fault`",), topics.SetFault, topics.Done, UNKNOWN, duty=TRIALS),
    Channel(topics.FAULTS, QUERY, VEHICLE, ("`skillwing fault --list`",), topics.Empty, topics.Faults, duty=TRIALS),
    Channel(
        topics.LINK_FAULT,
        QUERY,
        LINK,
        ("`skillwing fault link`",),
        topics.SetLinkFault,
        topics.Done,
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
TOPICS: tuple[Channel, ...] = tuple(topic for topics_ in PLACES.values() for topic in topics_)
