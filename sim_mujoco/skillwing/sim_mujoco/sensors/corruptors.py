"""What can go wrong with a measurement between the sensor's physics and its reader."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Data = NDArray[np.float32]


class Corruptor(ABC):
    """Changes measurements while it is switched on."""

    @abstractmethod
    def apply(self, data: Data) -> Data | None:
        """The measurement that is delivered instead of `data`; None if nothing is delivered at all."""


class Blackout(Corruptor):
    """Delivers nothing."""

    def apply(self, data: Data) -> Data | None:
        return None


class Freeze(Corruptor):
    """Delivers the measurement of the moment it began, again and again."""

    def __init__(self) -> None:
        self._frozen: Data | None = None

    def apply(self, data: Data) -> Data | None:
        if self._frozen is None:
            self._frozen = data
        return self._frozen


class Noise(Corruptor):
    """Adds white noise of this standard deviation, in the sensor's unit."""

    def __init__(self, sigma: float, rng: np.random.Generator) -> None:
        self._sigma, self._rng = np.float32(sigma), rng

    def apply(self, data: Data) -> Data | None:
        return (data + self._sigma * self._rng.standard_normal(data.shape, dtype=np.float32)).astype(np.float32)


class Bias(Corruptor):
    """Adds a constant, in the sensor's unit."""

    def __init__(self, offset: float) -> None:
        self._offset = np.float32(offset)

    def apply(self, data: Data) -> Data | None:
        return data + self._offset


class Dropout(Corruptor):
    """Loses each measurement with this probability."""

    def __init__(self, probability: float, rng: np.random.Generator) -> None:
        self._probability, self._rng = probability, rng

    def apply(self, data: Data) -> Data | None:
        return None if self._rng.random() < self._probability else data


class Slow(Corruptor):
    """Delivers only one of so many measurements."""

    def __init__(self, every: float) -> None:
        self._every, self._count = max(1, round(every)), 0

    def apply(self, data: Data) -> Data | None:
        self._count += 1
        return data if self._count % self._every == 0 else None


@dataclass(frozen=True, slots=True)
class Fault:
    """One corruptor for one sensor, wanted from `at` on (robot time), for `duration` seconds or for good."""

    sensor: str
    kind: str
    at: float = 0.0
    duration: float | None = None
    magnitude: float | None = None


class UnknownFaultError(ValueError):
    """A fault names a sensor or kind that does not exist; `known` lists what does."""

    def __init__(self, what: str, name: str, known: tuple[str, ...]) -> None:
        super().__init__(f"there is no {what} {name!r}; choose one of {', '.join(known)}")
        self.what, self.name, self.known = what, name, known


_Maker = Callable[[float, np.random.Generator], Corruptor]
_MAKERS: dict[str, tuple[float, _Maker]] = {
    "blackout": (0.0, lambda _, rng: Blackout()),
    "freeze": (0.0, lambda _, rng: Freeze()),
    "noise": (2.0, Noise),
    "bias": (1.0, lambda offset, rng: Bias(offset)),
    "dropout": (0.8, Dropout),
    "slow": (5.0, lambda every, rng: Slow(every)),
}
KINDS = tuple(_MAKERS)


def make_corruptor(kind: str, magnitude: float | None, rng: np.random.Generator) -> Corruptor:
    """A corruptor by name. `magnitude` is sigma, offset, probability or divisor; None takes the kind's usual value.

    Raises UnknownFaultError.
    """
    if kind not in _MAKERS:
        raise UnknownFaultError("kind of fault", kind, KINDS)
    usual, make = _MAKERS[kind]
    return make(usual if magnitude is None else magnitude, rng)


class Corruption:
    """The corruptors of one sensor that are switched on, in the order in which they were."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._active: dict[str, Corruptor] = {}

    @property
    def active(self) -> tuple[str, ...]:
        return tuple(self._active)

    def switch(self, kind: str, on: bool, magnitude: float | None = None) -> None:
        """Switch a kind of fault on or off; switching twice changes only the magnitude. Raises UnknownFaultError."""
        corruptor = make_corruptor(kind, magnitude, self._rng)
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
