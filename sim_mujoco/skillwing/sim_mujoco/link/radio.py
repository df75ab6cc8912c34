"""The radio: bandwidth, latency and loss at the drone's position, from distance, zones and faults.

Bandwidth falls with the square of the distance, as received power does in free space (Friis, 1946), up to the modem's
fastest modulation. A zone with a worse link replaces that: a valley, the far side of a building, a jammer. At its rim
the two blend over `edge` metres, so that nothing jumps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.scenario.format import CUT, LINK_FAULTS, NARROW, RadioOptions, RadioZone, check_link_fault
from skillwing.sim_mujoco.sensors.faults import FaultSchedule
from skillwing.sim_mujoco.world.site import InspectionTarget

MEGABIT = 1e6
FLOOR = 1.0
"""Least bandwidth for blending, because logarithms are blended [bit/s]."""


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


class Radio:
    """Conditions by position and time. No I/O; scheduled faults are switched when time has passed."""

    def __init__(self, options: RadioOptions) -> None:
        self._options = options
        self._schedule = FaultSchedule(fault.scheduled for fault in options.faults)
        self._faults: dict[str, float | None] = {}
        self._since: dict[str, float] = {}

    def switch(self, t: float, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a fault by hand at robot time `t` [s], until it is switched again, by hand or by the schedule.

        `magnitude` is the bandwidth of a narrow link [Mbit/s]. Raises UnknownFaultError and MagnitudeError.
        """
        check_link_fault(kind, magnitude)
        self._follow_schedule(t)
        self._set(t, kind, on, magnitude)

    def _follow_schedule(self, t: float) -> None:
        # These faults do not depend on the position.
        for fault, on in self._schedule.switches(t, (0.0, 0.0, 0.0)):
            self._set(t, fault.kind, on, fault.magnitude)

    def _set(self, t: float, kind: str, on: bool, magnitude: float | None) -> None:
        if on:
            self._faults[kind] = magnitude
            self._since.setdefault(kind, t)
        else:
            self._faults.pop(kind, None)
            self._since.pop(kind, None)

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
        return tuple(kind for kind in LINK_FAULTS if kind in self._faults)

    def fault_since(self, kind: str) -> float:
        """Robot time [s] at which a fault that is on was switched on."""
        return self._since[kind]

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
