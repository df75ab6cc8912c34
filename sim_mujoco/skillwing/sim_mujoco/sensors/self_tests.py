"""What a sensor's own measurements say against it, beyond limits and rates: noise, jumps, and contradictions."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.sensors.corruptors import Data

NOT_FINITE = "some of its values are no finite numbers"
"""What witnesses say of a measurement that they cannot compute with."""
_ENOUGH = 100
"""With fewer values in view nothing is concluded."""


class SelfTest(ABC):
    """Looks at one measurement after the other."""

    @abstractmethod
    def problem(self, t: float, data: Data) -> str | None:
        """What is wrong, in words, as of this measurement of `t`; None if nothing is."""


class Roughness(SelfTest):
    """Surfaces are smooth, noise is not: the second difference between neighbours, measured in the sensor's own noise.

    Its median over many neighbours hardly knows edges. `thin` picks a part of the measurement, whose values are
    neighbours along the last axis; `sigma` is the noise that is normal at a distance.
    """

    _LIMIT = 4.0
    _AGAIN = 2
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
        # To know on which side of the limit the median is, one need not find it.
        if 2 * np.count_nonzero(seen & (bend > self._LIMIT * normal)) <= count:
            self._times = 0
            return None
        self._times += 1
        factor = np.median(bend[seen] / normal[seen])
        return f"{factor:.0f} times its normal noise" if self._times >= self._AGAIN else None


class Jump(SelfTest):
    """The world does not come nearer everywhere at once: a step in all directions is one of the sensor.

    Two thirds of the directions have to change the same way: motion moves edges both ways, so does far noise, and
    much of the rest stays quiet. A drone that pitches over open ground changes them all as well, but never in one
    measurement alone: a step has quiet right before and right after it, and enough in view to tell. The jump counts
    until there is one back. `speed` is how fast so many may come nearer [m/s]: a wall ahead does.
    """

    _LEAST = 0.15
    _QUIET = 0.5
    """Of what a jump has to be at least."""

    def __init__(self, thin: Callable[[Data], Data], speed: float) -> None:
        self._thin, self._speed = thin, speed
        self._before: tuple[float, Data] | None = None
        self._was_quiet = True
        self._step = 0.0
        self._offset = 0.0

    def problem(self, t: float, data: Data) -> str | None:
        now = self._thin(data)
        if self._before is not None and np.array_equal(self._before[1], now):
            return self._told  # Frozen: the next change is one since the first of these.
        before, self._before = self._before, (t, now.copy())
        if before is not None:
            self._compare(t - before[0], before[1], now)
        return self._told

    def _compare(self, dt: float, before: Data, now: Data) -> None:
        change = (now - before)[(now > 0.0) & (before > 0.0)]
        if len(change) < _ENOUGH:
            self._was_quiet, self._step = False, 0.0
            return
        jump, least = _middle_and_least(change)
        limit = self._LEAST + self._speed * dt
        # Where a third stands still, the rest may go on all the same.
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
    def _told(self) -> str | None:
        return f"everything jumped by {self._offset:+.1f} m" if self._offset else None


class Contradiction:
    """Two instruments that measure the same: counts how long they have disagreed. Pure.

    `patience` is the number of disagreements, less the agreements between them, that make a contradiction.
    """

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self._count = 0

    def weigh(self, *, agree: bool) -> bool:
        """Whether they contradict each other as of now."""
        self._count = max(0, self._count - 1) if agree else min(2 * self._patience, self._count + 1)
        return self._count >= self._patience


def _middle_and_least(changes: NDArray[np.floating]) -> tuple[float, float]:
    """The median of changes (n,), and what two thirds of them change at least by in its direction."""
    third, middle = len(changes) // 3, len(changes) // 2
    ordered = np.partition(changes, (third, middle - 1, middle, -1 - third))
    median = float(ordered[middle] if len(changes) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle]))
    return median, float(ordered[third] if median > 0.0 else -ordered[-1 - third])
