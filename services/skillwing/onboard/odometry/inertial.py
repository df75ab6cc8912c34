"""Inertial measurements as they come in, kept until a scan asks for them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from skillwing.onboard.odometry.so3 import Floats
from skillwing.onboard.topics.sensors import ImuHeader
from skillwing.services.protocol import ProtocolError, decode

_COLUMNS = 7
_JITTER, _ANOTHER_TIME = 1e-3, 1.0
"""Batches may overlap by so much, and time was reset when they are so far apart [s]."""


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
        """A batch as published. Raises ProtocolError for anything else, and for values that are no numbers."""
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
    """The batches since the last scan, but none older than `span` [s]: where there are no scans nobody takes them.

    covered_until: up to which time measurements are there; None before the first. A batch covers its last sample and
    one sampling period more. A batch that came twice is dropped; one from quite another time begins the memory anew.
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
