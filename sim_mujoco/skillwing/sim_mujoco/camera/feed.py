"""The camera's feed: requests for pictures, their rate, delay and corruption."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from skillwing.onboard.frames.vectors import Motion
from skillwing.sim_mujoco.camera.camera import Picture
from skillwing.sim_mujoco.sensors.corruptors import Corruption
from skillwing.sim_mujoco.sensors.depth_pictures import DELAY


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture that was taken at `t` with the camera turned down by `tilt` [rad]."""

    t: float
    tilt: float
    picture: Picture


class PictureSource(Protocol):
    """A camera, or a substitute in tests."""

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture: ...


class CameraFeed:
    """Pictures on request. Without requests the camera costs nothing: `make` makes it at the first one.

    Magnitudes of its faults are grey levels, of 255. The delay is the depth camera's: both have the same kind of chip,
    and developing takes as long as matching.
    """

    def __init__(self, make: Callable[[], PictureSource], rng: np.random.Generator) -> None:
        self._make = make
        self._camera: PictureSource | None = None
        self.corruption = Corruption(rng)
        self._period = self._tilt = 0.0
        self._next = self._until = 0.0
        self._under_way: deque[Shot] = deque()

    def request(self, t: float, fps: float, seconds: float, tilt: float) -> None:
        """Request pictures from `t` on for so many seconds, at this rate."""
        self._period, self._tilt = 1.0 / fps, tilt
        if self._until < t:
            self._next = t
        self._next = min(self._next, t + self._period)
        self._until = t + seconds

    def take(self, t: float, motion: Motion) -> Shot | None:
        """Take the picture that is due by `t`, if any, and return the one that is ready by then, if any."""
        shot = self._shot(t, motion)
        if shot is not None:
            self._under_way.append(shot)
        ready = self._under_way and self._under_way[0].t + DELAY <= t + 1e-9
        return self._under_way.popleft() if ready else None

    def _shot(self, t: float, motion: Motion) -> Shot | None:
        """The picture that is due by `t`, if any, unless a fault drops it."""
        if t < self._next - 1e-9 or t > self._until:
            return None
        self._next = max(self._next + self._period, t)
        if self._camera is None:
            self._camera = self._make()
        picture = self._camera.picture(motion, self._tilt)
        if self.corruption.active:
            data = self.corruption.apply(picture.astype(np.float32))
            if data is None:
                return None
            picture = np.clip(np.rint(data), 0, 255).astype(np.uint8)
        return Shot(t, self._tilt, picture)
