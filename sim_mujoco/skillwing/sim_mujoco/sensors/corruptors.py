"""Corruptors: what carries out each kind of fault on a sensor's measurements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.sim_mujoco.sensors.faults import KINDS, check_kind

Data = NDArray[np.float32]
ONE: Final[Data] = np.ones(1, dtype=np.float32)
"""Unit of a sensor whose values are all of one kind. Others have one number for each value."""


class Corruptor(ABC):
    """Change of measurements while a fault is on."""

    @abstractmethod
    def apply(self, data: Data) -> Data | None:
        """The measurement that is delivered instead of `data`; None for no delivery."""


class Blackout(Corruptor):
    """No delivery at all."""

    def apply(self, data: Data) -> Data | None:
        return None


class Freeze(Corruptor):
    """The first measurement of the fault, again and again."""

    def __init__(self) -> None:
        self._frozen: Data | None = None

    def apply(self, data: Data) -> Data | None:
        if self._frozen is None:
            self._frozen = data
        return self._frozen


class Noise(Corruptor):
    """Additional white noise with this standard deviation, in units of the sensor."""

    def __init__(self, sigma: float, rng: np.random.Generator, unit: Data = ONE) -> None:
        self._sigma, self._rng = np.float32(sigma) * unit, rng

    def apply(self, data: Data) -> Data | None:
        return (data + self._sigma * self._rng.standard_normal(data.shape, dtype=np.float32)).astype(np.float32)


class Bias(Corruptor):
    """A constant offset, in units of the sensor."""

    def __init__(self, offset: float, unit: Data = ONE) -> None:
        self._offset = np.float32(offset) * unit

    def apply(self, data: Data) -> Data | None:
        return (data + self._offset).astype(np.float32)


class Dropout(Corruptor):
    """Loss of each measurement with this probability."""

    def __init__(self, probability: float, rng: np.random.Generator) -> None:
        self._probability, self._rng = probability, rng

    def apply(self, data: Data) -> Data | None:
        return None if self._rng.random() < self._probability else data


class Slow(Corruptor):
    """Delivery of only one of so many measurements."""

    def __init__(self, every: float) -> None:
        self._every, self._count = round(every), 0

    def apply(self, data: Data) -> Data | None:
        self._count += 1
        return data if self._count % self._every == 0 else None


_MAKERS: Final[dict[str, Callable[[float, np.random.Generator, Data], Corruptor]]] = {
    "blackout": lambda _, rng, unit: Blackout(),
    "freeze": lambda _, rng, unit: Freeze(),
    "noise": Noise,
    "bias": lambda offset, rng, unit: Bias(offset, unit),
    "dropout": lambda probability, rng, unit: Dropout(probability, rng),
    "slow": lambda every, rng, unit: Slow(every),
}


def make_corruptor(
    kind: str,
    magnitude: float | None,
    rng: np.random.Generator,
    unit: Data = ONE,
    largest: float = LARGEST_COMPONENT,
) -> Corruptor:
    """A corruptor by name. `magnitude` is sigma, offset, probability or divisor; None takes the kind's usual value.

    largest: as of `check_kind`. Raises UnknownFaultError and MagnitudeError.
    """
    check_kind(kind, magnitude, largest)
    return _MAKERS[kind]((KINDS[kind].usual or 0.0) if magnitude is None else magnitude, rng, unit)


class Corruption:
    """The corruptors of one sensor that are switched on, in the order in which they were.

    unit, largest: of the sensor, as its `SensorSpec` has them.
    """

    def __init__(self, rng: np.random.Generator, unit: Data = ONE, largest: float = LARGEST_COMPONENT) -> None:
        self._rng, self._unit, self._largest = rng, unit, largest
        self._active: dict[str, Corruptor] = {}

    @property
    def active(self) -> tuple[str, ...]:
        return tuple(self._active)

    def switch(self, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a kind of fault on or off; switching twice changes only the magnitude. Raises UnknownFaultError
        and MagnitudeError."""
        corruptor = make_corruptor(kind, magnitude, self._rng, self._unit, self._largest)
        if on:
            self._active[kind] = corruptor
        else:
            self._active.pop(kind, None)

    def apply(self, data: Data) -> Data | None:
        current: Data | None = data
        for corruptor in self._active.values():
            if current is None:
                return None
            current = corruptor.apply(current)
        return current
