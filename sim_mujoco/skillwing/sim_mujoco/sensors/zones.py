"""Zones of the world: boxes and cylinders in which a fault or a state of the link holds."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.common import Vector3

Metres = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]
Level = tuple[float, float]


class Zone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box from `low` to `high`, or an upright cylinder around `center` (x, y) with `radius`; ENU [m].

    Raises ValueError if it is neither or both, and for an empty box.
    """

    low: Vector3 | None = None
    high: Vector3 | None = None
    center: Level | None = None
    radius: Metres | None = None

    def __post_init__(self) -> None:
        corners, circle = (self.low, self.high), (self.center, self.radius)
        is_box = None not in corners and circle == (None, None)
        is_cylinder = None not in circle and corners == (None, None)
        if not is_box and not is_cylinder:
            raise ValueError("a zone has either `low` and `high`, or `center` and `radius`")
        if is_box and any(low >= high for low, high in zip(self.low or (), self.high or (), strict=True)):
            raise ValueError("`low` of a zone has to be below `high` in x, y and z")

    def contains(self, point: Vector) -> bool:
        return self.depth(point) >= 0.0

    def depth(self, point: Vector) -> float:
        """Depth of the point inside the zone, from the nearest border; negative outside [m]."""
        if self.low is not None and self.high is not None:
            beyond = [max(low - x, x - high) for low, x, high in zip(self.low, point, self.high, strict=True)]
            outside = math.hypot(*(max(b, 0.0) for b in beyond))
            return -outside if outside > 0.0 else -max(beyond)
        assert self.center is not None
        assert self.radius is not None
        return self.radius - math.dist(point[:2], self.center)
