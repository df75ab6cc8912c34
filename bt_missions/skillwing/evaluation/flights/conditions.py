"""Conditions of campaign flights: a kind of fault, and the faults that a seed draws of it."""

from __future__ import annotations

import math
import random
from enum import StrEnum
from typing import Any

SENSOR_FAULTS = ("blackout", "freeze", "noise", "bias", "dropout", "slow")
ROTORS = 6
SIZES = {
    "zed": {"noise": (0.05, 4.0), "bias": (0.1, 4.0)},
    "lidar": {"noise": (0.05, 4.0), "bias": (0.1, 4.0)},
    "gnss": {"noise": (0.05, 100.0), "bias": (0.05, 100.0)},
    "imu": {"noise": (0.02, 20.0), "bias": (0.02, 20.0)},
    "range": {"noise": (0.02, 20.0), "bias": (0.02, 20.0)},
}
"""Least and largest magnitudes by sensor, in its units (docs/sensors.md): from never detected to always detected."""
EARLIEST = 2.0
"""Robot time shortly before takeoff [s]."""
SHORTEST, LONGEST = 2.0, 3.5
"""Duration of a flight without faults, as a multiple of its route's time at cruise speed.

A flight also climbs, turns, brakes, avoids obstacles, returns and lands. 21 mapping flights in courtyards lay between
these values, most near the lower one. The drawn end of a flight lies between them as well.
"""


class Condition(StrEnum):
    """Conditions of flights, by their names in the command line."""

    NONE = "none"
    CAMERA = "camera"
    LIDAR = "lidar"
    BOTH = "both"
    GUST = "gust"
    BATTERY = "battery"
    LINK = "link"
    GNSS = "gnss"
    IMU = "imu"
    RANGE = "range"
    ROTOR = "rotor"
    PILOT = "pilot"
    PILOT_RETURNS = "pilot-returns"

    @property
    def summary(self) -> str:
        return _SUMMARIES[self]


_SUMMARIES = {
    Condition.NONE: "nothing goes wrong",
    Condition.CAMERA: "the depth camera fails, in one of six ways, slightly or badly, for a while or for good",
    Condition.LIDAR: "the LiDAR fails in the same ways",
    Condition.BOTH: "both of them fail, each at its own time",
    Condition.GUST: "wind of 2 to 6 m/s from anywhere, turbulence, and three gusts of 3 to 7 m/s more",
    Condition.BATTERY: "31 to 60 % of charge at take-off, and one to five of the battery's six packs fail",
    Condition.LINK: "the radio link narrows to 0 to 0.3 Mbit/s, for a while or for good",
    Condition.GNSS: "the satellite receiver fails in the ways of the depth camera, by up to 100 m",
    Condition.IMU: "the computer's IMU, which odometry reads, fails in the same ways, by up to 20 m/s2 and 2 rad/s",
    Condition.RANGE: "the range-finder fails in the same ways, by up to 20 m",
    Condition.ROTOR: "one of six rotors stops for good, or keeps 0 to 95 % of its thrust, for a while or for good",
    Condition.PILOT: "the safety pilot takes the authority and keeps it",
    Condition.PILOT_RETURNS: "the safety pilot takes the authority, and gives it back some seconds later",
}

_UNNOTICED = {
    "mapping": frozenset({Condition.LINK}),
    "inspection": frozenset({Condition.CAMERA, Condition.IMU}),
}
"""Conditions without effect on a mission: mapping needs no link; inspection needs no map, and no depth camera while the
LiDAR works."""


def conditions_of(mission: str) -> list[Condition]:
    """Conditions that may affect a mission."""
    return [condition for condition in Condition if condition not in _UNNOTICED.get(mission, frozenset())]


def draw(condition: Condition, seed: int, way_time: float) -> dict[str, Any]:
    """Faults of a flight whose route takes `way_time` seconds at cruise speed, as options of the functional layer.

    They follow from condition, seed and route alone; conditions with the same seed are independent. A fault begins at
    any time of the flight, return and landing included. A fault drawn after the end of a short flight never begins.
    """
    chance = random.Random(f"{condition} {seed}")
    flight_time = way_time * chance.triangular(SHORTEST, LONGEST, SHORTEST)

    def moment() -> float:
        return round(chance.uniform(EARLIEST, flight_time), 2)

    simulation: dict[str, Any] = {}
    match condition:
        case Condition.NONE:
            pass
        case Condition.CAMERA:
            simulation["faults"] = [_sensor_fault(chance, "zed", moment())]
        case Condition.LIDAR:
            simulation["faults"] = [_sensor_fault(chance, "lidar", moment())]
        case Condition.BOTH:
            simulation["faults"] = [_sensor_fault(chance, sensor, moment()) for sensor in ("zed", "lidar")]
        case Condition.GNSS | Condition.IMU | Condition.RANGE:
            simulation["faults"] = [_sensor_fault(chance, condition.value, moment())]
        case Condition.ROTOR:
            simulation["faults"] = [_rotor_fault(chance, moment())]
        case Condition.GUST:
            simulation["wind"] = _wind(chance, 2.0, 6.0)
            simulation["turbulence"] = round(chance.uniform(2.0, 6.0), 2)
            simulation["gusts"] = [
                {"at": moment(), "velocity": _wind(chance, 3.0, 7.0), "for": round(chance.uniform(2.0, 6.0), 2)}
                for _ in range(3)
            ]
        case Condition.BATTERY:
            simulation["battery"] = round(chance.uniform(31.0, 60.0), 2)
            simulation["packs_fail"] = [{"at": moment(), "packs": chance.randint(1, 5)}]
        case Condition.LINK:
            simulation["link"] = {"faults": [_link_fault(chance, moment())]}
        case Condition.PILOT | Condition.PILOT_RETURNS:
            taken = moment()
            simulation["pilot"] = [{"at": taken, "authority": False}]
            if condition is Condition.PILOT_RETURNS:
                back = round(taken + chance.uniform(2.0, 15.0), 2)
                simulation["pilot"].append({"at": back, "authority": True})
    return simulation


def met_from(happens: dict[str, Any]) -> float | None:
    """Robot time at which at least one fault of each kind in these options has begun [s]; None without faults.

    A kind is a sensor, the link, gusts, the pilot, or battery packs. Steady conditions, such as wind, do not count."""
    faults = [*happens.get("faults", ()), *happens.get("link", {}).get("faults", ())]
    kinds = [(fault.get("sensor", "link"), fault["at"]) for fault in faults]
    kinds += [(name, event["at"]) for name in ("gusts", "pilot", "packs_fail") for event in happens.get(name, ())]
    first: dict[str, float] = {}
    for kind, at in kinds:
        first[kind] = min(at, first.get(kind, at))
    return max(first.values(), default=None)


def _wind(chance: random.Random, least: float, most: float) -> list[float]:
    """Level wind of random speed and direction [m/s, ENU]."""
    speed, bearing = chance.uniform(least, most), chance.uniform(0.0, 2.0 * math.pi)
    return [round(speed * math.cos(bearing), 2), round(speed * math.sin(bearing), 2), 0.0]


def _sensor_fault(chance: random.Random, sensor: str, at: float) -> dict[str, Any]:
    kind = chance.choice(SENSOR_FAULTS)
    fault: dict[str, Any] = {"sensor": sensor, "kind": kind, "at": at}
    if (magnitude := _magnitude(chance, sensor, kind)) is not None:
        fault["magnitude"] = magnitude
    return fault | _passing(chance)


def _magnitude(chance: random.Random, sensor: str, kind: str) -> float | None:
    """Magnitude of a sensor's fault; None for kinds that are either on or off."""
    match kind:
        case "noise":
            return _small_or_large(chance, *SIZES[sensor][kind])
        case "bias":
            return chance.choice((-1.0, 1.0)) * _small_or_large(chance, *SIZES[sensor][kind])
        case "dropout":
            return round(chance.uniform(0.2, 0.95), 3)
        case "slow":
            return float(chance.randint(2, 12))
        case _:
            return None


def _rotor_fault(chance: random.Random, at: float) -> dict[str, Any]:
    """Fault of a rotor: stopped for good, or weak. A weak rotor may recover, as when its regulator cools down."""
    fault: dict[str, Any] = {"sensor": f"rotor/{chance.randint(1, ROTORS)}", "at": at}
    if chance.random() < 0.5:
        return fault | {"kind": "stopped"}
    return fault | {"kind": "weak", "magnitude": round(chance.uniform(0.0, 0.95), 3)} | _passing(chance)


def _passing(chance: random.Random) -> dict[str, float]:
    """Duration of a fault [s], drawn with probability 1/2; else empty, for a permanent fault."""
    return {"for": round(chance.uniform(3.0, 30.0), 2)} if chance.random() < 0.5 else {}


def _small_or_large(chance: random.Random, least: float, most: float) -> float:
    """Number with a log-uniform distribution between the limits."""
    return round(math.exp(chance.uniform(math.log(least), math.log(most))), 3)


def _link_fault(chance: random.Random, at: float) -> dict[str, Any]:
    return {"kind": "narrow", "at": at, "magnitude": round(chance.uniform(0.0, 0.3), 3)} | _passing(chance)
