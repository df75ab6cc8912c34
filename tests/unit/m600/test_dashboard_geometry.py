"""Geometry of the dashboard: points stand where the sensor saw them, and map pieces form the whole map."""

from __future__ import annotations

import io
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from matplotlib.image import imread

from skillwing.evaluation.dashboard.depth_png import depth_png
from skillwing.evaluation.dashboard.geometry import DEPTH_STEP, GRAIN, Throttle, by_height, depth_levels, world_points
from skillwing.evaluation.dashboard.voxel_pieces import VoxelPieces
from skillwing.onboard.sensor_data.directions import lidar_directions
from skillwing.onboard.topics.navigation import Navigation

cells = st.tuples(st.integers(-200, 200), st.integers(-200, 200), st.integers(-20, 60))
maps = st.sets(cells, max_size=60)
SIZE = 0.4


def centres(of: set[tuple[int, int, int]]) -> np.ndarray:
    return ((np.array(sorted(of), np.float32).reshape(-1, 3) + 0.5) * SIZE).astype(np.float32)


def drawn(pieces: VoxelPieces, screen: dict[int, np.ndarray], changed: set[int]) -> set[tuple[int, int, int]]:
    """Screen content after the changed pieces were drawn again."""
    screen |= {number: pieces.centres(number) for number in changed}
    points = np.vstack([np.empty((0, 3), np.float32), *screen.values()])
    assert len(points) == len(pieces)
    return {(x, y, z) for x, y, z in np.floor(points / SIZE).astype(int).tolist()}


@given(st.lists(st.tuples(st.booleans(), maps), max_size=6))
def test_drawing_only_what_changed_shows_the_whole_map(steps: list[tuple[bool, set[tuple[int, int, int]]]]) -> None:
    pieces, screen, expected = VoxelPieces(SIZE, capacity=7), dict[int, np.ndarray](), set[tuple[int, int, int]]()
    for whole, voxels in steps:
        expected = voxels if whole else expected | voxels
        changed = pieces.replace(centres(voxels)) if whole else pieces.add(centres(voxels))
        assert drawn(pieces, screen, changed) == expected
        assert all(len(piece) <= 7 for piece in screen.values())


@given(maps)
def test_what_is_known_changes_nothing(voxels: set[tuple[int, int, int]]) -> None:
    pieces = VoxelPieces(SIZE)
    pieces.add(centres(voxels))
    assert pieces.add(centres(voxels)) == set()
    assert pieces.replace(centres(voxels)) == set()


@given(st.floats(-math.pi, math.pi), st.integers(0, 31))
def test_a_return_is_drawn_at_its_range_from_the_sensor(heading: float, column: int) -> None:
    pose = Navigation(
        t=0.0,
        position=(3.0, -2.0, 5.0),
        velocity=(0.0, 0.0, 0.0),
        quaternion=(math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)),
        angular_velocity=(0.0, 0.0, 0.0),
        heading=heading,
    )
    ranges = np.zeros((32, 16), np.float32)
    ranges[column, 4] = 10.0
    (point,) = world_points(ranges, lidar_directions(32, 16), (0.0, 0.0, -0.42), pose)
    assert math.isclose(math.dist(point, (3.0, -2.0, 4.58)), 10.0, abs_tol=2 * GRAIN)
    # Beams lean fore and aft of a ring that is orthogonal to the nose: along it a return can lie 2.6 m at most.
    along = (point[0] - 3.0) * math.cos(heading) + (point[1] + 2.0) * math.sin(heading)
    assert abs(along) < 10.0 * math.sin(math.radians(15.0)) + 2 * GRAIN


def test_depth_keeps_its_metres() -> None:
    image = np.array([[0, 1, 8_000, 1], [1, 1, 1, 1], [20_000, 1, 65_000, 1], [1, 1, 1, 1]], np.uint16)
    levels = depth_levels(image)
    assert levels.shape == (2, 2)
    assert np.allclose(levels * DEPTH_STEP, [[0.0, 8.0], [20.0, 20.4]], atol=DEPTH_STEP / 2)


@given(arrays(np.uint16, array_shapes(min_dims=2, max_dims=2, max_side=20)))
def test_a_depth_png_can_be_read_by_others(picture: np.ndarray) -> None:
    read = imread(io.BytesIO(depth_png(picture)), format="png")
    assert np.array_equal(np.round(read * 65535).astype(np.uint16), picture)


def test_colours_rise_from_blue_to_red() -> None:
    low, high = by_height(np.array([[0, 0, -1.0], [0, 0, 20.0]], np.float32), 8.0).astype(int)
    assert low[2] > low[0]
    assert high[0] > high[2]


@given(st.lists(st.floats(0.001, 0.5), min_size=1, max_size=100))
def test_a_throttle_lets_through_no_more_than_its_rate(gaps: list[float]) -> None:
    throttle, t, passed = Throttle(0.2), 0.0, 0
    for gap in gaps:
        t += gap
        passed += throttle.due(t)
    assert 1 <= passed <= t / 0.2 + 1.001
