"""Faults of sensors: kinds, magnitudes, zones and schedules. Needs no numpy, for the format of scenarios."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated, NamedTuple, TypeAlias

import msgspec

from skillwing.onboard.frames.vectors import Vector
from skillwing.onboard.topics.common import LARGEST_COMPONENT, Vector3

Seconds: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
"""Robot time of an event, or a duration: eleven days at most."""


Metres = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]
Level = tuple[float, float]


class Zone(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A box from `low` to `high`, or an upright cylinder around `center` (x, y) with `radius`; ENU [m].

    Raises ValueError if it is neither or both, and for an empty box.
    """

    low: Vector3 | None = None
    high: Vector3 | None = None
    center: Level | None = None
    radius: Metres | None = None

    def __post_init__(self) -> None:
        corners, circle = (self.low, self.high), (self.center, self.radius)
        is_box = None not in corners and circle == (None, None)
        is_cylinder = None not in circle and corners == (None, None)
        if not is_box and not is_cylinder:
            raise ValueError("a zone has either `low` and `high`, or `center` and `radius`")
        if is_box and any(low >= high for low, high in zip(self.low or (), self.high or (), strict=True)):
            raise ValueError("`low` of a zone has to be below `high` in x, y and z")

    def contains(self, point: Vector) -> bool:
        return self.depth(point) >= 0.0

    def depth(self, point: Vector) -> float:
        """Depth of the point inside the zone, from the nearest border; negative outside [m]."""
        if self.low is not None and self.high is not None:
            beyond = [max(low - x, x - high) for low, x, high in zip(self.low, point, self.high, strict=True)]
            outside = math.hypot(*(max(b, 0.0) for b in beyond))
            return -outside if outside > 0.0 else -max(beyond)
        assert self.center is not None
        assert self.radius is not None
        return self.radius - math.dist(point[:2], self.center)


@dataclass(frozen=True, slots=True)
class Fault:
    """One kind of fault of one sensor, from `at` on (robot time), for `duration` seconds or for good. With a `zone` it
    is on only while the drone is inside."""

    sensor: str
    kind: str
    at: float = 0.0
    duration: float | None = None
    magnitude: float | None = None
    zone: Zone | None = None

    def is_wanted(self, t: float, position: Vector) -> bool:
        """True if the fault should be on at `t`, with the drone at `position`."""
        early = t < self.at - 1e-9
        late = self.duration is not None and t >= self.at + self.duration - 1e-9
        return not early and not late and (self.zone is None or self.zone.contains(position))


class UnknownFaultError(ValueError):
    """A fault names a sensor or kind that does not exist; `known` lists those that do."""

    def __init__(self, what: str, name: str, known: tuple[str, ...]) -> None:
        guess = get_close_matches(name, known, 1)
        hint = f"; did you mean `{guess[0]}`" if guess else ""
        super().__init__(f"there is no {what} {name!r}{hint}; choose one of {', '.join(known)}")
        self.what, self.name, self.known = what, name, known


class MagnitudeError(ValueError):
    """A fault has a magnitude that its kind cannot have; `advice` says what to do."""

    def __init__(self, message: str, advice: str) -> None:
        super().__init__(message)
        self.advice = advice


def check_magnitude(kind: str, magnitude: float | None, least: float, most: float) -> None:
    """Raise MagnitudeError for a magnitude that is not between the least and the most."""
    if magnitude is not None and not least <= magnitude <= most:
        bounds = f"from {least:,.12g} to {most:,.12g}"
        raise MagnitudeError(
            f"the magnitude of {kind} has to be {bounds}, not {magnitude:,.12g}", "choose another magnitude"
        )


def check_no_magnitude(kind: str, magnitude: float | None) -> None:
    """Raise MagnitudeError for any magnitude, because the fault is either on or off."""
    if magnitude is not None:
        raise MagnitudeError(f"{kind} has no magnitude", "leave the magnitude out")


class FaultKind(NamedTuple):
    """Magnitudes of a kind of fault: the usual one (None for a kind without), the least and the largest. `in_units`
    marks those that count units of the sensor, which may have a lower limit."""

    usual: float | None = None
    least: float = -LARGEST_COMPONENT
    most: float = LARGEST_COMPONENT
    in_units: bool = False


KINDS = {
    "blackout": FaultKind(),
    "freeze": FaultKind(),
    "noise": FaultKind(usual=2.0, least=0.0, in_units=True),
    "bias": FaultKind(usual=1.0, in_units=True),
    "dropout": FaultKind(usual=0.8, least=0.0, most=1.0),
    "slow": FaultKind(usual=5.0, least=1.0),
}
"""Kinds of sensor faults by name; `corruptors.py` carries them out."""


def check_kind(kind: str, magnitude: float | None = None, largest: float = LARGEST_COMPONENT) -> None:
    """Raise UnknownFaultError for a kind that does not exist, MagnitudeError for a magnitude that it cannot have.

    largest: number of units of the sensor above which a measurement would overflow.
    """
    if kind not in KINDS:
        raise UnknownFaultError("kind of fault", kind, tuple(KINDS))
    usual, least, most, in_units = KINDS[kind]
    if usual is None:
        check_no_magnitude(kind, magnitude)
    if in_units:
        least, most = max(least, -largest), min(most, largest)
    check_magnitude(kind, magnitude, least, most)


class FaultSchedule:
    """Schedule of faults by time and place. It does not change faults that were switched by hand meanwhile."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(faults)
        self._on: list[int] = []

    @property
    def is_empty(self) -> bool:
        """True if the schedule has no faults."""
        return not self._faults

    def switches(self, t: float, position: Vector) -> Iterator[tuple[Fault, bool]]:
        """The faults that have to be switched on (True) or off at `t`, with the drone at `position`.

        A sensor has each kind of fault once. Of several that overlap, the one that began last counts; when it ends,
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
        """The switches that the end of a fault needs."""
        fault = self._faults[k]
        last = self._counts(fault)
        self._on.remove(k)
        following = self._counts(fault)
        if following is None:
            yield fault, False
        elif last == k and self._faults[following].magnitude != fault.magnitude:
            yield self._faults[following], True

    def _counts(self, like: Fault) -> int | None:
        """The number of the fault that counts, of those of this sensor and kind that are on."""
        same = [k for k in self._on if (self._faults[k].sensor, self._faults[k].kind) == (like.sensor, like.kind)]
        return same[-1] if same else None
