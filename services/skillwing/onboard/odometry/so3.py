"""Rotations as matrices, and small ones as vectors: the exponential map of SO(3), for one or for arrays of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def skew(vectors: Floats) -> Floats:
    """Matrices (..., 3, 3) that multiply like the cross product with `vectors` (..., 3) from the left."""
    matrices = np.zeros((*vectors.shape, 3))
    matrices[..., 0, 1], matrices[..., 0, 2] = -vectors[..., 2], vectors[..., 1]
    matrices[..., 1, 0], matrices[..., 1, 2] = vectors[..., 2], -vectors[..., 0]
    matrices[..., 2, 0], matrices[..., 2, 1] = -vectors[..., 1], vectors[..., 0]
    return matrices


def crossed(one: Floats, other: Floats) -> tuple[Floats, Floats, Floats]:
    """Coordinates (...) of the cross products of vectors (3, ...), much faster than by numpy's own function."""
    (x, y, z), (a, b, c) = one, other
    return y * c - z * b, z * a - x * c, x * b - y * a


def exp(vectors: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad], by Rodrigues' formula."""
    angles = np.linalg.norm(vectors, axis=-1)[..., None, None]
    cross = skew(vectors)
    # np.sinc(x) is sin(pi x) / (pi x), which is sound at zero.
    first = np.sinc(angles / np.pi)
    second = 0.5 * np.sinc(angles / (2.0 * np.pi)) ** 2
    return np.eye(3) + first * cross + second * (cross @ cross)


def log(turn: Floats) -> Floats:
    """The rotation vector (3,) [rad] of a rotation matrix (3, 3) by less than half a turn."""
    axis = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = math.sqrt(axis @ axis)
    angle = math.atan2(sine, 0.5 * (float(np.trace(turn)) - 1.0))
    return axis if sine < 1e-12 else axis * (angle / sine)


def between(start: Floats, end: Floats) -> Floats:
    """The smallest rotation (3, 3) that turns the direction of `start` (3,) into that of `end`, unless they are
    opposite."""
    one, other = start / np.linalg.norm(start), end / np.linalg.norm(end)
    cross = skew(np.array(crossed(one, other)))
    return np.eye(3) + cross + cross @ cross / (1.0 + one @ other)


def quaternion(turn: Floats) -> tuple[float, float, float, float]:
    """The unit quaternion (w, x, y, z), w >= 0, of a rotation matrix (3, 3), by Shepperd's method (1978)."""
    (a, b, c), (d, e, f), (g, h, i) = turn.tolist()
    # Four times the products of each two of its numbers. Any row has the right ratios, the largest the fewest errors.
    products = np.array(
        [
            [1.0 + a + e + i, h - f, c - g, d - b],
            [h - f, 1.0 + a - e - i, b + d, c + g],
            [c - g, b + d, 1.0 - a + e - i, f + h],
            [d - b, c + g, f + h, 1.0 - a - e + i],
        ]
    )
    row = products[int(np.argmax(np.diag(products)))]
    w, x, y, z = (row / math.copysign(float(np.linalg.norm(row)), row[0])).tolist()
    return w, x, y, z


def matrix(wxyz: Floats) -> Floats:
    """The rotation matrix (3, 3) of a quaternion (4,), (w, x, y, z), of any length but zero."""
    w, x, y, z = wxyz / np.linalg.norm(wxyz)
    cross = skew(np.array([x, y, z]))
    return np.eye(3) + 2.0 * (w * cross + cross @ cross)
