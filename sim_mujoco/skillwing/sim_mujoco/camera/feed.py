"""When the camera takes a picture, and what becomes of it: who wants pictures, how many, and what corrupts them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from skillwing.onboard.frames.motion import Motion
from skillwing.sim_mujoco.camera.camera import Picture
from skillwing.sim_mujoco.sensors.corruptors import Corruption
from skillwing.sim_mujoco.sensors.depth_camera import DELAY


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture that was taken at `t` with the camera turned down by `tilt` [rad]."""

    t: float
    tilt: float
    picture: Picture


class Sight(Protocol):
    """A camera, or what stands in for one."""

    def picture(self, motion: Motion, tilt: float = 0.0) -> Picture: ...


class CameraFeed:
    """A camera that nobody wants pictures from costs nothing: it is not even made before the first request.

    `make` makes it. Magnitudes of its faults are grey levels, of 255. Pictures come as late as the depth camera's: both
    are read from the same kind of chip, and where those are matched these are developed.
    """

    def __init__(self, make: Callable[[], Sight], rng: np.random.Generator) -> None:
        self._make = make
        self._camera: Sight | None = None
        self.corruption = Corruption(rng)
        self._period = self._tilt = 0.0
        self._next = self._until = 0.0
        self._under_way: deque[Shot] = deque()

    def want(self, t: float, fps: float, seconds: float, tilt: float) -> None:
        """From `t` on pictures are wanted for so many seconds, at this rate."""
        self._period, self._tilt = 1.0 / fps, tilt
        if self._until < t:
            self._next = t
        self._next = min(self._next, t + self._period)
        self._until = t + seconds

    def take(self, t: float, motion: Motion) -> Shot | None:
        """Take the picture that is due by `t`, if one is, and give out the one that is ready by then, if one is."""
        shot = self._shot(t, motion)
        if shot is not None:
            self._under_way.append(shot)
        ready = self._under_way and self._under_way[0].t + DELAY <= t + 1e-9
        return self._under_way.popleft() if ready else None

    def _shot(self, t: float, motion: Motion) -> Shot | None:
        """The picture that is due by `t`, if one is and if no fault swallows it."""
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
