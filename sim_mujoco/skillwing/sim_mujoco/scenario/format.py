"""The format of scenario files: what happens to the drone and around it during a flight.

Each section is a structure below; a new one needs a structure and a field of `Scenario`. docs/sensors.md has an
example. Needs neither numpy nor physics.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from skillwing.onboard.topics.faults import Magnitude, Megabits
from skillwing.onboard.topics.mapping import Poses
from skillwing.sim_mujoco.sensors.faults import Fault, Metres, Seconds, UnknownFaultError, Zone, check_no_magnitude
from skillwing.sim_mujoco.sensors.receivers import ReceiverName

STRONGEST_WIND = 50.0
"""Largest component of gusts and of the mean wind [m/s]: 1.5 times the least wind of a hurricane."""
WindSpeed = Annotated[float, msgspec.Meta(ge=-STRONGEST_WIND, le=STRONGEST_WIND)]
WindVector = tuple[WindSpeed, WindSpeed, WindSpeed]
WindStrength = Annotated[float, msgspec.Meta(ge=0.0, le=STRONGEST_WIND)]
Percent = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]
NARROW, CUT = "narrow", "cut"
LINK_FAULTS = (NARROW, CUT)
LinkFaultKind: TypeAlias = Literal["narrow", "cut"]
Latency: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]
Share: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]


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


def check_link_fault(kind: str, magnitude: float | None = None) -> None:
    """Raise UnknownFaultError for a kind that does not exist, MagnitudeError for a magnitude of a cut link."""
    if kind not in LINK_FAULTS:
        raise UnknownFaultError("kind of link fault", kind, LINK_FAULTS)
    if kind == CUT:
        check_no_magnitude(kind, magnitude)


class RadioZone(Zone, frozen=True, forbid_unknown_fields=True):
    """A zone with the link's properties inside it; absent ones stay as outside. Its effect begins at a distance of
    `edge` outside its border [m]."""

    edge: Metres = 4.0
    bandwidth: Megabits | None = None
    latency: Latency | None = None
    loss: Share | None = None


class LinkFaultOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A scheduled fault: `{"kind": "narrow", "at": 60.0}`, optionally with `for` seconds and, of a narrow link, a
    `magnitude`: the Mbit/s that are left. Raises MagnitudeError."""

    kind: LinkFaultKind
    at: Seconds = 0.0
    duration: Seconds | None = None
    magnitude: Megabits | None = None

    def __post_init__(self) -> None:
        check_link_fault(self.kind, self.magnitude)

    @property
    def scheduled(self) -> Fault:
        """The same fault for a schedule."""
        return Fault("link", self.kind, self.at, self.duration, self.magnitude)


class RadioOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The link without zones: `bandwidth` close by [Mbit/s], half of it at `reach` [m], `latency` [s] and `loss`."""

    bandwidth: Megabits = 4.0
    reach: Metres = 200.0
    latency: Latency = 0.03
    loss: Share = 0.0
    zones: tuple[RadioZone, ...] = ()
    faults: tuple[LinkFaultOptions, ...] = ()


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
