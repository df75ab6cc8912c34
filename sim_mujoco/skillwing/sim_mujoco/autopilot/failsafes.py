"""Failsafes of the autopilot, and their priorities.

Highest first: a failed rotor, lost navigation, a critical battery. With each of these it lands, and does not take off.
Then come the safety pilot, the end of setpoints (hold, then land), and the fence (stop and hold). Reasons that rule out
flying come first; reasons that the safety pilot can decide on come after the pilot.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from skillwing.onboard.frames.extent import Box
from skillwing.sim_mujoco.physics.battery import CELLS

NAVIGATION_REGAINED = 2.0
"""Time for which navigation has to be good before it is trusted again [s]."""
CRITICAL_CHARGE, CRITICAL_VOLTAGE = 8.0, 3.3 * CELLS
"""Battery state that still allows a descent from the ceiling, with a good reserve: charge [%], voltage [V]."""
_VOLTAGE_SMOOTHING = 2.0


class Mode(StrEnum):
    """Modes of the autopilot. The values of the failsafe modes are published."""

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
"""Modes in which all setpoints are ignored."""


@dataclass(frozen=True, slots=True)
class FailsafeLimits:
    """Limits of the failsafes: least charge [%], least voltage [V], and the fence."""

    fence: Box | None = None
    charge: float = CRITICAL_CHARGE
    voltage: float = CRITICAL_VOLTAGE


class Emergencies:
    """Emergencies that no setpoint can change. A failed rotor and a critical battery last until the next start."""

    def __init__(self, limits: FailsafeLimits) -> None:
        self._limits = limits
        self.rotor: int | None = None
        """Number of the failed rotor (0 to 5)."""
        self._critical = False
        self._voltage: float | None = None
        self._lost, self._good_since = False, 0.0
        self.blind = False
        """True if navigation is lost and the velocity is not valid either."""

    def navigation(self, t: float, *, valid: bool, velocity_valid: bool) -> None:
        """Take the validity of position and velocity at `t`."""
        if not valid:
            self._lost, self._good_since = True, t
        elif t - self._good_since >= NAVIGATION_REGAINED:
            self._lost = False
        self.blind = self._lost and not velocity_valid

    def battery(self, percent: float, voltage: float, dt: float) -> None:
        """Take charge [%] and voltage under load [V], `dt` seconds after the last ones; short sags do not count."""
        last = voltage if self._voltage is None else self._voltage
        self._voltage = last + (voltage - last) * dt / (_VOLTAGE_SMOOTHING + dt)
        if percent < self._limits.charge or self._voltage < self._limits.voltage:
            self._critical = True

    @property
    def mode(self) -> Mode | None:
        """The landing mode that the worst emergency requires."""
        if self.rotor is not None:
            return Mode.ROTOR
        if self._lost:
            return Mode.NAVIGATION
        return Mode.BATTERY if self._critical else None

    @property
    def reason(self) -> str:
        """Description of the worst emergency; empty without one."""
        if self.rotor is not None:
            return f"rotor {self.rotor + 1} failed"
        mode = self.mode
        return "" if mode is None else mode.value.partition(":")[0]
