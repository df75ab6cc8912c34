"""Occupants of the places of the yard, and the time since when a place is empty: rules without a network.

Only a place that was seen empty becomes free. A robot that is not heard may be anywhere, so no place is empty then.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

CLEAR_TIME = 2.0
"""Seconds for which a place has to be seen empty, as the guards of yard.skillset say. A robot whose lease has ended
notices it, and stops, in less time."""
FRESH = 0.6
"""Seconds for which a position counts, from its arrival on."""
MARGIN = 1.0
"""Distance in m around a place that belongs to it: a robot that stops may slide so far."""
UNKNOWN = "unknown"
UNCLEAR, FREE, HELD = "UNCLEAR", "FREE", "HELD"


@dataclass(frozen=True, slots=True)
class Place:
    """A place on the map, at all heights: its south-west and north-east corners (ENU, m)."""

    name: str
    low: tuple[float, float]
    high: tuple[float, float]

    def covers(self, x: float, y: float, margin: float = 0.0) -> bool:
        """True for a point in the place, or not farther than `margin` from it on each axis."""
        (west, south), (east, north) = self.low, self.high
        return west - margin <= x <= east + margin and south - margin <= y <= north + margin


class PlacesCore:
    """Occupants of the places by the latest positions of these robots. Times are in seconds of one clock."""

    def __init__(self, places: Iterable[Place], robots: Iterable[str]) -> None:
        self.places = tuple(places)
        self._positions: dict[str, tuple[float, float, float] | None] = dict.fromkeys(robots)
        self._empty_since: dict[str, tuple[str | None, float] | None] = {place.name: None for place in self.places}

    def hear(self, robot: str, x: float, y: float, t: float) -> None:
        """Note the position of a robot, in m."""
        self._positions[robot] = (x, y, t)

    def occupant(self, place: Place, t: float) -> str:
        """The robots in a place, with commas; empty for none, `unknown` if a robot is not heard and none is seen."""
        if inside := self._inside(place, t):
            return ", ".join(inside)
        return "" if len(self._heard(t)) == len(self._positions) else UNKNOWN

    def empty_for(self, place: Place, state: str, change: str | None, t: float) -> float:
        """Seconds for which an UNCLEAR place was seen empty; 0 in its other states. Called at each observation.

        change: id of the place's last change. Between two observations it may have been free and held, and a robot may
        be on its way into it: the time counts from the change.
        """
        if state != UNCLEAR or self.occupant(place, t):
            self._empty_since[place.name] = None
            return 0.0
        since = self._empty_since[place.name]
        if since is None or since[0] != change:
            since = self._empty_since[place.name] = change, t
        return t - since[1]

    def has_intruder(self, place: Place, state: str, t: float) -> bool:
        """True if a robot is seen in a place that nobody holds, or more than one in a place that one may use."""
        if state == HELD:
            # The margin is room to stop in: a robot that stands beside a held place is no intruder.
            return len(self._inside(place, t, margin=0.0)) > 1
        return state == FREE and bool(self._inside(place, t))

    def _heard(self, t: float) -> dict[str, tuple[float, float, float]]:
        return {robot: at for robot, at in self._positions.items() if at is not None and t - at[2] <= FRESH}

    def _inside(self, place: Place, t: float, margin: float = MARGIN) -> list[str]:
        return [robot for robot, (x, y, _) in self._heard(t).items() if place.covers(x, y, margin)]


def read_places(given: Mapping[str, Iterable[float]]) -> tuple[Place, ...]:
    """Places from `{"pad": [west, south, east, north]}` in m. Raises ValueError for another number of values."""
    found: list[Place] = []
    for name, borders in given.items():
        west, south, east, north = borders
        found.append(Place(name, (west, south), (east, north)))
    return tuple(found)
