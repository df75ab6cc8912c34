"""Similarity of a received picture to its original: SSIM.

Wang, Bovik, Sheikh, Simoncelli: "Image Quality Assessment: From Error Visibility to Structural Similarity", IEEE
Transactions on Image Processing 13(4), 2004; with windows of 7 x 7 pixels, of the brightness only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

WINDOW = 7
_C1, _C2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
_WEIGHTS = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601


def similarity(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Mean SSIM of two pictures (height, width, 3) of the same size: 1 for the same, 0 for unrelated ones."""
    if one.shape != other.shape:
        raise ValueError(f"pictures of {one.shape} and {other.shape} cannot be compared")
    x, y = _brightness(one), _brightness(other)
    mean_x, mean_y = _mean(x), _mean(y)
    unbiased = WINDOW**2 / (WINDOW**2 - 1)
    var_x = unbiased * (_mean(x * x) - mean_x * mean_x)
    var_y = unbiased * (_mean(y * y) - mean_y * mean_y)
    cov = unbiased * (_mean(x * y) - mean_x * mean_y)
    alike = (2 * mean_x * mean_y + _C1) * (2 * cov + _C2)
    apart = (mean_x * mean_x + mean_y * mean_y + _C1) * (var_x + var_y + _C2)
    edge = WINDOW // 2
    return float((alike / apart)[edge:-edge, edge:-edge].mean())


def _brightness(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    return (picture @ _WEIGHTS).astype(np.float32)


def _mean(values: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(uniform_filter(values, WINDOW), dtype=np.float32)
