"""Obstacle detection: its sensor, the free distance ahead, and places to land."""

from __future__ import annotations

from enum import StrEnum

from skillwing.onboard.topics.common import Done, Empty, Sentence, Vector3
from skillwing.onboard.topics.processes import BRIDGE, GUIDANCE, OBSTACLES, RECORDER, SKILLS
from skillwing.onboard.topics.rows import query, stream
from skillwing.services.protocol import ErrorCode, Label, Message, Time
from skillwing.services.wire.channel import Channel, Duty

OBSTACLE_COMMAND = "fl/obstacles/command"
OBSTACLE_STATUS = "fl/obstacles/status"
LANDING_PLACE = "fl/obstacles/landing"


class ObstacleSource(StrEnum):
    NONE = "NONE"
    ZED = "ZED"
    LIDAR = "LIDAR"


class SelectObstacleSource(Message, frozen=True, kw_only=True):
    """The sensor to make the depth map from, for goal `goal_id`."""

    goal_id: Label
    token: int
    source: ObstacleSource


class ObstacleStatus(Message, frozen=True, kw_only=True):
    """View of the depth map's sensor along the way from the drone to guidance's target.

    `free_distance`: free metres along the way, and behind its end as far as the drone needs room. None: no way, or the
    source does not look along it. `horizon`: distance along the way at which the source detects an obstacle. `ahead`:
    nearest obstacle in the direction of view or motion. `stamp`: time of the measurement. `across`: the source looks to
    both sides of the nose, not along it."""

    t: Time
    source: ObstacleSource
    free_distance: float | None
    horizon: float
    ahead: float | None
    stamp: Time | None
    across: bool = False


class LandingPlace(Message, frozen=True, kw_only=True):
    """Landing place by what was seen of the ground: `place` (ENU, at the drone's height), or None for straight down.

    `taken`: an obstacle or a steep slope is below the drone; if `place` is then None, no better place is known. `text`
    gives the reason."""

    place: Vector3 | None
    taken: bool = False
    text: Sentence = ""


TOPICS: tuple[Channel, ...] = (
    query(OBSTACLE_COMMAND, SelectObstacleSource, Done, OBSTACLES, (SKILLS,), Duty.SOME, ErrorCode.STALE_TOKEN),
    stream(OBSTACLE_STATUS, ObstacleStatus, OBSTACLES, (GUIDANCE, SKILLS, BRIDGE, RECORDER), Duty.SHOULD, rate=10.0),
    query(LANDING_PLACE, Empty, LandingPlace, OBSTACLES, (SKILLS,), Duty.SHOULD),
)
