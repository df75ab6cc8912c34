"""The wind: a steady part, turbulence, and single gusts at given times.

Turbulence is the Dryden model for low altitude of MIL-F-8785C (1980), 3.7.3.4. Its frozen eddies pass the drone at its
airspeed; their lengths and strengths follow from the height and from the wind at 6 m (20 ft). Gusts have the form
1 - cosine (3.7.1.3). Eddies are assumed to be larger than the drone: they cause a force and no torque.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from skillwing.onboard.frames.vectors import Vector, add, clamp, norm, scale, subtract

FOOT = 0.3048
_LOWEST, _HIGHEST = 10.0, 1000.0
"""Heights between which the low-altitude model holds [ft]."""
_SLOWEST = 1.0
"""Least speed at which eddies pass the drone: without wind they drift by themselves [m/s]."""
_BLOCK = 1024


@dataclass(frozen=True, slots=True)
class Gust:
    """A gust that swells from `at` on, has its full `velocity` [m/s] half-way, and is over after `duration` seconds."""

    at: float
    velocity: Vector
    duration: float

    def __post_init__(self) -> None:
        if not self.duration > 0.0:
            raise ValueError(f"a gust of {self.duration:g} s cannot be; give it a positive length")

    def velocity_at(self, t: float) -> Vector:
        """Wind of the gust at `t` [m/s]."""
        phase = (t - self.at) / self.duration
        swell = 0.5 * (1.0 - math.cos(2.0 * math.pi * phase)) if 0.0 < phase < 1.0 else 0.0
        return scale(swell, self.velocity)


@dataclass(frozen=True, slots=True)
class Eddies:
    """Strength [m/s] and length [m] of eddies: level, the same along and across the wind, and upright."""

    level: float
    upright: float
    level_length: float
    upright_length: float

    @classmethod
    def at(cls, height: float, strength: float) -> Eddies:
        """Eddies at a height above the ground [m]. strength: wind at a height of 6 m [m/s]."""
        h = clamp(height / FOOT, _LOWEST, _HIGHEST)
        shape = 0.177 + 0.000823 * h
        upright = 0.1 * strength
        return cls(upright / shape**0.4, upright, FOOT * h / shape**1.2, FOOT * h)


class Turbulence:
    """Three independent components, along the mean wind, across it and upright, each white noise through a filter."""

    def __init__(self, strength: float, rng: np.random.Generator) -> None:
        """`strength` is the wind at 6 m that causes the turbulence [m/s]: 7.7 is light, 15.4 moderate, 23 severe."""
        if not strength >= 0.0:
            raise ValueError(f"turbulence of {strength:g} m/s cannot be; give 0 or more")
        self.strength = strength
        self._noise = _normal(rng)
        # Stationary from the start: unit variance for the first order, and (1/2, 1/4, covariance 1/4) for the second.
        draw = self._noise
        self._along = next(draw)
        self._across = [_stationary(next(draw), next(draw)), _stationary(next(draw), next(draw))]

    def advance(self, dt: float, height: float, airspeed: float) -> Vector:
        """Components (along, across, up) [m/s] after `dt` seconds, at this height [m] and speed through air [m/s]."""
        eddies, speed = Eddies.at(height, self.strength), max(airspeed, _SLOWEST)
        keep = math.exp(-dt * speed / eddies.level_length)
        self._along = keep * self._along + math.sqrt(1.0 - keep * keep) * next(self._noise)
        side = self._second_order(0, dt * speed / eddies.level_length)
        up = self._second_order(1, dt * speed / eddies.upright_length)
        return eddies.level * self._along, eddies.level * side, eddies.upright * up

    def _second_order(self, which: int, step: float) -> float:
        """Unit variance through (1 + sqrt(3) T s) / (1 + T s)^2, as two lags in a row; `step` is dt / T."""
        first, second = self._across[which]
        keep = math.exp(-step)
        second = keep * second + (1.0 - keep) * first
        first = keep * first + math.sqrt(0.5 * (1.0 - keep * keep)) * next(self._noise)
        self._across[which] = first, second
        return math.sqrt(3.0) * first + (1.0 - math.sqrt(3.0)) * second


class Wind:
    """Wind at the position of the drone. The same generator and the same flight give the same wind."""

    def __init__(
        self,
        rng: np.random.Generator,
        mean: Vector = (0.0, 0.0, 0.0),
        turbulence: float = 0.0,
        gusts: Iterable[Gust] = (),
    ) -> None:
        """`mean` [m/s] ENU; `turbulence` is the strength of `Turbulence`. Raises ValueError."""
        self.mean = mean
        self.gusts = list(gusts)
        self._turbulence = Turbulence(turbulence, rng) if turbulence != 0.0 else None
        level = math.hypot(mean[0], mean[1])
        self._direction = (mean[0] / level, mean[1] / level) if level > 0.0 else (1.0, 0.0)

    @property
    def is_steady(self) -> bool:
        """True if the wind never changes."""
        return self._turbulence is None and not self.gusts

    def advance(self, t: float, dt: float, height: float, velocity: Vector) -> Vector:
        """Wind velocity [m/s] ENU at `t`, `dt` after the last call, for a drone of this height and `velocity`."""
        wind = self.mean
        if self._turbulence is not None:
            along, across, up = self._turbulence.advance(dt, height, norm(subtract(self.mean, velocity)))
            east, north = self._direction
            wind = add(wind, (along * east - across * north, along * north + across * east, up))
        for gust in self.gusts:
            wind = add(wind, gust.velocity_at(t))
        return wind


def _normal(rng: np.random.Generator) -> Iterator[float]:
    """Standard normal numbers, drawn in blocks: ten times faster than one by one."""
    while True:
        yield from rng.standard_normal(_BLOCK).tolist()


def _stationary(one: float, other: float) -> tuple[float, float]:
    """States of the two lags, with the stationary distribution of the filter."""
    return math.sqrt(0.5) * one, 0.5 * math.sqrt(0.5) * (one + other)
