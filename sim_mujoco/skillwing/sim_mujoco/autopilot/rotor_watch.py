"""Detection of a weak rotor from the rotation of the drone.

The torque of the commanded thrusts is compared with the torque that the angular rate shows. The direction of the
difference points to the rotor: the arm of a lost rotor drops. Nothing is measured at the rotors.
"""

from __future__ import annotations

import math

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.physics.hexacopter import ARM, ROTOR_LAG, ROTORS, Airframe

PERIOD = 0.02
"""Period of the comparison [s]."""
LOST_SHARE, LOST_THRUST = 0.35, 4.0
"""A rotor that lacks more than this share of its thrust, and more than this thrust [N], has failed."""
_SMOOTHING = 0.04
_CONFIRMATIONS = 4
_STRAY = 0.5
"""Unexplained torque, as a share of the explained one, above which something other than a rotor acts."""


class RotorWatch:
    """Watch over six rotors. Call `commanded` at every step, and `update` every 20 ms."""

    def __init__(self, airframe: Airframe) -> None:
        self._inertia = airframe.inertia
        self._roll, self._pitch = airframe.allocation[1].tolist(), airframe.allocation[2].tolist()
        self._keep = math.exp(-PERIOD / ROTOR_LAG)
        self.reset()

    def reset(self) -> None:
        """Start again with rotors that stand still."""
        self._sum, self._steps = [0.0] * ROTORS, 0
        self._thrusts = [0.0] * ROTORS
        self._rate: Vector | None = None
        self._missing = (0.0, 0.0)
        self._suspect: tuple[int, int] = (-1, 0)

    def commanded(self, thrusts: list[float]) -> None:
        """Take the rotor thrusts (6) [N] that are commanded at this step."""
        self._sum = [a + b for a, b in zip(self._sum, thrusts, strict=True)]
        self._steps += 1

    def update(self, rate: Vector) -> int | None:
        """The rotor (0 to 5) that has failed, once the angular rate (FLU) has shown it for long enough."""
        if self._steps == 0:
            return None
        commanded = [s / self._steps for s in self._sum]
        self._sum, self._steps = [0.0] * ROTORS, 0
        after = [k * self._keep + (1.0 - self._keep) * u for k, u in zip(self._thrusts, commanded, strict=True)]
        given = [0.5 * (a + b) for a, b in zip(self._thrusts, after, strict=True)]
        before, self._thrusts, self._rate = self._rate, after, rate
        if before is None:
            return None
        self._smooth(before, rate, given)
        return self._confirmed(self._withholding(given))

    def _smooth(self, before: Vector, rate: Vector, given: list[float]) -> None:
        """Missing torque about x and y [N m]: commanded less measured, smoothed."""
        ix, iy, iz = self._inertia
        p, q, r = (0.5 * (a + b) for a, b in zip(before, rate, strict=True))
        measured = (
            ix * (rate[0] - before[0]) / PERIOD + (iz - iy) * q * r,
            iy * (rate[1] - before[1]) / PERIOD + (ix - iz) * r * p,
        )
        wanted = (
            sum(a * f for a, f in zip(self._roll, given, strict=True)),
            sum(a * f for a, f in zip(self._pitch, given, strict=True)),
        )
        k = PERIOD / (PERIOD + _SMOOTHING)
        x, y = self._missing
        self._missing = x + k * (wanted[0] - measured[0] - x), y + k * (wanted[1] - measured[1] - y)

    def _withholding(self, given: list[float]) -> int | None:
        """The single rotor that explains the missing torque, if there is one."""
        x, y = self._missing
        lost = [(x * a + y * b) / ARM**2 for a, b in zip(self._roll, self._pitch, strict=True)]
        rotor = lost.index(max(lost))
        stray = abs(x * self._pitch[rotor] - y * self._roll[rotor]) / ARM**2
        found = lost[rotor] > max(LOST_THRUST, LOST_SHARE * given[rotor]) and stray < _STRAY * lost[rotor]
        return rotor if found else None

    def _confirmed(self, rotor: int | None) -> int | None:
        if rotor is None:
            self._suspect = (-1, 0)
            return None
        suspect, count = self._suspect
        self._suspect = rotor, count + 1 if rotor == suspect else 1
        return rotor if self._suspect[1] >= _CONFIRMATIONS else None
