"""Inertial measurements, and their memory until the next scan."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.topics.sensors import ImuHeader
from skillwing.services.protocol import ProtocolError, decode

_COLUMNS = 7
_JITTER, _ANOTHER_TIME = 1e-3, 1.0
"""Largest overlap of batches, and distance between them that means a reset of time [s]."""


@dataclass(frozen=True, slots=True)
class Inertial:
    """Samples in the order of time: `times` (N,), specific `forces` (N, 3) [m/s2] and angular `rates` (N, 3) [rad/s]
    in body axes."""

    times: Floats
    forces: Floats
    rates: Floats

    def __len__(self) -> int:
        return len(self.times)

    def largest_gap(self, start: float, end: float) -> float:
        """The longest time between `start`, the samples and `end` [s]."""
        return float(np.diff(np.concatenate([[start], self.times, [end]])).max())

    @staticmethod
    def decode(payload: bytes, attachment: bytes) -> Inertial:
        """Decode a published batch. Raises ProtocolError for anything else, and for values that are no numbers."""
        header = decode(attachment, ImuHeader)
        if header.count < 1 or len(payload) != 4 * _COLUMNS * header.count:
            raise ProtocolError(f"{len(payload)} bytes are no {header.count} inertial samples")
        rows = np.frombuffer(payload, np.float32).reshape(-1, _COLUMNS).astype(np.float64)
        if not np.isfinite(rows).all():
            raise ProtocolError("an inertial sample is no number")
        if (np.diff(rows[:, 0]) <= 0.0).any():
            raise ProtocolError("inertial samples are not in the order of time")
        return Inertial(header.t0 + rows[:, 0], rows[:, 1:4], rows[:, 4:7])


class InertialMemory:
    """Memory of the batches since the last scan, but none older than `span` [s], in case there are no scans.

    covered_until: end of the time with measurements; None before the first. A batch covers its last sample and one
    sampling period more. A repeated batch is dropped; one from a very different time clears the memory first.
    """

    def __init__(self, span: float) -> None:
        self._span = span
        self._batches: deque[Inertial] = deque()
        self.covered_until: float | None = None

    def add(self, batch: Inertial) -> bool:
        """Take a batch; False if it was dropped."""
        if self.covered_until is not None:
            gap = float(batch.times[0]) - self.covered_until
            if abs(gap) > _ANOTHER_TIME:
                self._batches.clear()
            elif gap < -_JITTER:
                return False
        period = float(batch.times[-1] - batch.times[0]) / (len(batch) - 1) if len(batch) > 1 else 0.0
        self._batches.append(batch)
        self.covered_until = float(batch.times[-1]) + period
        self._forget_before(self.covered_until - self._span)
        return True

    def take(self, start: float, end: float) -> Inertial:
        """The samples from `start` to `end`, without the latter. Older ones are forgotten."""
        self._forget_before(start - 1e-6)
        if not self._batches:
            return Inertial(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        times, forces, rates = (
            np.concatenate([getattr(batch, name) for batch in self._batches]) for name in ("times", "forces", "rates")
        )
        # float32 offsets and float64 times differ by microseconds.
        wanted = (times >= start - 1e-6) & (times < end - 1e-6)
        return Inertial(times[wanted], forces[wanted], rates[wanted])

    def _forget_before(self, t: float) -> None:
        while self._batches and self._batches[0].times[-1] < t:
            self._batches.popleft()
