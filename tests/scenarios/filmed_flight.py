"""A drone that flies along a line and films a wall, for tests of the video: true positions, cheap pictures."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from skillwing.onboard.commands.service import CommandRefusedError, answer_with
from skillwing.onboard.topics import common, video
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus
from skillwing.services.protocol import ErrorCode, encode
from skillwing.sim_mujoco.camera.camera import camera_header
from skillwing.sim_mujoco.sensors.depth_pictures import HEIGHT, WIDTH

SPEED = 2.0
PIXELS_PER_METRE = 20.0


@cache
def _scenery() -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """The colours of the wall, and eight samples of the grain of a picture. They are made once for all flights."""
    rng = np.random.default_rng(7)
    rough = np.zeros((HEIGHT, 4 * WIDTH, 3))
    for size in (1, 3, 12):
        rough += size * gaussian_filter(rng.standard_normal(rough.shape), (size, size, 0), mode="wrap")
    grain = rng.integers(-6, 7, (8, HEIGHT, WIDTH, 3), dtype=np.int16)
    return np.clip(128.0 + 40.0 * rough / rough.std(), 0, 255).astype(np.int16), grain


class FilmedFlight:
    """Stand-in for the simulator: the truth of a flight eastwards, and a camera that looks at a wall beside it."""

    name = "film"
    owns_clock = False

    def __init__(self) -> None:
        self.pictures = 0
        self.blind = False
        self.speed = SPEED
        self._x = 0.0
        self._fps = 15.0
        self._until = -1.0
        self._wall, self._grain = _scenery()

    def attach(self, bus: Bus) -> None:
        self._bus = bus
        self._truth = bus.advertise(TRUTH)
        self._camera = bus.advertise(video.CAMERA)
        bus.serve(video.CAMERA_COMMAND, answer_with(video.ControlCamera, self._control))
        bus.every(0.05, self._fly)

    def detach(self) -> None:
        pass

    @property
    def position(self) -> common.Vector3:
        return (self._x, 0.0, 10.0)

    def _control(self, wanted: video.ControlCamera) -> str:
        if self.blind:
            raise CommandRefusedError(ErrorCode.INTERNAL, "the lens cap is on", "take it off")
        filming = self._bus.now() <= self._until
        self._fps, self._until = wanted.fps, self._bus.now() + wanted.seconds
        if not filming:
            self._take()
        return ""

    def _take(self) -> None:
        now = self._bus.now()
        if now > self._until or self.blind:
            return
        self.pictures += 1
        left = round(self._x * PIXELS_PER_METRE) % (3 * WIDTH)
        # Without grain, the video of a moving wall would need almost no data.
        grain = self._grain[self.pictures % len(self._grain)]
        picture = np.clip(self._wall[:, left : left + WIDTH] + grain, 0, 255).astype(np.uint8)
        self._camera.put(picture.tobytes(), encode(camera_header(now, 0.0)))
        self._bus.after(1.0 / self._fps, self._take)

    def _fly(self) -> None:
        self._x += self.speed * 0.05
        truth = Truth(
            t=self._bus.now(),
            position=self.position,
            quaternion=(1.0, 0.0, 0.0, 0.0),
            velocity=(self.speed, 0.0, 0.0),
            collisions=0,
            clearance=10.0,
            inside_fence=True,
        )
        self._truth.put(encode(truth))
