"""What befalls a drone on a flight of a campaign: a condition, and what the flight's seed makes of it."""

from __future__ import annotations

import math
import random
from enum import StrEnum
from typing import Any

import msgspec

SENSOR_FAULTS = ("blackout", "freeze", "noise", "bias", "dropout", "slow")
EARLIEST = 2.0
"""Robot time at which the mission is about to take off [s]."""


class Condition(StrEnum):
    """By the names that the command line knows."""

    NONE = "none"
    CAMERA = "camera"
    LIDAR = "lidar"
    BOTH = "both"
    GUST = "gust"
    BATTERY = "battery"
    PILOT = "pilot"
    PILOT_RETURNS = "pilot-returns"

    @property
    def summary(self) -> str:
        return _SUMMARIES[self]


_SUMMARIES = {
    Condition.NONE: "nothing goes wrong",
    Condition.CAMERA: "the depth camera fails, in one of six ways, for a while or for good",
    Condition.LIDAR: "the LiDAR fails in the same ways",
    Condition.BOTH: "both of them fail, each at its own time",
    Condition.GUST: "wind of 4 to 9 m/s from anywhere",
    Condition.BATTERY: "the battery is charged so little that the drone has to come home early, or land",
    Condition.PILOT: "the safety pilot takes the authority and keeps it",
    Condition.PILOT_RETURNS: "the safety pilot takes the authority, and gives it back some seconds later",
}


class Handover(msgspec.Struct, frozen=True, kw_only=True):
    """At robot time `at` [s] the safety pilot gives the computer the authority, or takes it."""

    at: float
    authority: bool


class Circumstances(msgspec.Struct, frozen=True, kw_only=True):
    """What a flight meets. simulation: options of the functional layer; pilot: what the safety pilot does."""

    simulation: dict[str, Any] = {}
    pilot: tuple[Handover, ...] = ()


def draw(condition: Condition, seed: int, flight_time: float) -> Circumstances:
    """The circumstances of a flight that takes about `flight_time` seconds of robot time if nothing goes wrong.

    They follow from condition and seed alone, and differ from those of any other condition with the same seed.
    """
    chance = random.Random(f"{condition} {seed}")

    def moment() -> float:
        return round(chance.uniform(EARLIEST, flight_time), 2)

    simulation: dict[str, Any] = {}
    pilot: list[Handover] = []
    match condition:
        case Condition.NONE:
            pass
        case Condition.CAMERA:
            simulation["faults"] = [_sensor_fault(chance, "zed", moment())]
        case Condition.LIDAR:
            simulation["faults"] = [_sensor_fault(chance, "lidar", moment())]
        case Condition.BOTH:
            simulation["faults"] = [_sensor_fault(chance, sensor, moment()) for sensor in ("zed", "lidar")]
        case Condition.GUST:
            speed, bearing = chance.uniform(4.0, 9.0), chance.uniform(0.0, 2.0 * math.pi)
            simulation["wind"] = [round(speed * math.cos(bearing), 2), round(speed * math.sin(bearing), 2), 0.0]
        case Condition.BATTERY:
            simulation["battery"] = round(chance.uniform(30.2, 37.0), 2)
        case Condition.PILOT | Condition.PILOT_RETURNS:
            taken = moment()
            pilot = [Handover(at=taken, authority=False)]
            if condition is Condition.PILOT_RETURNS:
                pilot.append(Handover(at=round(taken + chance.uniform(2.0, 15.0), 2), authority=True))
    return Circumstances(simulation=simulation, pilot=tuple(pilot))


def _sensor_fault(chance: random.Random, sensor: str, at: float) -> dict[str, Any]:
    fault: dict[str, Any] = {"sensor": sensor, "kind": chance.choice(SENSOR_FAULTS), "at": at}
    if chance.random() < 0.5:
        fault["for"] = round(chance.uniform(3.0, 30.0), 2)
    return fault
