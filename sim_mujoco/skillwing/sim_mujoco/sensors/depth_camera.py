"""Stereo depth camera along the nose: 320 x 180 pixels, 15 Hz, 54 degrees high, up to 20 m.

A pixel has a depth only if it is found again in the picture of the second camera, 12 cm to the right. Three causes make
holes. The second camera does not see the point: something nearer hides it, or it lies outside the picture. The depth
changes too steeply for a match, at edges and on oblique surfaces (Burt and Julesz, 1980: a disparity gradient of 1).
And matching fails at random, more often at larger depths.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion, Vector, add, axes, to_world
from skillwing.onboard.sensor_data.directions import DEPTH_NOISE, depth_directions
from skillwing.onboard.topics.sensors import DepthHeader
from skillwing.services.protocol import encode
from skillwing.sim_mujoco.sensors.instruments import NoiseTable

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.rays import RayScene

Pixels = NDArray[np.intp]
Image = NDArray[np.float32]
Cast = Callable[[Pixels], Image]
"""Ray caster: from numbers of pixels, counted row by row, to their inverse depths (n,)."""

_STRAIGHT = np.float32(2e-3)
"""Largest deviation of neighbours from one line, relative to the value."""

ZED_MOUNT: Vector = (0.3, 0.0, -0.05)
"""Position of the camera on the drone, FLU [m]."""
WIDTH, HEIGHT = 320, 180
PERIOD = 1 / 15
DELAY = 0.03
"""Time from the shutter to the delivery of a picture [s]: readout, transfer and matching."""
REACH, NEAREST = 20.0, 0.4
FOCAL = HEIGHT / 2 / math.tan(math.radians(54.0) / 2)
"""Focal length [px], the same in both directions; the optical axis passes through the image's centre."""
BASELINE = 0.12
"""Distance of the two cameras [m]."""
_STEEPEST = 1.0
"""Disparity gradient that can still be matched [pixels per pixel]."""
_UNMATCHED, _UNMATCHED_FAR = 3.0, 1.4
"""Standard deviations of a fluctuation above which a pixel fails to match: nearby (0.1 %), and at the end of the reach
(8 %)."""


def depth_header(t: float) -> DepthHeader:
    """The description of a picture taken at `t`."""
    return DepthHeader(
        t=t, width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=WIDTH / 2, cy=HEIGHT / 2, mount=ZED_MOUNT
    )


def publication(_start: float, end: float, data: NDArray[np.float32]) -> tuple[bytes, bytes]:
    """Picture in millimetres, and its header."""
    millimetres = np.clip(np.rint(data * 1000.0), 0, np.iinfo(np.uint16).max).astype(np.uint16)
    return millimetres.tobytes(), encode(depth_header(end))


def noise_at(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Standard deviation of a measured depth [m]."""
    return np.float32(DEPTH_NOISE) * depth * depth


class DepthCamera:
    """The camera in the static world; it takes one picture at a time."""

    def __init__(self, rays: RayScene, rng: np.random.Generator) -> None:
        self._rays, self._noise = rays, NoiseTable(rng)
        directions = depth_directions(depth_header(0.0))
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        self._rays_in_body = (directions / length).reshape(-1, 3)
        self._range_per_depth = length.ravel().astype(np.float32)
        self._infill = Infill(HEIGHT, WIDTH)
        self._first_in_body = self._rays_in_body[self._infill.first]
        self._first_range_per_depth = self._range_per_depth[self._infill.first]
        self._reach = REACH * float(length.max())

    def picture(self, motion: Motion) -> NDArray[np.float32]:
        """Depth along the optical axis (180, 320) [m], 0 = no return."""
        inverse = self._inverse_depth(motion)
        depth = _inverted(inverse)
        count = depth.size
        lost = _unmatchable(np.float32(FOCAL * BASELINE) * inverse)
        worse = np.float32((_UNMATCHED - _UNMATCHED_FAR) / REACH)
        lost |= self._noise.draw(count).reshape(depth.shape) > np.float32(_UNMATCHED) - worse * depth
        depth += noise_at(depth) * self._noise.draw(count).reshape(depth.shape)
        lost |= (depth < NEAREST) | (depth > REACH)
        depth[lost] = 0.0
        return depth

    def true_depth(self, motion: Motion) -> NDArray[np.float32]:
        """True depth (180, 320) [m], without noise, holes and limits of the sensor."""
        return _inverted(self._inverse_depth(motion))

    def _inverse_depth(self, motion: Motion) -> NDArray[np.float32]:
        axes_in_world = np.array(axes(motion.quaternion), dtype=np.float32)
        origin = np.array(add(motion.position, to_world(motion.quaternion, ZED_MOUNT)), dtype=np.float32)

        def cast(in_body: NDArray[np.float32], range_per_depth: NDArray[np.float32]) -> NDArray[np.float32]:
            return range_per_depth / self._rays.distances(origin, in_body @ axes_in_world, self._reach, nothing=np.inf)

        def cast_between(pixels: Pixels) -> NDArray[np.float32]:
            return cast(self._rays_in_body.take(pixels, axis=0), self._range_per_depth.take(pixels))

        first = cast(self._first_in_body, self._first_range_per_depth)
        return self._infill.inverse_depths(first, cast_between)


def _inverted(inverse: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.divide(np.float32(1.0), inverse, out=np.zeros_like(inverse), where=inverse > 0.0)


def _unmatchable(disparity: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels that the second camera does not see, or sees too differently, from their disparities [px]."""
    width = disparity.shape[1]
    column = np.arange(width, dtype=np.float32) - disparity  # in the second camera's picture
    hidden = column < 0.0
    # A pixel is hidden only by pixels to its right within its own disparity.
    hidden |= column > _least_of_next(column, float(disparity.max()))
    # With all rows in one array, a neighbour is one element away, or one row.
    values, unmatched = disparity.reshape(-1), hidden.reshape(-1)
    for away in (1, width):
        steep = np.abs(values[away:] - values[:-away]) > _STEEPEST
        if away == 1:
            steep[width - 1 :: width] = False  # a row's last pixel and the first one of the next
        unmatched[:-away] |= steep
        unmatched[away:] |= steep
    return hidden


def _least_of_next(rows: NDArray[np.float32], count: float) -> NDArray[np.float32]:
    """The least of the `count` values, or more, to the right of each value; infinite at the edge."""
    height, width = rows.shape
    windows = [1 << k for k in range(width.bit_length()) if 1 << k <= min(count, width - 2)]
    # All rows in one array, each padded so that no window reaches into the next row.
    room = sum(windows) + 1
    padded = np.full((height, width - 1 + room), np.inf, dtype=np.float32)
    padded[:, : width - 1] = rows[:, 1:]
    least = padded.reshape(-1)
    for window in windows:
        least = np.minimum(least[:-window], least[window:])
    padded.reshape(-1)[: len(least)] = least
    return padded[:, :width]


class Infill:
    """Depth pictures from an eighth of their rays: pixels on a plane are interpolated, all others are cast.

    On a plane the inverse depth is a linear function of the pixel's position. If two known neighbours lie on one
    line with the next pixel on either side, the pixel between them lies on it too. Pixels at edges and on curved
    surfaces break the line and get a ray of their own. Objects narrower than two pixels, or lower than four, may be
    missed: thin upright objects are common, thin horizontal ones are rare.

    The width of pictures is even, the height a multiple of four.
    """

    def __init__(self, height: int, width: int) -> None:
        self._numbers = np.arange(height * width, dtype=np.intp).reshape(height, width)
        self.first: Pixels = self._numbers[::4, ::2].ravel()
        """Pixels that are always cast, in this order."""

    def inverse_depths(self, first: Image, cast: Cast) -> Image:
        """Inverse depths (height, width), 0 where there is no return, from those of the `first` pixels (n,)."""
        image, numbers = np.empty(self._numbers.shape, dtype=np.float32), self._numbers
        pixels = image.reshape(-1)
        pixels[self.first] = first
        for known, between, chosen_from in (
            (image[::4, ::2], image[2::4, ::2], numbers[2::4, ::2]),
            (image[::2, ::2].T, image[::2, 1::2].T, numbers[::2, 1::2].T),
            (image[::2], image[1::2], numbers[1::2]),
        ):
            between[:-1], bent = _between(known)
            chosen = chosen_from[bent]
            pixels[chosen] = cast(chosen)
        return image


def _between(known: Image) -> tuple[Image, NDArray[np.bool_]]:
    """Rows (n - 1, m) midway between the rows `known` (n, m), and a mask (n, m) of pixels after which the line breaks.

    The last row is masked as well.
    """
    step = known[1:] - known[:-1]
    middle = np.float32(0.5) * step
    middle += known[:-1]
    bend = np.abs(step[1:] - step[:-1])
    allowed = _STRAIGHT * middle
    bent = np.ones_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] &= bend > allowed[:-1]
    return middle, bent
