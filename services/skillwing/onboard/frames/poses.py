"""Poses between recorded ones, and rotation matrices, for arrays of times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skillwing.onboard.frames.motion import Motion


def interpolate(track: Sequence[Motion], times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (N, 3) and unit quaternions (N, 4) at `times` (N,), linear between the samples of a dense track.

    Samples 10 ms apart turn by less than a degree, where normalised linear interpolation of quaternions is exact
    enough. Consecutive quaternions must lie on the same hemisphere, as those of an integrator do.
    """
    # Kept as rows of one component each, which the next steps take them apart into again.
    at, *components = np.array([(m.t, *m.position, *m.quaternion) for m in track]).T
    poses = np.stack([np.interp(times, at, component) for component in components])
    positions, quaternions = poses[:3], poses[3:]
    return positions.T, (quaternions / np.linalg.norm(quaternions, axis=0)).T


def rotations(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices (N, 3, 3), body to world, of unit quaternions (N, 4) as (w, x, y, z)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
