"""Guidance: motions, their progress, the geofence, and revoked authority."""

from __future__ import annotations

from enum import StrEnum

import msgspec

from skillwing.onboard.topics.common import Done, Vector2, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GUIDANCE, MAPPING, OBSTACLES, RECORDER, SKILLS, VIDEO
from skillwing.onboard.topics.rows import events, query, stream
from skillwing.services.protocol import ErrorCode, Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty

GUIDANCE_COMMAND = "fl/guidance/command"
GEOFENCE = "fl/geofence"
GUIDANCE_STATUS = "fl/guidance/status"
AUTHORITY = "fl/authority"


class YawMode(StrEnum):
    ALONG_TRACK = "ALONG_TRACK"
    FREE = "FREE"
    IN_VIEW = "IN_VIEW"  # turn the depth map's sensor along the track; without a depth map, as ALONG_TRACK


class TakeOff(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="take_off"):
    height: float
    speed: float


class Land(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="land"):
    speed: float


class FlyTo(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="fly_to"):
    target: Vector3
    speed: float
    nose: YawMode


class Orbit(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="orbit"):
    """Fly to the nearest point of the circle around `center` (ENU, its z does not matter) at `height` above the home
    pad. Then fly around it counter-clockwise with the nose to the centre. Radius in m, speed in m/s."""

    center: Vector3
    radius: float
    height: float
    laps: float
    speed: float


class HoldPosition(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="hold"):
    pass


class Turn(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="turn"):
    """Turn to a heading; with `lock` hold it until stopped."""

    heading: float
    lock: bool


class Stop(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="stop"):
    """End the motion of `goal_id`: brake, then hold position. Status reports STOPPED once at rest."""


Motion = TakeOff | Land | FlyTo | Orbit | HoldPosition | Turn | Stop


class GuidanceCommand(Message, frozen=True, kw_only=True):
    """A motion for a goal. The reply comes at once; the first setpoint follows the next navigation message."""

    goal_id: Label
    token: int
    motion: Motion


class MotionState(StrEnum):
    IDLE = "IDLE"  # no goal holds this axis; the drone keeps its position or heading
    TURNING = "TURNING"  # on the spot, before moving
    MOVING = "MOVING"
    WAITING = "WAITING"  # at rest, because the way ahead is not in view
    STOPPING = "STOPPING"
    STOPPED = "STOPPED"  # a Stop was carried out; the drone is at rest
    DONE = "DONE"  # arrived, at altitude, landed, aligned
    BLOCKED = "BLOCKED"  # at rest in front of an obstacle, or stalled
    ABORTED = "ABORTED"  # revoked, out of the fence, drifted too far


class AxisStatus(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Holder and progress of the body axes or of the heading. `remaining` is in m, or rad for the heading.

    `authority_lost`: an ABORTED motion lost its authority, to the safety pilot or to the resource manager. The resource
    manager ends such a goal. `no_view`: a BLOCKED motion ended because the way ahead was not in view."""

    goal_id: Label | None
    state: MotionState
    remaining: float
    text: str = ""
    authority_lost: bool = False
    no_view: bool = False


class GuidanceStatus(Message, frozen=True, kw_only=True):
    """`target` is the end of the segment being flown, `setpoint` the position that is due now. `way`: corners of the
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
    """Opposite corners of the box in which every target has to lie, and the home point in it (ENU, m)."""

    low: Vector3
    high: Vector3
    home: Vector2 = (0.0, 0.0)


class Revoked(Message, frozen=True, kw_only=True):
    """Goal `goal_id` has lost its authority: nodes refuse its commands with a token up to and including `token`."""

    goal_id: Label
    token: int
    record: Label | None = None


REFUSALS = (ErrorCode.STALE_TOKEN, ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE, ErrorCode.UNKNOWN_GOAL)
GOAL_ENDED = "when the resource manager has ended a goal"
TOPICS: tuple[Channel, ...] = (
    query(GUIDANCE_COMMAND, GuidanceCommand, Done, GUIDANCE, (SKILLS,), Duty.MUST, *REFUSALS),
    stream(GUIDANCE_STATUS, GuidanceStatus, GUIDANCE, (SKILLS, OBSTACLES, RECORDER), Duty.MUST, rate=20.0),
    events(
        GEOFENCE,
        Geofence,
        GUIDANCE,
        (SKILLS, OBSTACLES),
        Duty.SHOULD,
        "at the start, and when the home point is another",
    ),
    events(AUTHORITY, Revoked, BRIDGE, (GUIDANCE, OBSTACLES, MAPPING, VIDEO), Duty.MUST, GOAL_ENDED),
)
