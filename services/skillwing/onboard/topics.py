"""The functional layer's API: its topics and messages, which a real autopilot could serve instead.

No skill, resource or tree is known here. Frames are ENU for the world (x east, y north, z up, origin at the
home pad) and FLU for the body (REP 103); headings are radians counter-clockwise from east. `token` is a
fencing token, an integer that grows with every grant: a command with a smaller token than the newest one seen for
the same axis is refused. This module needs only msgspec.

Array streams carry raw little-endian bytes in the payload and one of the `*Header` messages as attachment.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, TypeAlias

import msgspec

from skillwing.services.protocol import CLOCK_KEY, LONGEST_SENTENCE, Label, Message, Time

LARGEST_COMPONENT = 1e6
Component: TypeAlias = Annotated[float, msgspec.Meta(ge=-LARGEST_COMPONENT, le=LARGEST_COMPONENT)]
"""Of a position, velocity, ... in SI units. Beyond a thousand kilometres nothing is meant that a drone should try."""
Sentence: TypeAlias = Annotated[str, msgspec.Meta(max_length=LONGEST_SENTENCE)]
"""For people; others pass it on inside of longer messages, hence of bounded length."""
Magnitude: TypeAlias = Component
"""How badly something fails, in the unit of its fault; of some kinds less is meant (docs/sensors.md)."""
FASTEST_LINK = 1e4
Megabits: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=FASTEST_LINK)]
"""A bandwidth [Mbit/s]."""
Vector3 = tuple[Component, Component, Component]
Quaternion = tuple[Component, Component, Component, Component]

CLOCK = CLOCK_KEY  # ClockTick, 12.5 Hz; at up to 50 Hz while the pace is not kept
NAVIGATION = "fl/navigation"  # Navigation, 50 Hz
FLIGHT = "fl/flight"  # FlightState, 10 Hz and at each change
BATTERY = "fl/battery"  # Battery, 1 Hz
RANGE = "fl/range"  # Range, 20 Hz
GNSS = "fl/gnss"  # Gnss, 10 Hz, 0.1 s late
IMU = "fl/imu"  # float32 [n, 7] rows (t - t0, acceleration 3, angular rate 3) FLU, ImuHeader, 50 Hz
LIDAR = "fl/lidar"  # float32 [columns, beams] ranges in m, 0 = no return, LidarHeader, 10 Hz
ZED_DEPTH = "fl/zed/depth"  # uint16 [height, width] mm along the optical axis, 0 = no return, DepthHeader, 15 Hz
HEALTH = "fl/health"  # Health under fl/health/<sensor>, events
TRUTH = "fl/truth"  # Truth, 20 Hz: for judges and recordings only, never for the robot
AUTOPILOT_SETPOINT = "fl/autopilot/setpoint"  # AutopilotSetpoint, 50 Hz, guidance -> autopilot
FAULT = "fl/fault"  # query SetFault -> Done
FAULTS = "fl/fault/all"  # query Empty -> Faults
PILOT = "fl/pilot"  # query SetPilot -> Done
GUIDANCE_COMMAND = "fl/guidance/command"  # query GuidanceCommand -> Done
GEOFENCE = "fl/geofence"  # Geofence, events: guidance tells where targets may lie
GUIDANCE_STATUS = "fl/guidance/status"  # GuidanceStatus, 20 Hz
AUTHORITY = "fl/authority"  # Revoked, events: the bridge tells whose commands no longer count
OBSTACLE_COMMAND = "fl/obstacles/command"  # query SelectObstacleSource -> Done
OBSTACLE_STATUS = "fl/obstacles/status"  # ObstacleStatus, 10 Hz
LANDING_PLACE = "fl/obstacles/landing"  # query Empty -> LandingPlace
SLAM_ODOMETRY = "fl/slam/odometry"  # Odometry, 10 Hz: one for each scan
MAPPING_COMMAND = "fl/mapping/command"  # query ControlMapping -> Done
MAPPING_STATUS = "fl/mapping/status"  # MappingStatus, 2 Hz
MAP = "fl/mapping/map"  # float32 [n, 3] centres of occupied voxels that changed since the last one, MapHeader, 1 Hz
MAP_SNAPSHOT = "fl/mapping/snapshot"  # query Empty -> float32 [n, 3] all occupied voxel centres + MapHeader
CAMERA = "fl/camera/image"  # uint8 [height, width, 3] RGB, CameraHeader; only while somebody wants pictures
CAMERA_COMMAND = "fl/camera/command"  # query ControlCamera -> Done
VIDEO_COMMAND = "fl/video/command"  # query ControlVideo -> Done
VIDEO_ENCODER = "fl/video/encoder"  # EncoderStatus, 2 Hz while a stream runs
VIDEO_SENT = "fl/video/sent"  # a piece of an H.264 access unit, VideoPiece; video -> link
VIDEO_RECEIVED = "fl/video/received"  # the same where the link has not lost it; link -> ground
VIDEO_REPORT = "fl/video/report"  # VideoStatus, 4 Hz while a stream comes in; ground -> link
VIDEO_STATUS = "fl/video/status"  # the same once it is back on board; link -> video and whoever wants to know
VIDEO_SHOWN = "fl/video/shown"  # JPEG of what the ground sees, VideoShown, at most 4 Hz
LINK_STATUS = "fl/link/status"  # LinkStatus, 1 Hz; 5 Hz while something crosses the link
LINK_FAULT = "fl/link/fault"  # query SetLinkFault -> Done


def health_key(sensor: str) -> str:
    return f"{HEALTH}/{sensor}"


class Empty(Message, frozen=True, kw_only=True):
    pass


class Done(Message, frozen=True, kw_only=True):
    """A command was taken. Refusals are typed error replies."""

    text: str = ""


class Navigation(Message, frozen=True, kw_only=True):
    """Navigation solution at `t`: position and velocity ENU, attitude as quaternion (w, x, y, z) body to world,
    angular velocity FLU, heading in radians.

    `sigma` and `height_sigma` are the standard deviations of the position, level and in height [m]. While not `valid`,
    position and velocity are dead reckoning that has drifted too far to be flown by; attitude is still good."""

    t: Time
    position: Vector3
    velocity: Vector3
    quaternion: Quaternion
    angular_velocity: Vector3
    heading: float
    valid: bool = True
    sigma: float = 0.0
    height_sigma: float = 0.0


class FlightState(Message, frozen=True, kw_only=True):
    """`authority`: the safety pilot lets this computer fly. `failsafe` is "" or what the autopilot does by itself.

    `follows`: setpoints count; False while the autopilot overrules them, however fresh. `holds_heading`: the nose can
    be pointed somewhere; False from the loss of a rotor on.
    """

    t: Time
    on_ground: bool
    rotors_on: bool
    home_valid: bool
    authority: bool
    failsafe: Sentence = ""
    follows: bool = True
    holds_heading: bool = True


class Battery(Message, frozen=True, kw_only=True):
    t: Time
    percent: float
    voltage: float


class Range(Message, frozen=True, kw_only=True):
    """Distance down along the body's -z; None when nothing is within reach."""

    t: Time
    distance: float | None


class Gnss(Message, frozen=True, kw_only=True):
    """A satellite fix measured at `t`: position and velocity ENU, heading from two antennas."""

    t: Time
    position: Vector3
    velocity: Vector3
    heading: float


class ImuHeader(Message, frozen=True, kw_only=True):
    t0: Time
    count: int


class LidarHeader(Message, frozen=True, kw_only=True):
    """One revolution. Column c was measured at t0 + (c + 0.5) / columns * (t1 - t0). The ring is orthogonal to the
    nose: see `lidar_directions` in the sensor model. `mount` is the sensor's place in FLU."""

    t0: Time
    t1: Time
    columns: int
    beams: int
    mount: Vector3


class DepthHeader(Message, frozen=True, kw_only=True):
    """Pinhole model; `mount` is the camera's place in FLU, its optical axis is the body's x."""

    t: Time
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    mount: Vector3


class SensorStatus(StrEnum):
    UNKNOWN = "UNKNOWN"
    OK = "OK"
    FAILED = "FAILED"


class Health(Message, frozen=True, kw_only=True):
    """What a sensor node found out about itself. `id` is unique and becomes the root of a cause chain."""

    id: Label
    t: Time
    sensor: Label
    status: SensorStatus
    reason: Sentence = ""
    cause: Label | None = None


class Truth(Message, frozen=True, kw_only=True):
    """Ground truth for judges: `clearance` is the distance of the blades' tips from the nearest obstacle, at `t`."""

    t: Time
    position: Vector3
    quaternion: Quaternion
    velocity: Vector3
    collisions: int
    clearance: float
    inside_fence: bool


class AutopilotSetpoint(Message, frozen=True, kw_only=True):
    """Where to be at `t` (ENU), with velocity and acceleration to feed forward, and the heading.

    `rotors` False lets them stop once the drone stands. Guidance never says so: an autopilot notices by itself that it
    has touched down."""

    t: Time
    position: Vector3
    velocity: Vector3
    heading: float
    rotors: bool
    acceleration: Vector3 = (0.0, 0.0, 0.0)


class SetFault(Message, frozen=True, kw_only=True):
    """Switch a fault. Kinds: of a sensor blackout, freeze, noise, bias, dropout, slow; of a rotor stopped, weak."""

    sensor: Label
    kind: Label
    on: bool = True
    magnitude: Magnitude | None = None


class FaultState(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What can fail: in which ways it can, in which ways it does, and what it thinks of itself (a rotor: None)."""

    name: Label
    kinds: tuple[str, ...]
    active: tuple[str, ...] = ()
    status: SensorStatus | None = None


class Faults(Message, frozen=True, kw_only=True):
    of: tuple[FaultState, ...]


class SetPilot(Message, frozen=True, kw_only=True):
    """The safety pilot takes authority (False) or gives it to the computer (True)."""

    authority: bool


class Nose(StrEnum):
    ALONG_TRACK = "ALONG_TRACK"
    FREE = "FREE"
    IN_VIEW = "IN_VIEW"  # so that what the depth map is made from looks along the track; without one, along the track


class TakeOff(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="take_off"):
    height: float
    speed: float


class Land(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="land"):
    speed: float


class FlyTo(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="fly_to"):
    target: Vector3
    speed: float
    nose: Nose


class Orbit(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="orbit"):
    """Fly to the nearest point of the circle around `center` (ENU, its z does not matter) at `height` above the home
    pad, then around it counter-clockwise with the nose to the centre. Radius in m, speed in m/s."""

    center: Vector3
    radius: float
    height: float
    laps: float
    speed: float


class Hold(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="hold"):
    pass


class Turn(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="turn"):
    """Turn to a heading; with `lock` hold it until stopped."""

    heading: float
    lock: bool


class Stop(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="stop"):
    """End the motion of `goal_id`: brake, then hold position. Status reports STOPPED once at rest."""


Motion = TakeOff | Land | FlyTo | Orbit | Hold | Turn | Stop


class GuidanceCommand(Message, frozen=True, kw_only=True):
    goal_id: Label
    token: int
    motion: Motion


class MotionState(StrEnum):
    IDLE = "IDLE"  # nobody holds this axis; the drone holds what it has
    TURNING = "TURNING"  # on the spot, before moving
    MOVING = "MOVING"
    WAITING = "WAITING"  # at rest, because the way ahead is not in view
    STOPPING = "STOPPING"
    STOPPED = "STOPPED"  # a Stop was carried out; the drone is at rest
    DONE = "DONE"  # arrived, at altitude, landed, aligned
    BLOCKED = "BLOCKED"  # at rest in front of an obstacle, or cannot make headway
    ABORTED = "ABORTED"  # revoked, out of the fence, drifted too far


class AxisStatus(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Of the body axes or of the heading: who commands it and how far it is (m, or rad for heading)."""

    goal_id: Label | None
    state: MotionState
    remaining: float
    text: str = ""


class GuidanceStatus(Message, frozen=True, kw_only=True):
    """`target` is the end of the segment being flown, `setpoint` where the drone should be now. `way`: corners of the
    way ahead where it is not straight. `laps_done` of an orbit that is under way or done."""

    t: Time
    body: AxisStatus
    heading: AxisStatus
    setpoint: Vector3
    target: Vector3 | None
    free_distance: float | None
    way: tuple[Vector3, ...] = ()
    laps_done: float | None = None


class Geofence(Message, frozen=True, kw_only=True):
    """Opposite corners of the box in which every target has to lie (ENU, m)."""

    low: Vector3
    high: Vector3


class Revoked(Message, frozen=True, kw_only=True):
    """Commands with a token up to and including `token` for goal `goal_id` no longer count."""

    goal_id: Label
    token: int
    record: Label | None = None


class ObstacleSource(StrEnum):
    NONE = "NONE"
    ZED = "ZED"
    LIDAR = "LIDAR"


class SelectObstacleSource(Message, frozen=True, kw_only=True):
    """Which sensor the depth map is made from. `goal_id` is who asks."""

    goal_id: Label
    token: int
    source: ObstacleSource


class ObstacleStatus(Message, frozen=True, kw_only=True):
    """`free_distance`: metres that are free along the way from the drone to guidance's target, and as far behind it as
    the drone needs room (None: no way, or the source does not look along it); `horizon`: how far along it anything
    would be seen that is worth avoiding; `ahead`: nearest obstacle in the direction of view or motion; `stamp`: when
    the measurement was taken; `across`: the source looks to both sides of the nose, not along it."""

    t: Time
    source: ObstacleSource
    free_distance: float | None
    horizon: float
    ahead: float | None
    stamp: Time | None
    across: bool = False


class LandingPlace(Message, frozen=True, kw_only=True):
    """Where to land, as far as is known what stands below the drone: at `place` (ENU, at the drone's height), or, if
    that is None, where it is. `taken`: something is known to stand there, or the ground is steep; without a `place` no
    better one is known then. `text` says why."""

    place: Vector3 | None
    taken: bool = False
    text: Sentence = ""


class ControlMapping(Message, frozen=True, kw_only=True):
    goal_id: Label
    token: int
    run: bool


class Tracking(StrEnum):
    GOOD = "GOOD"
    DOUBTING = "DOUBTING"  # the last scans did not fit: the pose comes from inertial measurements alone
    LOST = "LOST"  # the pose is not to be believed; a new start is needed


class Odometry(Message, frozen=True, kw_only=True):
    """LiDAR-inertial odometry at `t`, the end of a scan: pose and velocity as in Navigation.

    Its frame is ENU as navigation had it at `since`, when odometry began; it drifts away from there. The sigmas are
    standard deviations along the world's axes [m] and about the body's [rad]. `agreement` is the share of the scan's
    points, 0 to 1, that lie on known surfaces.
    """

    t: Time
    since: Time
    position: Vector3
    velocity: Vector3
    quaternion: Quaternion
    position_sigma: Vector3
    attitude_sigma: Vector3
    agreement: float
    tracking: Tracking
    text: str = ""


class MappingStatus(Message, frozen=True, kw_only=True):
    """`diverged`: the map can no longer be trusted, and `text` says why. `pose_source` says honestly where poses come
    from."""

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


class CameraHeader(Message, frozen=True, kw_only=True):
    """Pinhole model of the RGB camera; `mount` is its place in FLU. Its optical axis is the body's x, turned down by
    `tilt` [rad]."""

    t: Time
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    mount: Vector3
    tilt: float = 0.0


class ControlCamera(Message, frozen=True, kw_only=True):
    """Pictures are wanted for the next `seconds`, at this rate; who wants more asks again in time."""

    fps: Annotated[float, msgspec.Meta(gt=0.0, le=50.0)]
    seconds: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)]
    tilt: Annotated[float, msgspec.Meta(ge=-1.6, le=1.6)] = 0.0


class ControlVideo(Message, frozen=True, kw_only=True):
    """Start or stop the live video of a goal. `min_fps` and `min_quality` are what the ground needs at least: between
    them the sender chooses what to give up first."""

    goal_id: Label
    token: int
    run: bool
    min_fps: float = 10.0
    min_quality: float = 0.7


class EncoderStatus(Message, frozen=True, kw_only=True):
    """What the sender aims at: `bitrate` [bit/s]; `changes` counts how often it has changed its mind."""

    t: Time
    stream: Label
    bitrate: float
    fps: float
    changes: int


class VideoPiece(Message, frozen=True, kw_only=True):
    """One of `parts` pieces of picture number `frame`, taken at `t`, that has `size` bytes in all.

    `sequence` counts the pieces of a stream. From part number `parts` on come `parity` pieces more: of all of them any
    `parts` make the picture (`skillwing.onboard.video.erasure`).
    """

    t: Time
    stream: Label
    sequence: int
    frame: int
    part: Annotated[int, msgspec.Meta(ge=0, le=4096)]
    parts: Annotated[int, msgspec.Meta(ge=1, le=4096)]
    size: Annotated[int, msgspec.Meta(ge=0, le=4096 * 1200)]
    keyframe: bool
    parity: Annotated[int, msgspec.Meta(ge=0, le=255)] = 0


class VideoStatus(Message, frozen=True, kw_only=True):
    """What arrives on the ground, over the last second: pictures shown, `bitrate` [bit/s], share of pieces `lost`,
    median time from shutter to screen [s]. `quality` is the SSIM of pictures shown, None while there are none."""

    t: Time
    stream: Label
    fps: float
    quality: float | None
    bitrate: float
    lost: float
    latency: float | None
    wants_keyframe: bool = False


class VideoShown(Message, frozen=True, kw_only=True):
    t: Time
    width: int
    height: int


class LinkStatus(Message, frozen=True, kw_only=True):
    """What the modem on board knows: the `bandwidth` [bit/s] of its present modulation, delay and share of packets lost
    on the air, how long what it holds will take to be sent [s], what it has sent in the last second [bit/s], and how
    many packets it had no room for since it was switched on. `faults` are the kinds that the simulation has switched
    on, for who looks on."""

    t: Time
    bandwidth: Annotated[float, msgspec.Meta(ge=0.0, le=1e6 * FASTEST_LINK)]
    latency: Annotated[float, msgspec.Meta(ge=0.0)]
    loss: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    queued: Annotated[float, msgspec.Meta(ge=0.0)]
    sent: Annotated[float, msgspec.Meta(ge=0.0)]
    dropped: Annotated[int, msgspec.Meta(ge=0)]
    faults: tuple[Label, ...] = ()


class SetLinkFault(Message, frozen=True, kw_only=True):
    """Switch a fault of the link. Kinds: narrow (`magnitude` is what is left, in Mbit/s), cut."""

    kind: Label
    on: bool = True
    magnitude: Megabits | None = None
