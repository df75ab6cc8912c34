"""Self-tests of a sensor on its own data, beyond limits and rates: noise, jumps, and contradictions."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.sensors.corruptors import Data

NOT_FINITE = "some of its values are no finite numbers"
"""Residual of a measurement that cross-checks cannot compute with."""
_ENOUGH = 100
"""Number of values in view below which there is no conclusion."""


class SelfTest(ABC):
    """A test that sees one measurement after the other."""

    @abstractmethod
    def problem(self, t: float, data: Data) -> str | None:
        """Problem of the sensor after this measurement of `t`, in words; None without one."""


class Roughness(SelfTest):
    """Test for noise: the second difference between neighbours, relative to the sensor's own noise.

    Surfaces are smooth, and the median over many neighbours hardly depends on edges. `thin` picks a part of the
    measurement, whose values are neighbours along the last axis; `sigma` is the normal noise at a distance.
    """

    _LIMIT = 4.0
    _REPETITIONS = 2
    _MEDIAN = 0.6745
    """Median of the absolute value of a standard normal number."""

    def __init__(self, thin: Callable[[Data], Data], sigma: Callable[[Data], Data]) -> None:
        self._thin, self._sigma = thin, sigma
        self._times = 0

    def problem(self, t: float, data: Data) -> str | None:
        rows = self._thin(data)
        left, middle, right = rows[..., :-2], rows[..., 1:-1], rows[..., 2:]
        hit = rows > 0.0
        seen = hit[..., :-2] & hit[..., 1:-1] & hit[..., 2:]
        count = np.count_nonzero(seen)
        if count < _ENOUGH:
            return None
        bend = np.abs(left + right - 2.0 * middle)
        normal = self._MEDIAN * math.sqrt(6.0) * self._sigma(middle)
        # A count shows on which side of the limit the median is, and is faster than the median.
        if 2 * np.count_nonzero(seen & (bend > self._LIMIT * normal)) <= count:
            self._times = 0
            return None
        self._times += 1
        factor = np.median(bend[seen] / normal[seen])
        return f"{factor:.0f} times its normal noise" if self._times >= self._REPETITIONS else None


class Jump(SelfTest):
    """Test for a step of all ranges at once, which the sensor causes and not the world.

    Two thirds of the directions have to change the same way. Motion moves edges both ways, and so does noise at long
    range; many directions stay quiet. A drone that pitches over open ground changes all directions too, but over
    several measurements. A step has quiet measurements right before and after it, with enough in view. The jump counts
    until one back. `speed` is the largest real approach of so many directions [m/s], as to a wall ahead.
    """

    _LEAST = 0.15
    _QUIET = 0.5
    """Share of the least jump below which a measurement is quiet."""

    def __init__(self, thin: Callable[[Data], Data], speed: float) -> None:
        self._thin, self._speed = thin, speed
        self._before: tuple[float, Data] | None = None
        self._was_quiet = True
        self._step = 0.0
        self._offset = 0.0

    def problem(self, t: float, data: Data) -> str | None:
        now = self._thin(data)
        if self._before is not None and np.array_equal(self._before[1], now):
            return self._text  # A frozen sensor: the next change counts from the first of these measurements.
        before, self._before = self._before, (t, now.copy())
        if before is not None:
            self._compare(t - before[0], before[1], now)
        return self._text

    def _compare(self, dt: float, before: Data, now: Data) -> None:
        change = (now - before)[(now > 0.0) & (before > 0.0)]
        if len(change) < _ENOUGH:
            self._was_quiet, self._step = False, 0.0
            return
        jump, least = _middle_and_least(change)
        limit = self._LEAST + self._speed * dt
        # A third that stands still is quiet, whatever the rest does.
        quiet = least <= self._QUIET * limit and abs(jump) <= limit
        if quiet and self._step:
            self._count(self._step)
        back = jump * self._offset < 0.0 and abs(jump) > 0.5 * abs(self._offset) and not quiet
        self._step = jump if self._was_quiet and (back or least > limit) else 0.0
        self._was_quiet = quiet

    def _count(self, step: float) -> None:
        is_back = step * self._offset < 0.0 and abs(step) > 0.5 * abs(self._offset)
        self._offset = 0.0 if is_back else self._offset + step

    @property
    def _text(self) -> str | None:
        return f"everything jumped by {self._offset:+.1f} m" if self._offset else None


class Contradiction:
    """Counter of disagreements between two instruments that measure the same. Pure.

    `patience` is the number of disagreements, less the agreements in between, that make a contradiction.
    """

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self._count = 0

    def update(self, *, agree: bool) -> bool:
        """Take an agreement or a disagreement; True while the two contradict each other."""
        self._count = max(0, self._count - 1) if agree else min(2 * self._patience, self._count + 1)
        return self._count >= self._patience


def _middle_and_least(changes: NDArray[np.floating]) -> tuple[float, float]:
    """The median of changes (n,), and the least change in its direction of two thirds of them."""
    third, middle = len(changes) // 3, len(changes) // 2
    ordered = np.partition(changes, (third, middle - 1, middle, -1 - third))
    median = float(ordered[middle] if len(changes) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle]))
    return median, float(ordered[third] if median > 0.0 else -ordered[-1 - third])
