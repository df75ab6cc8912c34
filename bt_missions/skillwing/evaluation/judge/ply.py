"""A map as a file for point cloud viewers: PLY, binary, little-endian (Turk, "The PLY polygon file format", 1994)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from skillwing.dsl.whole_files import write_whole

_HEADER = """ply
format binary_little_endian 1.0
comment centres of occupied voxels of {size:g} m; x east, y north, z up, origin on the home pad
comment poses: {source}
element vertex {count}
property float x
property float y
property float z
end_header
"""


def write_ply(file: Path, centres: NDArray[np.float32], voxel_size: float, source: str = "not told") -> None:
    """Write the centres (n, 3) of occupied voxels [m]; `source` says in words where the poses came from.

    The file appears complete or not at all.
    """
    header = _HEADER.format(size=voxel_size, source=" ".join(source.split()), count=len(centres))
    write_whole(file, header.encode("ascii", "replace") + centres.astype("<f4").tobytes())
