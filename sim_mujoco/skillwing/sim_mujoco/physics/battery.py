"""The battery: six 6S lithium-polymer packs in parallel, as charge, open-circuit voltage and inner resistance.

Open-circuit voltage and the growth of resistance near empty follow M. Chen and G. A. Rincon-Mora, "Accurate electrical
battery model capable of predicting runtime and I-V performance", IEEE Trans. Energy Conversion 21(2), 2006, for
a polymer cell. Capacity and resistance are those of this drone's packs. Temperature, ageing and the model's slow
recovery after load are left out.
"""

from __future__ import annotations

import math

CELLS = 6
"""Cells in series in each pack."""
PACKS = 6
"""Packs in parallel."""
CAPACITY = 27.0 * 3600.0
"""Charge of six packs of 4.5 Ah [A s]."""
_RESISTANCE = 0.009
"""Resistance of charged packs, leads and bus bar [ohm]: 5 milliohm a cell and 4 for the copper."""
_EMPTY_RESISTANCE, _EMPTY_RATE = 2.1, 24.4
_HOVER_THRUST, _HOVER_POWER, _AVIONICS = 137.3, 1700.0, 60.0


def open_circuit_voltage(charge: float) -> float:
    """Voltage of the resting battery at a state of charge of 0 to 1 [V]."""
    cell = 3.685 + 0.2156 * charge - 0.1178 * charge**2 + 0.3201 * charge**3 - 1.031 * math.exp(-35.0 * charge)
    return CELLS * cell


def resistance(charge: float) -> float:
    """Inner resistance at a state of charge of 0 to 1 [ohm]."""
    return _RESISTANCE * (1.0 + _EMPTY_RESISTANCE * math.exp(-_EMPTY_RATE * charge))


class BatteryModel:
    """The battery in flight. Charge is counted in coulombs; power follows from thrust by momentum theory."""

    def __init__(self, percent: float = 100.0) -> None:
        """A battery with this charge. Raises ValueError for one that is not a percentage."""
        if not 0.0 <= percent <= 100.0:
            raise ValueError(f"a battery cannot hold {percent:g} %; give 0 to 100")
        self._charge = percent / 100.0
        self._share = 1.0
        self._current = 0.0
        self.voltage = open_circuit_voltage(self._charge)
        """Voltage at the terminals under the present load [V]."""

    @property
    def percent(self) -> float:
        """Remaining charge, in percent of the capacity of all packs."""
        return 100.0 * self._charge * self._share

    @property
    def current(self) -> float:
        """Current [A]."""
        return self._current

    @property
    def is_empty(self) -> bool:
        """No charge is left, and no rotor turns."""
        return self._charge <= 0.0

    def fail(self, packs: int) -> None:
        """Lose so many packs and their charge; the others carry the load. Raises ValueError if none would be left."""
        left = self._share - packs / PACKS
        if packs < 1 or left < 0.5 / PACKS:
            raise ValueError(f"{packs} of the packs cannot fail; one of {PACKS} has to be left")
        self._share = left

    def drain(self, thrust: float, dt: float) -> None:
        """Deliver the power for `thrust` [N] during `dt` seconds."""
        power = _AVIONICS + _HOVER_POWER * (max(thrust, 0.0) / _HOVER_THRUST) ** 1.5
        rest, inner = open_circuit_voltage(self._charge), resistance(self._charge) / self._share
        # The current I with the power P = (rest - I inner) I. Near empty there may be none: then the largest possible.
        root = math.sqrt(max(0.0, rest * rest - 4.0 * inner * power))
        self._current = (rest - root) / (2.0 * inner)
        self.voltage = rest - self._current * inner
        self._charge = max(0.0, self._charge - self._current * dt / (CAPACITY * self._share))
