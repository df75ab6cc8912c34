"""The radio: bandwidth, latency and loss at the drone's position, from distance, zones and faults.

Bandwidth falls with the square of the distance, as received power does in free space (Friis, 1946), up to the modem's
fastest modulation. A zone with a worse link replaces that: a valley, the far side of a building, a jammer. At its rim
the two blend over `edge` metres, so that nothing jumps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal, TypeAlias

import msgspec

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.faults import Megabits
from skillwing.sim_mujoco.sensors.faults import (
    Fault,
    FaultSchedule,
    Seconds,
    UnknownFaultError,
    Zone,
    check_no_magnitude,
)
from skillwing.sim_mujoco.world.site import InspectionTarget

MEGABIT = 1e6
FLOOR = 1.0
"""Least bandwidth for blending, because logarithms are blended [bit/s]."""

NARROW, CUT = "narrow", "cut"
FAULTS = (NARROW, CUT)
LinkFaultKind: TypeAlias = Literal["narrow", "cut"]
Latency: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]
Share: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Metres: TypeAlias = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]


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


@dataclass(frozen=True, slots=True)
class Conditions:
    """Bandwidth [bit/s], latency [s], and share of lost packets."""

    bandwidth: float
    latency: float
    loss: float


POOR, CRITICAL = 0.4, 0.008
"""Bandwidth beside a building and behind it, as seen from home [Mbit/s]."""
RIM = 30.0
"""Distance to which an occlusion zone reaches beyond the circle round the building [m]."""
LOW, HIGH = -10.0, 100.0


def occlusion_zones(target: InspectionTarget) -> tuple[RadioZone, RadioZone]:
    """Zones beside a building and behind it, which lose the video there. Home lies to the west of the building."""
    (x, y), radius = target.centre, target.radius

    def east_of(west: float, bandwidth: float) -> RadioZone:
        low, high = (west, y - radius - RIM, LOW), (x + radius + RIM, y + radius + RIM, HIGH)
        return RadioZone(low=low, high=high, bandwidth=bandwidth)

    return east_of(x - 0.3 * radius, POOR), east_of(x + 0.6 * radius, CRITICAL)


USUAL_NARROW = 0.15
"""Default bandwidth of a narrow link [Mbit/s]."""


def check_link_fault(kind: str, magnitude: float | None = None) -> None:
    """Raise UnknownFaultError for a kind that does not exist, MagnitudeError for a magnitude of a cut link."""
    if kind not in FAULTS:
        raise UnknownFaultError("kind of link fault", kind, FAULTS)
    if kind == CUT:
        check_no_magnitude(kind, magnitude)


class Radio:
    """Conditions by position and time. No I/O; scheduled faults are switched when time has passed."""

    def __init__(self, options: RadioOptions) -> None:
        self._options = options
        self._schedule = FaultSchedule(fault.scheduled for fault in options.faults)
        self._faults: dict[str, float | None] = {}

    def switch(self, t: float, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a fault by hand at robot time `t` [s], until it is switched again, by hand or by the schedule.

        `magnitude` is the bandwidth of a narrow link [Mbit/s]. Raises UnknownFaultError and MagnitudeError.
        """
        check_link_fault(kind, magnitude)
        self._follow_schedule(t)
        self._set(kind, on, magnitude)

    def _follow_schedule(self, t: float) -> None:
        # These faults do not depend on the position.
        for fault, on in self._schedule.switches(t, (0.0, 0.0, 0.0)):
            self._set(fault.kind, on, fault.magnitude)

    def _set(self, kind: str, on: bool, magnitude: float | None) -> None:
        if on:
            self._faults[kind] = magnitude
        else:
            self._faults.pop(kind, None)

    def at(self, t: float, position: Vector) -> Conditions:
        """Conditions at robot time `t` [s] with the drone at `position` (ENU, the ground station at 0)."""
        self._follow_schedule(t)
        options = self._options
        distance = math.hypot(*position)
        open_air = Conditions(
            options.bandwidth * MEGABIT / (1.0 + (distance / options.reach) ** 2), options.latency, options.loss
        )
        found = open_air
        for zone in options.zones:
            found = _worst(found, _inside(open_air, zone, zone.depth(position)))
        return self._with_faults(found)

    def faults(self, t: float) -> tuple[str, ...]:
        """The kinds of fault that are on at robot time `t` [s]."""
        self._follow_schedule(t)
        return tuple(kind for kind in FAULTS if kind in self._faults)

    def _with_faults(self, conditions: Conditions) -> Conditions:
        """Conditions with the active faults."""
        if CUT in self._faults:
            return replace(conditions, bandwidth=0.0, loss=1.0)
        if NARROW in self._faults:
            left = self._faults[NARROW]
            limit = (USUAL_NARROW if left is None else left) * MEGABIT
            return replace(conditions, bandwidth=min(conditions.bandwidth, limit))
        return conditions


def _inside(outside: Conditions, zone: RadioZone, depth: float) -> Conditions:
    """Conditions at a depth in the zone: its full effect from the rim inwards, none at `edge` outside."""
    share = min(1.0, max(0.0, 1.0 + depth / zone.edge))
    share = share * share * (3.0 - 2.0 * share)
    bandwidth, latency, loss = outside.bandwidth, outside.latency, outside.loss
    if zone.bandwidth is not None:
        within = max(zone.bandwidth * MEGABIT, FLOOR)
        bandwidth = max(bandwidth, FLOOR) ** (1.0 - share) * within**share
    if zone.latency is not None:
        latency += share * (zone.latency - latency)
    if zone.loss is not None:
        loss += share * (zone.loss - loss)
    return Conditions(bandwidth, latency, loss)


def _worst(one: Conditions, other: Conditions) -> Conditions:
    return Conditions(min(one.bandwidth, other.bandwidth), max(one.latency, other.latency), max(one.loss, other.loss))
