"""Conditions that a run watches: the robot is ready, the drone is in the air, robot time advances."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from skillwing.bt_missions.leaves.interface import RobotInterface
from skillwing.bt_missions.leaves.takeoff_and_landing import FLIGHT_STATUS, IN_AIR, LAND, flies, may_land
from skillwing.dsl.model import Skillset
from skillwing.dsl.queries import taken_by
from skillwing.services.bus import Handle, Timers

CLOCK_TIMEOUT = 15.0
"""Longest time for which robot time may stand still during a flight, in seconds of wall time."""


class Readiness:
    """Start condition of a mission. needs: for each resource, the states in one of which it has to be."""

    def __init__(self, interface: RobotInterface, needs: Mapping[str, tuple[str, ...]]) -> None:
        self.time_is_known = False
        self._interface = interface
        self._needs = needs

    @property
    def missing(self) -> str:
        """All that the robot still lacks, as a text; empty if it is ready."""
        if not self._interface.ready:
            return "waiting for the resource manager"
        if not self.time_is_known:
            return "waiting for the robot's clock"
        states = self._interface.states
        lacks = [
            f"{resource} is {states.get(resource, 'not known')} instead of {' or '.join(wanted)}"
            for resource, wanted in self._needs.items()
            if states.get(resource) not in wanted
        ]
        return "waiting: " + "; ".join(lacks) if lacks else ""

    @property
    def starts_in_air(self) -> bool:
        """True if the mission may start with the drone in the air."""
        return IN_AIR in self._needs.get(FLIGHT_STATUS, (IN_AIR,))


class AirborneCheck:
    """Check for a drone in the air at the start and at the end of a mission. Robots without skills to fly never are."""

    def __init__(self, interface: RobotInterface, skillset: Skillset) -> None:
        self._interface = interface
        self._skillset = skillset
        self._began_in_air = False

    def begin(self) -> None:
        """Note the start of the mission. A drone that is in the air now may be left there."""
        self._began_in_air = self.is_in_air

    @property
    def is_in_air(self) -> bool:
        return flies(self._skillset) and self._interface.state(FLIGHT_STATUS) == IN_AIR

    @property
    def has_to_land(self) -> bool:
        """True if the mission has brought the drone up, has not landed it, and may: no safety pilot has it."""
        return self.is_in_air and not self._began_in_air and may_land(self._skillset, self._interface.states)

    @property
    def nobody_flies(self) -> bool:
        """True if the drone is in the air, no skill controls it, and it may be landed."""
        states = self._interface.states
        if not self.is_in_air or not may_land(self._skillset, states):
            return False
        return not any(
            states.get(resource) == state for resource, state in taken_by(self._skillset.skill(LAND)).items()
        )


class ClockWatchdog:
    """Calls `on_still` once robot time stands still for `CLOCK_TIMEOUT`: then no deadline in robot time would pass."""

    def __init__(self, bus: Timers, on_still: Callable[[], None]) -> None:
        self._bus = bus
        self._on_still = on_still
        self._check_later(bus.now())

    def cancel(self) -> None:
        self._handle.cancel()

    def _check_later(self, last: float) -> None:
        self._handle: Handle = self._bus.after(CLOCK_TIMEOUT, lambda: self._check(last), wall=True)

    def _check(self, last: float) -> None:
        now = self._bus.now()
        if now > last:
            self._check_later(now)
        else:
            self._on_still()
