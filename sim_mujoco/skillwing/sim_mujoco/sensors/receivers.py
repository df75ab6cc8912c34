"""Classes of satellite receivers. Needs no numpy, so that the format of scenarios is quick to import."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class ReceiverClass:
    """A class of receivers, by the standard deviations of its errors.

    The position's slow errors are `level` and `height` [m], with a correlation time of `correlation` seconds. `jitter`
    [m], `speed` [m/s] and `heading` [rad] are white. Navigation with it is `trusted` up to that horizontal uncertainty
    [m].
    """

    level: float
    height: float
    correlation: float
    jitter: float
    speed: float
    heading: float
    trusted: float


ReceiverName: TypeAlias = Literal["rtk", "standalone"]
RECEIVERS: dict[ReceiverName, ReceiverClass] = {
    "rtk": ReceiverClass(0.02, 0.03, 30.0, 0.005, 0.03, math.radians(0.2), 1.0),
    "standalone": ReceiverClass(1.0, 1.8, 100.0, 0.1, 0.08, math.radians(0.5), 4.0),
}
"""Receivers with fixed carrier-phase ambiguities (data sheets: 1 cm + 1 ppm), or no corrections (1.5 to 2.5 m)."""


def receiver_class(name: str) -> ReceiverClass:
    """The class of that name. Raises ValueError, which lists the known ones."""
    if name not in RECEIVERS:
        raise ValueError(f"there is no class of receivers {name!r}; choose one of {', '.join(RECEIVERS)}")
    return RECEIVERS[name]
