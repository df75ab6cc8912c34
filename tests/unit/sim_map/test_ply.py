"""The map as a PLY file, read back by the letter of the format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from skillwing.evaluation.judge.ply import write_ply


def read(file: Path) -> tuple[list[str], np.ndarray]:
    header, _, body = file.read_bytes().partition(b"end_header\n")
    return header.decode("ascii").splitlines(), np.frombuffer(body, "<f4").reshape(-1, 3)


@pytest.mark.parametrize("count", [0, 1, 1000])
def test_a_map_comes_back_as_it_was(tmp_path: Path, count: int) -> None:
    centres = np.random.default_rng(1).normal(0.0, 30.0, (count, 3)).astype(np.float32)
    write_ply(tmp_path / "map.ply", centres, 0.4, "LiDAR-inertial\nodometry, 5°")
    header, points = read(tmp_path / "map.ply")
    assert header[:2] == ["ply", "format binary_little_endian 1.0"]
    assert f"element vertex {count}" in header
    assert "comment poses: LiDAR-inertial odometry, 5?" in header
    assert [line for line in header if line.startswith("property")] == [f"property float {axis}" for axis in "xyz"]
    assert np.array_equal(points, centres)
    assert [file.name for file in tmp_path.iterdir()] == ["map.ply"]
