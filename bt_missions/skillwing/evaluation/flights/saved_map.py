"""A map as a flight leaves it behind. The recorder writes it, without the packages of the judge that reads it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SavedMap:
    """Centres (n, 3) of occupied voxels [m], and the mapping node's name for the source of its poses."""

    centres: NDArray[np.float32]
    voxel_size: float
    pose_source: str
