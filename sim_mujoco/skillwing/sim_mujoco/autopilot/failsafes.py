"""What makes the autopilot act by itself, and which of several reasons goes first.

In this order: a rotor has failed, navigation is lost, the battery is critical (with each of these it lands, and does
not take off), the safety pilot flies, setpoints have ended (hold, then land), the fence is near (stop and hold). What
cannot be flown on with comes before what could, and what the pilot can decide comes after the pilot.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from skillwing.onboard.geofence import Box
from skillwing.sim_mujoco.physics.battery import CELLS

NAVIGATION_REGAINED = 2.0
"""How long navigation has to be good before it is trusted again [s]."""
CRITICAL_CHARGE, CRITICAL_VOLTAGE = 8.0, 3.3 * CELLS
"""Of the battery, for coming down from anywhere under the ceiling with a good reserve [%], [V]."""
_VOLTAGE_SMOOTHING = 2.0


class Mode(StrEnum):
    """What the autopilot is doing. The values of the failsafe modes are what it tells others."""

    OFF = "rotors off"
    FOLLOW = "following setpoints"
    PILOT = "safety pilot flies"
    HOVER = "no setpoints: holding position"
    LAND = "no setpoints: landing"
    FENCE = "fence ahead: holding position"
    BATTERY = "battery critical: landing"
    NAVIGATION = "no navigation: landing"
    ROTOR = "rotor failed: landing"


LANDING = (Mode.ROTOR, Mode.NAVIGATION, Mode.BATTERY, Mode.LAND)
OVERRULING = (Mode.ROTOR, Mode.NAVIGATION, Mode.BATTERY, Mode.FENCE)
"""In these modes setpoints are ignored, however fresh."""


@dataclass(frozen=True, slots=True)
class Limits:
    """When the autopilot steps in: below this charge [%] or this voltage [V], and at this fence."""

    fence: Box | None = None
    charge: float = CRITICAL_CHARGE
    voltage: float = CRITICAL_VOLTAGE


class Emergencies:
    """What no setpoint can change. A failed rotor stays failed, and a critical battery critical, until restarted."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.rotor: int | None = None
        """The rotor that has failed (0 to 5)."""
        self._critical = False
        self._voltage: float | None = None
        self._lost, self._good_since = False, 0.0
        self.blind = False
        """Navigation is lost, and not even the velocity can be flown on."""

    def navigation(self, t: float, *, valid: bool, velocity_valid: bool) -> None:
        """Whether navigation vouches for the position at `t`, and for the velocity."""
        if not valid:
            self._lost, self._good_since = True, t
        elif t - self._good_since >= NAVIGATION_REGAINED:
            self._lost = False
        self.blind = self._lost and not velocity_valid

    def battery(self, percent: float, voltage: float, dt: float) -> None:
        """Charge [%] and voltage under load [V], `dt` seconds after the last ones; short sags do not count."""
        last = voltage if self._voltage is None else self._voltage
        self._voltage = last + (voltage - last) * dt / (_VOLTAGE_SMOOTHING + dt)
        if percent < self._limits.charge or self._voltage < self._limits.voltage:
            self._critical = True

    @property
    def mode(self) -> Mode | None:
        """The landing that is called for."""
        if self.rotor is not None:
            return Mode.ROTOR
        if self._lost:
            return Mode.NAVIGATION
        return Mode.BATTERY if self._critical else None

    @property
    def what(self) -> str:
        """What has happened, in words; empty if nothing."""
        if self.rotor is not None:
            return f"rotor {self.rotor + 1} failed"
        mode = self.mode
        return "" if mode is None else mode.value.partition(":")[0]
