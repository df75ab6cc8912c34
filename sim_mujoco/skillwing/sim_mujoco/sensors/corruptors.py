"""What can go wrong with a measurement between the sensor's physics and its reader."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.sim_mujoco.sensors.zones import Zone

Data = NDArray[np.float32]
ONE: Final[Data] = np.ones(1, dtype=np.float32)
"""The unit of a sensor whose values are all of one kind. Others have a row: what one unit means for each value."""


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
    """Adds white noise of this standard deviation, in units of the sensor."""

    def __init__(self, sigma: float, rng: np.random.Generator, unit: Data = ONE) -> None:
        self._sigma, self._rng = np.float32(sigma) * unit, rng

    def apply(self, data: Data) -> Data | None:
        return (data + self._sigma * self._rng.standard_normal(data.shape, dtype=np.float32)).astype(np.float32)


class Bias(Corruptor):
    """Adds a constant, in units of the sensor."""

    def __init__(self, offset: float, unit: Data = ONE) -> None:
        self._offset = np.float32(offset) * unit

    def apply(self, data: Data) -> Data | None:
        return (data + self._offset).astype(np.float32)


class Dropout(Corruptor):
    """Loses each measurement with this probability."""

    def __init__(self, probability: float, rng: np.random.Generator) -> None:
        self._probability, self._rng = probability, rng

    def apply(self, data: Data) -> Data | None:
        return None if self._rng.random() < self._probability else data


class Slow(Corruptor):
    """Delivers only one of so many measurements."""

    def __init__(self, every: float) -> None:
        self._every, self._count = round(every), 0

    def apply(self, data: Data) -> Data | None:
        self._count += 1
        return data if self._count % self._every == 0 else None


@dataclass(frozen=True, slots=True)
class Fault:
    """One corruptor for one sensor, wanted from `at` on (robot time), for `duration` seconds or for good, and if there
    is a `zone` only while the drone is inside."""

    sensor: str
    kind: str
    at: float = 0.0
    duration: float | None = None
    magnitude: float | None = None
    zone: Zone | None = None

    def is_wanted(self, t: float, position: Vector) -> bool:
        """Whether it should be on at `t`, with the drone at `position`."""
        early = t < self.at - 1e-9
        late = self.duration is not None and t >= self.at + self.duration - 1e-9
        return not early and not late and (self.zone is None or self.zone.contains(position))


class UnknownFaultError(ValueError):
    """A fault names a sensor or kind that does not exist; `known` lists what does."""

    def __init__(self, what: str, name: str, known: tuple[str, ...]) -> None:
        guess = get_close_matches(name, known, 1)
        hint = f"; did you mean `{guess[0]}`" if guess else ""
        super().__init__(f"there is no {what} {name!r}{hint}; choose one of {', '.join(known)}")
        self.what, self.name, self.known = what, name, known


class MagnitudeError(ValueError):
    """A fault is to be as strong as its kind cannot be; `advice` is what to do about it."""

    def __init__(self, message: str, advice: str) -> None:
        super().__init__(message)
        self.advice = advice


def check_magnitude(kind: str, magnitude: float | None, least: float, most: float) -> None:
    """Raises MagnitudeError for one that is not between the least and the most."""
    if magnitude is not None and not least <= magnitude <= most:
        bounds = f"from {least:,.12g} to {most:,.12g}"
        raise MagnitudeError(
            f"the magnitude of {kind} has to be {bounds}, not {magnitude:,.12g}", "choose another magnitude"
        )


def check_no_magnitude(kind: str, magnitude: float | None) -> None:
    """Raises MagnitudeError for a magnitude of what is there or not, and no more or less."""
    if magnitude is not None:
        raise MagnitudeError(f"{kind} has no magnitude", "leave the magnitude out")


class _Kind(NamedTuple):
    """How a corruptor is made, and its magnitude: the usual one (None for a kind that has none), the least and the
    largest, and whether it counts units of the sensor, of which there may be fewer."""

    make: Callable[[float, np.random.Generator, Data], Corruptor]
    usual: float | None = None
    least: float = -LARGEST_COMPONENT
    most: float = LARGEST_COMPONENT
    in_units: bool = False


_KINDS = {
    "blackout": _Kind(lambda _, rng, unit: Blackout()),
    "freeze": _Kind(lambda _, rng, unit: Freeze()),
    "noise": _Kind(Noise, usual=2.0, least=0.0, in_units=True),
    "bias": _Kind(lambda offset, rng, unit: Bias(offset, unit), usual=1.0, in_units=True),
    "dropout": _Kind(lambda probability, rng, unit: Dropout(probability, rng), usual=0.8, least=0.0, most=1.0),
    "slow": _Kind(lambda every, rng, unit: Slow(every), usual=5.0, least=1.0),
}
KINDS = tuple(_KINDS)


def check_kind(kind: str, magnitude: float | None = None, largest: float = LARGEST_COMPONENT) -> None:
    """Raises UnknownFaultError for a kind that does not exist, MagnitudeError for a magnitude that it cannot have: any
    where it has none; a larger one, or one of more than the `largest` number of units, would overflow what a
    measurement is made of."""
    if kind not in _KINDS:
        raise UnknownFaultError("kind of fault", kind, KINDS)
    _, usual, least, most, in_units = _KINDS[kind]
    if usual is None:
        check_no_magnitude(kind, magnitude)
    if in_units:
        least, most = max(least, -largest), min(most, largest)
    check_magnitude(kind, magnitude, least, most)


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
    chosen = _KINDS[kind]
    return chosen.make((chosen.usual or 0.0) if magnitude is None else magnitude, rng, unit)


class Corruption:
    """The corruptors of one sensor that are switched on, in the order in which they were.

    unit, largest: of the sensor, as a `Fitting` has them.
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
