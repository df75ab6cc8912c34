"""Extents: boxes in the world frame, and the radius of the drone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import msgspec

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.common import Vector3

TIP_RADIUS: Final = 0.84
"""Radius of a sphere around the drone's centre that holds the whole drone, up to the tips of its blades [m]."""


@dataclass(frozen=True, slots=True)
class Box:
    """An axis-aligned box in the world frame [m]."""

    low: Vector
    high: Vector

    def contains(self, point: Vector, margin: float = 0.0) -> bool:
        """Test for a point inside, or outside by at most `margin`."""
        return all(low - margin <= x <= high + margin for low, x, high in zip(self.low, point, self.high, strict=True))


class FenceOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box as an option of a node: `{"low": [x, y, z], "high": [x, y, z]}` [m]."""

    low: Vector3
    high: Vector3

    @property
    def box(self) -> Box:
        return Box(self.low, self.high)
