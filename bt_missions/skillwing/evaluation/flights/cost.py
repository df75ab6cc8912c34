"""Costs of a flight, and the share of an inspection with live video, measured on the ground truth.

The observer of a flight carries the meter. The robot does not see it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from skillwing.onboard.topics.common import Vector3
from skillwing.onboard.topics.flight import BATTERY, FLIGHT, Battery, FlightState
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.onboard.topics.video import VIDEO_REPORT, VideoStatus
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader

LIVE_FPS, LIVE_QUALITY = 10.0, 0.7
"""Least frame rate [1/s] and SSIM of a video for flight out of sight, as demanded by the inspection."""
LIVE_FOR = 1.0
"""Time for which a report of the ground station is valid [s]. The period of reports is 0.25 s."""
PASSED_WITHIN = 3.0
"""Largest distance at which a corner of the planned circle counts as passed [m]."""
AWAY = 5.0
"""Horizontal distance from home beyond which the drone counts as away [m]."""


class Cost(msgspec.Struct, frozen=True, kw_only=True):
    """Costs of a flight. charge: used charge of the battery [% of its capacity], None without reports. circled,
    circled_live: shares of the planned circle's corners that were passed, and passed with live video; None without a
    circle. unseen: robot time in the air and away from home without live video, since the first live video [s]; None
    without live video."""

    charge: float | None = None
    circled: float | None = None
    circled_live: float | None = None
    unseen: float | None = None


class CostMeter:
    """Meter of the costs so far. circle: corners of the planned circle, ENU [m]."""

    def __init__(self, circle: Sequence[Vector3] = ()) -> None:
        self._circle = circle
        self._passed: set[int] = set()
        self._passed_live: set[int] = set()
        self._full: float | None = None
        self._left = 0.0
        self._live_at = -math.inf
        self._unseen: float | None = None
        self._on_ground = True
        self._t: float | None = None

    def attach(self, bus: Bus) -> None:
        bus.subscribe(BATTERY, message_reader(Battery, self.charge))
        bus.subscribe(FLIGHT, message_reader(FlightState, self.flight))
        bus.subscribe(VIDEO_REPORT, message_reader(VideoStatus, self.video))
        bus.subscribe(TRUTH, message_reader(Truth, self.truth))

    @property
    def cost(self) -> Cost:
        """Costs so far."""
        count = len(self._circle)
        return Cost(
            charge=None if self._full is None else round(self._full - self._left, 3),
            circled=round(len(self._passed) / count, 4) if count else None,
            circled_live=round(len(self._passed_live) / count, 4) if count else None,
            unseen=None if self._unseen is None else round(self._unseen, 2),
        )

    def charge(self, battery: Battery) -> None:
        self._full = battery.percent if self._full is None else self._full
        self._left = battery.percent

    def flight(self, state: FlightState) -> None:
        self._on_ground = state.on_ground

    def video(self, status: VideoStatus) -> None:
        """Take a report of the ground station."""
        if status.quality is not None and status.fps >= LIVE_FPS and status.quality >= LIVE_QUALITY:
            self._live_at = status.t
            self._unseen = self._unseen or 0.0

    def truth(self, truth: Truth) -> None:
        elapsed = 0.0 if self._t is None else truth.t - self._t
        self._t = truth.t
        live = truth.t - self._live_at <= LIVE_FOR
        away = math.hypot(*truth.position[:2]) > AWAY
        if self._unseen is not None and not live and away and not self._on_ground:
            self._unseen += elapsed
        passed = {i for i, corner in enumerate(self._circle) if math.dist(corner, truth.position) <= PASSED_WITHIN}
        self._passed |= passed
        if live:
            self._passed_live |= passed
