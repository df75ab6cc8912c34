"""Where the skills of this drone may send it: guidance tells, and enforces it; managers check it beforehand."""

from __future__ import annotations

import math

from skillwing.m600.latest import Latest
from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.guidance import GEOFENCE
from skillwing.onboard.topics.guidance import Geofence as Box
from skillwing.services.bus import Bus

HOME = (0.0, 0.0)
"""The home point: frames of the functional layer have their origin there (ENU, m)."""


class Geofence:
    """The box in which every target has to lie (ENU, m), as guidance has told it.

    Until it has, nothing is refused here: guidance itself refuses what lies outside.
    """

    def __init__(self, bus: Bus) -> None:
        self._told = Latest(bus, GEOFENCE, Box, events=True)

    @property
    def ceiling(self) -> float:
        """Height of the highest target [m]."""
        return math.inf if self._told.value is None else self._told.value.high[2]

    def refusal(self, target: Vector3) -> str | None:
        """What is wrong with a target, and what to do; None if it lies inside."""
        box = self._told.value
        if box is None or all(low <= x <= high for low, x, high in zip(box.low, target, box.high, strict=True)):
            return None
        bounds = f"{_text(box.low)} and {_text(box.high)}"
        return f"The target {_text(target)} lies outside the geofence. Stay between {bounds}."

    def nearest_inside(self, place: Vector3) -> Vector3:
        """The place itself, or the nearest one inside: the drone may hover a little outside, but not be sent there."""
        box = self._told.value
        if box is None:
            return place
        x, y, z = (min(max(low, x), high) for low, x, high in zip(box.low, place, box.high, strict=True))
        return x, y, z


def _text(place: Vector3) -> str:
    return "({:g}, {:g}, {:g})".format(*place)
