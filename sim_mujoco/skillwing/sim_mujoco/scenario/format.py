"""The format of scenario files: what happens to the drone and around it during a flight.

Each section is a structure below; a new one needs a structure and a field of `Scenario`. docs/sensors.md has an
example. Needs neither numpy nor physics.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from skillwing.onboard.topics.faults import Magnitude
from skillwing.onboard.topics.mapping import Poses
from skillwing.sim_mujoco.link.radio import RadioOptions
from skillwing.sim_mujoco.sensors.faults import Seconds, Zone
from skillwing.sim_mujoco.sensors.receivers import ReceiverName

STRONGEST_WIND = 50.0
"""Largest component of gusts and of the mean wind [m/s]: 1.5 times the least wind of a hurricane."""
WindSpeed = Annotated[float, msgspec.Meta(ge=-STRONGEST_WIND, le=STRONGEST_WIND)]
WindVector = tuple[WindSpeed, WindSpeed, WindSpeed]
WindStrength = Annotated[float, msgspec.Meta(ge=0.0, le=STRONGEST_WIND)]
Percent = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]


class FaultOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A scheduled fault: `{"sensor": "zed", "kind": "blackout", "at": 60.0}`, optionally with `for` seconds, a
    `magnitude`, and a `zone` outside of which it is off."""

    sensor: str
    kind: str
    at: Seconds = 0.0
    duration: Seconds | None = None
    magnitude: Magnitude | None = None
    zone: Zone | None = None


class GustOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A gust: `{"at": 30.0, "velocity": [6.0, 0.0, 0.0], "for": 4.0}`, in s and m/s (ENU)."""

    at: Seconds
    velocity: WindVector
    duration: Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]


class PilotOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The safety pilot takes the authority at `at` (`authority` False), or gives it to the computer."""

    at: Seconds
    authority: bool


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Sections that may be repeated (`[[fault]]`), and single values. Absent ones keep their defaults."""

    fault: tuple[FaultOptions, ...] = ()
    gust: tuple[GustOptions, ...] = ()
    pilot: tuple[PilotOptions, ...] = ()
    wind: WindVector | None = None
    turbulence: WindStrength | None = None
    battery: Percent | None = None
    receiver: ReceiverName | None = None
    poses: Poses | None = None
    link: RadioOptions | None = None

    def sim_options(self) -> dict[str, Any]:
        """The scenario as options of the simulator node."""
        single = {"wind": self.wind, "turbulence": self.turbulence, "battery": self.battery, "receiver": self.receiver}
        return {
            "faults": self.fault,
            "gusts": self.gust,
            "pilot": self.pilot,
            **{name: value for name, value in single.items() if value is not None},
        }
