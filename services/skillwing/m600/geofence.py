"""The geofence: guidance publishes and enforces it; managers check targets against it beforehand."""

from __future__ import annotations

import math

from skillwing.m600.latest import Latest
from skillwing.onboard.topics.common import Vector2, Vector3
from skillwing.onboard.topics.guidance import GEOFENCE, Geofence
from skillwing.services.bus import Bus

HOME = (0.0, 0.0)
"""The usual home point: frames of the functional layer have their origin there (ENU, m)."""


class GeofenceChecker:
    """A check of targets against the box that guidance published, and the home point in it (ENU, m).

    Before the first publication, managers refuse no target; guidance itself refuses those outside.
    """

    def __init__(self, bus: Bus) -> None:
        self._box = Latest(bus, GEOFENCE, Geofence, events=True)

    @property
    def home(self) -> Vector2:
        """The drone's home point; the usual one before the first publication."""
        return HOME if self._box.value is None else self._box.value.home

    @property
    def ceiling(self) -> float:
        """Height of the highest target [m]."""
        return math.inf if self._box.value is None else self._box.value.high[2]

    def refusal(self, target: Vector3) -> str | None:
        """The reason to refuse a target, and advice; None if it lies inside."""
        box = self._box.value
        if box is None or all(low <= x <= high for low, x, high in zip(box.low, target, box.high, strict=True)):
            return None
        bounds = f"{_text(box.low)} and {_text(box.high)}"
        return f"The target {_text(target)} lies outside the geofence. Stay between {bounds}."

    def nearest_inside(self, place: Vector3) -> Vector3:
        """The place itself, or the nearest one inside: a drone may hover a little outside, but no target lies there."""
        box = self._box.value
        if box is None:
            return place
        x, y, z = (min(max(low, x), high) for low, x, high in zip(box.low, place, box.high, strict=True))
        return x, y, z


def _text(place: Vector3) -> str:
    return "({:g}, {:g}, {:g})".format(*place)
