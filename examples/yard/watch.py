"""The process that watches the places of the yard by the positions that the robots publish themselves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from skillwing.dsl import load
from skillwing.services.bus import Answer, Bus, MultiRobotBus, Sample
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.options import required
from skillwing.services.protocol import DataSample, Keys, ProtocolError, decode, encode

from .places import CLEAR_TIME, UNCLEAR, Place, PlacesCore, read_places

PERIOD = 0.2
"""Seconds between two observations: the period of the data."""


class PlacesNode:
    """Shell of `PlacesCore`: it publishes the data of the yard, and reports places that are empty or wrongly used.

    robots: name of the skillset of each robot. positions: name of the datum with `x` and `y` in m.
    """

    name = "places"
    owns_clock = False

    def __init__(
        self, skillset: Path, places: tuple[Place, ...], robots: Mapping[str, str], positions: str = "position"
    ) -> None:
        self._skillset = load(skillset)
        self._robots = dict(robots)
        self._positions = positions
        self._core = PlacesCore(places, robots)
        self._asked: set[str] = set()

    def attach(self, bus: Bus) -> None:
        if not isinstance(bus, MultiRobotBus):
            raise TypeError(f"{self.name} watches several robots, and needs a bus that reaches them")
        self._bus = bus
        self._interface = SkillsetInterface(bus, self._skillset, client=self.name)
        keys = Keys(self._skillset.name)
        self._out = {item.name: bus.advertise(keys.data(item.name)) for item in self._skillset.data}
        for robot, skillset in self._robots.items():
            view = bus.beside(robot)
            key = Keys(skillset).data(self._positions)
            view.subscribe(key, lambda sample, robot=robot: self._hear(robot, sample), latest_only=True)
        bus.every(PERIOD, self._observe)
        bus.declare_alive(keys.alive(self.name))

    def detach(self) -> None:
        """Leave without a word: the data become stale, and no place becomes free."""

    def _hear(self, robot: str, sample: Sample) -> None:
        """Take a position. One that cannot be read counts as none: the robot may be anywhere."""
        try:
            at = cast(Mapping[str, Any], decode(sample.payload, DataSample).value)
            x, y = float(at["x"]), float(at["y"])
        except (ProtocolError, TypeError, KeyError, ValueError):
            return
        self._core.hear(robot, x, y, self._bus.wall())

    def _observe(self) -> None:
        t = self._bus.wall()
        for place in self._core.places:
            state = self._interface.state(place.name) or ""
            empty = self._core.empty_for(place, state, self._interface.change_record(place.name), t)
            self._put(f"{place.name}_robot", self._core.occupant(place, t))
            self._put(f"{place.name}_empty", empty)
            # The resource manager decides by the data, which arrive there first.
            if empty > CLEAR_TIME + PERIOD:
                self._ask(place, lambda take, place=place: self._interface.fire(f"{place.name}_cleared", take))
            elif self._core.has_intruder(place, state, t):
                self._ask(place, lambda take, place=place: self._interface.trigger(place.name, UNCLEAR, take))

    def _ask(self, place: Place, ask: Any) -> None:
        """Ask once at a time for each place; after a refusal the next observation decides again."""
        if place.name in self._asked:
            return
        self._asked.add(place.name)

        def answered(answer: Answer) -> None:
            del answer
            self._asked.discard(place.name)

        ask(answered)

    def _put(self, name: str, value: object) -> None:
        self._out[name].put(encode(DataSample(name=name, value=value, t=self._bus.now())))


def make_places(options: dict[str, Any]) -> PlacesNode:
    """Options: `skillset`, its file; `places`, borders in m by name; `robots`, name of the skillset by robot."""
    places, robots = read_places(options["places"]), options["robots"]
    return PlacesNode(Path(required(options, "skillset")), places, robots)
