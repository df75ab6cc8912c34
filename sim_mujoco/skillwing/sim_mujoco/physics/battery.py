"""The battery: six 6S lithium-polymer packs side by side, as charge, open-circuit voltage and inner resistance.

Open-circuit voltage and the growth of resistance near empty follow M. Chen and G. A. Rincon-Mora, "Accurate electrical
battery model capable of predicting runtime and I-V performance", IEEE Trans. Energy Conversion 21(2), 2006, fitted
there to a polymer cell; capacity and resistance are those of this drone's packs. Temperature and ageing are left out,
and so is the model's slow recovery after load.
"""

from __future__ import annotations

import math

CELLS = 6
"""Cells in series."""
PACKS = 6
"""Side by side."""
CAPACITY = 27.0 * 3600.0
"""Charge of six packs of 4.5 Ah [A s]."""
_RESISTANCE = 0.009
"""Of all packs, a lead to each, and the bus bar, when charged [ohm]: 5 milliohm a cell and 4 for the copper."""
_EMPTY_RESISTANCE, _EMPTY_RATE = 2.1, 24.4
_HOVER_THRUST, _HOVER_POWER, _AVIONICS = 137.3, 1700.0, 60.0


def open_circuit_voltage(charge: float) -> float:
    """Voltage of the resting battery at a state of charge of 0 to 1 [V]."""
    cell = 3.685 + 0.2156 * charge - 0.1178 * charge**2 + 0.3201 * charge**3 - 1.031 * math.exp(-35.0 * charge)
    return CELLS * cell


def resistance(charge: float) -> float:
    """Inner resistance at a state of charge of 0 to 1 [ohm]."""
    return _RESISTANCE * (1.0 + _EMPTY_RESISTANCE * math.exp(-_EMPTY_RATE * charge))


class Battery:
    """Charge is counted in coulombs, as the packs' own electronics do; power follows from thrust by momentum theory."""

    def __init__(self, percent: float = 100.0) -> None:
        """Raises ValueError for a charge that no battery has."""
        if not 0.0 <= percent <= 100.0:
            raise ValueError(f"a battery cannot hold {percent:g} %; give 0 to 100")
        self._charge = percent / 100.0
        self._share = 1.0
        self._current = 0.0
        self.voltage = open_circuit_voltage(self._charge)
        """At the terminals, under the present load [V]."""

    @property
    def percent(self) -> float:
        """Charge that is left, in percent of what all packs together hold."""
        return 100.0 * self._charge * self._share

    @property
    def current(self) -> float:
        """[A]"""
        return self._current

    @property
    def is_empty(self) -> bool:
        """Nothing is left: no rotor turns any more."""
        return self._charge <= 0.0

    def fail(self, packs: int) -> None:
        """So many of the packs fall out, with what is in them; the others carry the load. Raises ValueError where none
        would be left."""
        left = self._share - packs / PACKS
        if packs < 1 or left < 0.5 / PACKS:
            raise ValueError(f"{packs} of the packs cannot fail; one of {PACKS} has to be left")
        self._share = left

    def drain(self, thrust: float, dt: float) -> None:
        """Give `thrust` [N] for `dt` seconds."""
        power = _AVIONICS + _HOVER_POWER * (max(thrust, 0.0) / _HOVER_THRUST) ** 1.5
        rest, inner = open_circuit_voltage(self._charge), resistance(self._charge) / self._share
        # The current I that gives power P = (rest - I inner) I; near empty there may be none, then the most there is.
        root = math.sqrt(max(0.0, rest * rest - 4.0 * inner * power))
        self._current = (rest - root) / (2.0 * inner)
        self.voltage = rest - self._current * inner
        self._charge = max(0.0, self._charge - self._current * dt / (CAPACITY * self._share))
