"""The mixer: from total thrust and body torque to the thrusts of six rotors, of which one may be lost.

A hexacopter whose rotors turn alternately left and right loses yaw control with one rotor. The opposite rotor stands
still, because nothing balances its torque; the other four carry the weight. They control thrust, roll and pitch, and
their reaction torques follow from roll and pitch. See G.-X. Du, Q. Quan, K.-Y. Cai, "Controllability analysis and
degraded control for a class of hexacopters subject to rotor failures", J. Intelligent and Robotic Systems 78, 2015. The
opposite rotor can still turn the drone one way, which brakes the rotation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector, clamp
from skillwing.sim_mujoco.physics.hexacopter import MAX_THRUST, MIN_THRUST, ROTORS, Airframe

_Row = tuple[float, float, float, float]


class Mixer:
    """Allocation of thrust and torque. Attitude comes before lift, and yaw gets the remaining range of the rotors."""

    def __init__(self, airframe: Airframe) -> None:
        self._allocation = airframe.allocation
        self._lowest = [MIN_THRUST] * ROTORS
        self._rows = _rows(np.linalg.pinv(self._allocation))
        self._yaw_of_thrust = [0.0] * ROTORS
        self.lost: int | None = None

    def drop(self, rotor: int) -> None:
        """Do without this rotor (0 to 5) from now on, and without yaw."""
        opposite = (rotor + ROTORS // 2) % ROTORS
        carriers = [r for r in range(ROTORS) if r not in (rotor, opposite)]
        turning = [r for r in range(ROTORS) if r != rotor]
        matrix = np.zeros((ROTORS, 4))
        matrix[np.ix_(carriers, range(3))] = np.linalg.pinv(self._allocation[:3, carriers])
        matrix[turning, 3] = np.linalg.pinv(self._allocation[:, turning])[:, 3]
        self._rows = _rows(matrix)
        self._yaw_of_thrust = self._allocation[3].tolist()
        # The motor of the opposite rotor may stop, because even an idling rotor would turn the drone.
        self._lowest = [0.0 if r in (rotor, opposite) else MIN_THRUST for r in range(ROTORS)]
        self.lost = rotor

    def thrusts(self, total: float, torque: Vector) -> list[float]:
        """Rotor thrusts (6) [N] for a total thrust [N] and a torque [N m] about the body's axes."""
        x, y, z = torque
        lifts = [total * lift + x * roll + y * pitch for lift, roll, pitch, _ in self._rows]
        over = max(lifts) - MAX_THRUST
        if over > 0.0:
            less = over / max(row[0] for row in self._rows)
            lifts = [lift - less * row[0] for lift, row in zip(lifts, self._rows, strict=True)]
        if self.lost is not None:
            z -= sum(yaw * lift for yaw, lift in zip(self._yaw_of_thrust, lifts, strict=True))
        turns = [row[3] * z for row in self._rows]
        share = self._share(lifts, turns)
        limits = zip(lifts, turns, self._lowest, strict=True)
        thrusts = [clamp(lift + share * turn, low, MAX_THRUST) for lift, turn, low in limits]
        if self.lost is not None:
            thrusts[self.lost] = 0.0
        return thrusts

    def _share(self, lifts: list[float], turns: list[float]) -> float:
        """Share of the wanted yaw torque that keeps all rotors within their limits."""
        share = 1.0
        for lift, turn, low in zip(lifts, turns, self._lowest, strict=True):
            if turn > 0.0 and lift + turn > MAX_THRUST:
                share = min(share, max(0.0, (MAX_THRUST - lift) / turn))
            elif turn < 0.0 and lift + turn < low:
                share = min(share, max(0.0, (low - lift) / turn))
        return share


def _rows(matrix: NDArray[np.floating]) -> list[_Row]:
    return [(float(a), float(b), float(c), float(d)) for a, b, c, d in matrix.tolist()]
