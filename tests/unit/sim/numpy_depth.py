"""Reference for the compiled loops of the depth camera: the same rules in NumPy."""

from __future__ import annotations

import numpy as np

from skillwing.sim_mujoco.sensors.depth_camera import BASELINE
from skillwing.sim_mujoco.sensors.depth_pictures import FOCAL, NEAREST, REACH, noise_at

UNMATCHED, UNMATCHED_FAR, STEEPEST, STRAIGHT = 3.0, 1.4, 1.0, np.float32(2e-3)


def measured(inverse: np.ndarray, matching: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Depths with noise and holes, from inverse depths and two arrays of normal numbers."""
    depth = np.divide(np.float32(1.0), inverse, out=np.zeros_like(inverse), where=inverse > 0.0)
    lost = unmatchable(np.float32(FOCAL * BASELINE) * inverse)
    worse = np.float32((UNMATCHED - UNMATCHED_FAR) / REACH)
    lost |= matching > np.float32(UNMATCHED) - worse * depth
    depth += noise_at(depth) * noise
    lost |= (depth < NEAREST) | (depth > REACH)
    depth[lost] = 0.0
    return depth


def unmatchable(disparity: np.ndarray) -> np.ndarray:
    width = disparity.shape[1]
    column = np.arange(width, dtype=np.float32) - disparity
    lost = column < 0.0
    least = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    lost[:, :-1] |= column[:, :-1] > least[:, 1:]
    for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        steep = np.abs(disparity[other] - disparity[one]) > STEEPEST
        lost[one] |= steep
        lost[other] |= steep
    return lost


def between(known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    step = known[1:] - known[:-1]
    middle = np.float32(0.5) * step
    middle += known[:-1]
    bend = np.abs(step[1:] - step[:-1])
    allowed = STRAIGHT * middle
    bent = np.ones_like(known, dtype=np.bool_)
    bent[1:-1] = bend > allowed[1:]
    bent[:-2] &= bend > allowed[:-1]
    return middle, bent
