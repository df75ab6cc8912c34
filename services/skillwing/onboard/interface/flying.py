"""What guidance is asked for and tells, and who may no longer command it."""

from __future__ import annotations

from skillwing.onboard.interface.topic import (
    BRIDGE,
    GUIDANCE,
    MAPPING,
    OBSTACLES,
    RECORDER,
    SKILLS,
    VIDEO,
    Duty,
    Kind,
    Topic,
)
from skillwing.onboard.topics import common, guidance
from skillwing.services.protocol import ErrorCode

COMMANDING = (
    Topic(
        guidance.GUIDANCE_COMMAND,
        Kind.QUERY,
        guidance.GuidanceCommand,
        Duty.MUST,
        GUIDANCE,
        (SKILLS,),
        "A motion for a goal, or its end. Answered at once with whether it was taken; the status tells how it goes.",
        "A skill asks six times, then its goal fails: guidance does not answer.",
        reply=common.Done,
        refusals=(ErrorCode.STALE_TOKEN, ErrorCode.NOT_ALLOWED, ErrorCode.UNAVAILABLE, ErrorCode.UNKNOWN_GOAL),
    ),
    Topic(
        guidance.GUIDANCE_STATUS,
        Kind.STREAM,
        guidance.GuidanceStatus,
        Duty.MUST,
        GUIDANCE,
        (SKILLS, OBSTACLES, RECORDER),
        "Who holds the body and the nose, how far the motion is, and where it leads.",
        "After 2 s a goal that flies fails, also where the reports no longer name it; an interrupted one is never "
        "confirmed, and ends by its timeout.",
        rate=20.0,
    ),
    Topic(
        guidance.GEOFENCE,
        Kind.EVENTS,
        guidance.Geofence,
        Duty.SHOULD,
        GUIDANCE,
        (SKILLS, OBSTACLES),
        "Where targets may lie, told once. Skills refuse others before they begin, and come home and land inside.",
        "Skills accept every target, and guidance has to refuse it; so it is with places to land.",
        when="at the start",
    ),
    Topic(
        guidance.AUTHORITY,
        Kind.EVENTS,
        guidance.Revoked,
        Duty.MUST,
        BRIDGE,
        (GUIDANCE, OBSTACLES, MAPPING, VIDEO),
        "A goal whose commands no longer count: whatever still moves for it brakes and holds its position.",
        "The vehicle flies on for a goal that is over, until the next one commands it.",
        when="when a goal was ended by the resource manager",
    ),
)
