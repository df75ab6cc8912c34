"""Stereo depth camera along the nose: 320 x 180 pixels, 15 Hz, 54 degrees high, up to 20 m.

A pixel has a depth only if it is found again in the picture of the second camera, 12 cm to the right. Three causes make
holes. The second camera does not see the point: something nearer hides it, or it lies outside the picture. The depth
changes too steeply for a match, at edges and on oblique surfaces (Burt and Julesz, 1980: a disparity gradient of 1).
And matching fails at random, more often at larger depths.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.vectors import Motion, add, axes, to_world
from skillwing.onboard.sensor_data.directions import DEPTH_NOISE, depth_directions
from skillwing.sim_mujoco.compiled import compiled
from skillwing.sim_mujoco.sensors.depth_pictures import FOCAL, HEIGHT, NEAREST, REACH, WIDTH, ZED_MOUNT, depth_header
from skillwing.sim_mujoco.sensors.instruments import NoiseTable

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.rays import RayScene

Pixels = NDArray[np.intp]
Image = NDArray[np.float32]
Cast = Callable[[Pixels], Image]
"""Ray caster: from numbers of pixels, counted row by row, to their inverse depths (n,)."""

_STRAIGHT = np.float32(2e-3)
"""Largest deviation of neighbours from one line, relative to the value."""

BASELINE = 0.12
"""Distance of the two cameras [m]."""
_STEEPEST = 1.0
"""Disparity gradient that can still be matched [pixels per pixel]."""
_UNMATCHED, _UNMATCHED_FAR = 3.0, 1.4
"""Standard deviations of a fluctuation above which a pixel fails to match: nearby (0.1 %), and at the end of the reach
(8 %)."""
_WORST, _WORSE = np.float32(_UNMATCHED), np.float32((_UNMATCHED - _UNMATCHED_FAR) / REACH)
_NOISE, _LEAST, _MOST = np.float32(DEPTH_NOISE), np.float32(NEAREST), np.float32(REACH)
_HALF = np.float32(0.5)


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
        matching, noise = (self._noise.draw(inverse.size).reshape(inverse.shape) for _ in range(2))
        disparity = np.float32(FOCAL * BASELINE) * inverse
        return _measured(inverse, disparity, _hidden(disparity), matching, noise)

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


@compiled
def _hidden(disparity: Image) -> NDArray[np.bool_]:
    """Pixels that the second camera does not see, from their disparities [px]: a pixel to the right is in front of
    them, or they are outside its picture."""
    height, width = disparity.shape
    hidden = np.empty((height, width), dtype=np.bool_)
    for row in range(height):
        least = np.float32(np.inf)
        for step in range(width):
            column = width - 1 - step
            # Its column in the second camera's picture.
            place = np.float32(column) - disparity[row, column]
            hidden[row, column] = (place < 0.0) | (place > least)
            least = min(least, place)
    return hidden


@compiled
def _is_steep(disparity: Image, row: int, column: int) -> bool:
    """Test for a pixel whose disparity differs too much from a neighbour's for a match."""
    height, width = disparity.shape
    here = disparity[row, column]
    above, below = disparity[max(row - 1, 0), column], disparity[min(row + 1, height - 1), column]
    left, right = disparity[row, max(column - 1, 0)], disparity[row, min(column + 1, width - 1)]
    across = max(abs(left - here), abs(right - here))
    return max(across, abs(above - here), abs(below - here)) > _STEEPEST


@compiled
def _measured(inverse: Image, disparity: Image, lost: NDArray[np.bool_], matching: Image, noise: Image) -> Image:
    """Depths with noise, 0 where there is no return, where the pixel is `lost` already, or where it is not matched."""
    depth = np.zeros_like(inverse)
    for row in range(inverse.shape[0]):
        for column in range(inverse.shape[1]):
            if inverse[row, column] > 0.0 and not lost[row, column]:
                true = np.float32(1.0) / inverse[row, column]
                unmatched = matching[row, column] > _WORST - _WORSE * true
                value = true + _NOISE * true * true * noise[row, column]
                if not (unmatched | (value < _LEAST) | (value > _MOST) | _is_steep(disparity, row, column)):
                    depth[row, column] = value
    return depth


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
            chosen = _insert(*_between(known), between, chosen_from)
            pixels[chosen] = cast(chosen)
        return image


@compiled
def _between(known: Image) -> tuple[Image, NDArray[np.bool_]]:
    """Rows (n - 1, m) midway between the rows `known` (n, m), and a mask (n, m) of pixels after which the line breaks.

    The last row is masked as well.
    """
    count, width = known.shape
    middle = np.empty((count - 1, width), dtype=np.float32)
    bent = np.ones((count, width), dtype=np.bool_)
    for row in range(count - 1):
        for column in range(width):
            middle[row, column] = _HALF * (known[row + 1, column] - known[row, column]) + known[row, column]
    for row in range(count - 2):
        for column in range(width):
            here = known[row + 1, column]
            bend = abs((known[row + 2, column] - here) - (here - known[row, column]))
            bent[row + 1, column] = bend > _STRAIGHT * middle[row + 1, column]
            bent[row, column] &= bend > _STRAIGHT * middle[row, column]
    return middle, bent


@compiled
def _insert(middle: Image, bent: NDArray[np.bool_], between: Image, numbers: Pixels) -> Pixels:
    """Put the rows `middle` (n - 1, m) into `between` (n, m); return the `numbers` (n, m) where the line is bent."""
    count, width = bent.shape
    chosen, found = np.empty(count * width, dtype=np.intp), 0
    for row in range(count):
        for column in range(width):
            if row < count - 1:
                between[row, column] = middle[row, column]
            if bent[row, column]:
                chosen[found] = numbers[row, column]
                found += 1
    return chosen[:found]
