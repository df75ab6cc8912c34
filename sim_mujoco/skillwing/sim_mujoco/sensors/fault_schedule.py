"""Which faults are to be switched when and where."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, TypeAlias

import msgspec

from skillwing.onboard.frames.vectors import Vector
from skillwing.sim_mujoco.sensors.corruptors import Fault

Seconds: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
"""Robot time at which something is to happen, or how long it is to last: eleven days at most."""


class FaultSchedule:
    """Faults that come and go with time and place. What was switched by hand meanwhile stays as it is."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(faults)
        self._on: list[int] = []

    @property
    def is_empty(self) -> bool:
        """Nothing will ever be switched."""
        return not self._faults

    def switches(self, t: float, position: Vector) -> Iterator[tuple[Fault, bool]]:
        """The faults that have to be switched on (True) or off at `t`, with the drone at `position`.

        A sensor has each kind of fault once: of several that overlap, the one that began last counts, and when it ends
        the one before counts again.
        """
        for k, fault in enumerate(self._faults):
            wanted = fault.is_wanted(t, position)
            if wanted is (k in self._on):
                continue
            if wanted:
                self._on.append(k)
                yield fault, True
            else:
                yield from self._end(k)

    def _end(self, k: int) -> Iterator[tuple[Fault, bool]]:
        """What has to be switched when a fault ends."""
        fault = self._faults[k]
        last = self._counts(fault)
        self._on.remove(k)
        following = self._counts(fault)
        if following is None:
            yield fault, False
        elif last == k and self._faults[following].magnitude != fault.magnitude:
            yield self._faults[following], True

    def _counts(self, like: Fault) -> int | None:
        """Which one counts of the faults of this sensor and kind that are on."""
        same = [k for k in self._on if (self._faults[k].sensor, self._faults[k].kind) == (like.sensor, like.kind)]
        return same[-1] if same else None
