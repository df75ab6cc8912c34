"""Compiled loops of the RGB camera: from the faces behind its pixels to their colours.

`exp`, `log2` and `sin` of whole pictures stay in NumPy, whose vector instructions are faster than a loop.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skillwing.sim_mujoco.camera.texture import COARSEST, SIDE
from skillwing.sim_mujoco.compiled import compiled

Array = NDArray[np.float32]
Faces = NDArray[np.int32]
Numbers = NDArray[np.int32]
Rgb = tuple[float, float, float]
LEVELS = 2048
"""Number of levels of light between 0 and 1."""
_TOP = np.float32(LEVELS - 1)
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)


class Surfaces(NamedTuple):
    """Tables by face; the sky is the last one.

    colours (3, F), facing_sun and open_sky (F,): as in `Appearance`. u_of_x, u_of_y, flat (F,): coordinates of a
    pattern, u = u_of_x x + u_of_y y, and v = y on flat faces, z on others. kind (F,): number of the pattern.
    """

    colours: Array
    facing_sun: Array
    open_sky: Array
    u_of_x: Array
    u_of_y: Array
    flat: Array
    kind: Numbers


class Paint(NamedTuple):
    """Strips on the ground. set_of (F,): number of each face's set of strips. first (S + 1,), members: the strips of
    each set, the lowest one first. strips (K, 7): start, direction, length, half width, and 1 for round ends [m];
    colours (K, 3)."""

    set_of: Numbers
    first: Numbers
    members: Numbers
    strips: Array
    colours: Array


class Texels(NamedTuple):
    """All resolutions of all patterns: their values, the start of each, and the patterns' texels per metre."""

    values: Array
    start: Numbers
    per_metre: Array


class Lights(NamedTuple):
    """Colours of the sun, of the sky's light and of the horizon, (3,) each."""

    sun: Array
    sky: Array
    horizon: Array


@compiled
def placed(inverse: Array, directions: Array, length: Array, origin: Array, nearest: np.float32) -> tuple[Array, Array]:
    """Places (3, N) of pixels and their distances (N,) [m]; `nearest` is the least inverse depth."""
    count = len(length)
    places, away = np.empty((3, count), dtype=np.float32), np.empty(count, dtype=np.float32)
    for pixel in range(count):
        away[pixel] = length[pixel] / max(inverse[pixel], nearest)
    for axis in range(3):
        for pixel in range(count):
            places[axis, pixel] = directions[axis, pixel] * away[pixel] + origin[axis]
    return places, away


@compiled
def rows_at(columns: Array, numbers: NDArray[np.intp]) -> Array:
    """Rows (n, 3) of the columns of these numbers (n,) in a table (3, N)."""
    rows = np.empty((len(numbers), 3), dtype=np.float32)
    for place in range(len(numbers)):
        for axis in range(3):
            rows[place, axis] = columns[axis, numbers[place]]
    return rows


@compiled
def rays_to_sun(
    faces: Faces, places: Array, facing_sun: Array, normals: Array, close: np.float32
) -> tuple[Array, NDArray[np.intp]]:
    """Origins (n, 3) of rays to the sun, from every other pixel of every other row that faces it; and the numbers (n,)
    of these pixels in a picture of half the size."""
    height, width = faces.shape
    starts = np.empty((height * width // 4, 3), dtype=np.float32)
    numbers = np.empty(len(starts), dtype=np.intp)
    count = 0
    for row in range(0, height, 2):
        for column in range(0, width, 2):
            face = faces[row, column]
            if facing_sun[face] == 0.0:
                continue
            for axis in range(3):
                starts[count, axis] = places[axis, row * width + column] + close * normals[face, axis]
            numbers[count] = row // 2 * (width // 2) + column // 2
            count += 1
    return starts[:count], numbers[:count]


@compiled
def texels_in_pixels(faces: Faces, away: Array, kind: Numbers, per_metre: Array, pixel: np.float32) -> Array:
    """Width of each pixel (N,) in texels of its pattern, at least 1. pixel: its width at a distance of 1 m [m]."""
    found = np.empty(len(away), dtype=np.float32)
    for number in range(len(away)):
        found[number] = max(away[number] * pixel * per_metre[kind[faces[number]]], _ONE)
    return found


@compiled
def is_covered(strip: Array, x: np.float32, y: np.float32) -> bool:
    """Test for a place on a strip, a row of `Paint.strips`."""
    right, up = x - strip[0], y - strip[1]
    along, aside = right * strip[2] + up * strip[3], up * strip[2] - right * strip[3]
    beyond = max(along - strip[4], _ZERO) + max(-along, _ZERO)
    return math.hypot(aside, beyond) <= strip[5] and (strip[6] > 0.0 or beyond == 0.0)


@compiled
def strip_at(paint: Paint, face: int, x: np.float32, y: np.float32) -> int:
    """Number of the topmost strip at a place on a face, -1 for none."""
    which = paint.set_of[face]
    if which < len(paint.first) - 1:
        for step in range(paint.first[which + 1] - paint.first[which]):
            number = int(paint.members[paint.first[which + 1] - 1 - step])
            if is_covered(paint.strips[number], x, y):
                return number
    return -1


@compiled
def texel(table: Texels, kind: int, u: np.float32, v: np.float32, halvings: np.float32) -> np.float32:
    """Factor of a pattern at u, v [m]; halvings: those of its resolution, to be rounded."""
    per_metre = table.per_metre[kind]
    level = min(np.int32(np.rint(halvings)), COARSEST)
    # Halving a number of texels, a power of two, is a shift of its binary digits.
    column = (np.int32(np.floor(u * per_metre)) & (SIDE - 1)) >> level
    row = (np.int32(np.floor(v * per_metre)) & (SIDE - 1)) >> level
    start = table.start[kind * (COARSEST + 1) + level]
    return np.float32(table.values[start + (row << (COARSEST - level)) + column])


@compiled
def brightness(
    surfaces: Surfaces, table: Texels, face: int, place: tuple[np.float32, ...], halvings: np.float32
) -> np.float32:
    """Factor of the pattern at a place (3,) on a face."""
    x, y, z = place
    u = surfaces.u_of_x[face] * x + surfaces.u_of_y[face] * y
    v = z + surfaces.flat[face] * (y - z)
    return texel(table, surfaces.kind[face], u, v, halvings)


@compiled
def developed(
    surfaces: Surfaces,
    paint: Paint,
    table: Texels,
    lights: Lights,
    faces: Faces,
    places: Array,
    patches: Array,
    halvings: Array,
    haze: Array,
    upward: Array,
    sunny: Array,
    greys: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """Picture (height, width, 3) of faces (height, width).

    patches (N,): factors of the grass. halvings (N,): of the patterns. haze (N,): contrast of a colour to the horizon's
    behind haze. The sky has less of it low above the horizon: `upward` (N,) is the height of a unit direction. sunny
    (height / 2, width / 2): 1 in the sun, 0 in the shade. greys: values of the levels of light.
    """
    height, width = faces.shape
    picture = np.empty((height, width, 3), dtype=np.uint8)
    for row in range(height):
        for column in range(width):
            face, pixel = faces[row, column], row * width + column
            x, y, z = places[0, pixel], places[1, pixel], places[2, pixel]
            strip = strip_at(paint, face, x, y)
            factor = brightness(surfaces, table, face, (x, y, z), np.float32(halvings[pixel]))
            contrast = haze[pixel] if face >= 0 else math.sqrt(max(upward[pixel], _ZERO))
            sun, sky = surfaces.facing_sun[face] * sunny[row // 2, column // 2], surfaces.open_sky[face]
            for band in range(3):
                colour = surfaces.colours[band, face] * patches[pixel] if strip < 0 else paint.colours[strip, band]
                light = colour * factor * (lights.sun[band] * sun + lights.sky[band] * sky)
                light = (light - lights.horizon[band]) * contrast + lights.horizon[band]
                picture[row, column, band] = greys[np.uint16(min(max(light * _TOP, _ZERO), _TOP))]
    return picture
