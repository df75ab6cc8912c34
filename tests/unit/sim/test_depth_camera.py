"""The depth picture, most of whose pixels are computed from their neighbours, against a ray for each pixel."""

from __future__ import annotations

import math

import numpy as np
import numpy_depth
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from skillwing.onboard.frames.pose_history import rotations
from skillwing.onboard.frames.vectors import Motion, add, to_world
from skillwing.onboard.sensor_data.directions import depth_directions
from skillwing.sim_mujoco.sensors.depth_camera import (
    BASELINE,
    FOCAL,
    REACH,
    ZED_MOUNT,
    DepthCamera,
    Infill,
    Pixels,
    _between,
    _hidden,
    _insert,
    _is_steep,
    _measured,
    depth_header,
)
from skillwing.sim_mujoco.sensors.instruments import NoiseTable
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import make_world

DISPARITIES = arrays(
    np.float32, st.tuples(st.integers(2, 4), st.integers(3, 12)), elements=st.sampled_from([0.0, 0.5, 1.0, 1.75, 2.5])
)


@pytest.mark.parametrize("heading", [0.0, 0.8, 1.6, 3.0])
def test_computed_pixels_agree_with_rays(heading: float) -> None:
    rays = RayScene(make_world(2).triangles())
    quaternion = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    motion = Motion(0.0, (12.0, 1.0, 4.0), (0.0, 0.0, 0.0), quaternion, (0.0, 0.0, 0.0))
    computed = DepthCamera(rays, np.random.default_rng(0)).true_depth(motion)

    directions = depth_directions(depth_header(0.0)).reshape(-1, 3)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    origin = np.array(add(motion.position, to_world(quaternion, ZED_MOUNT)), dtype=np.float32)
    turn = rotations(np.array([quaternion]))[0].astype(np.float32)
    ranges = rays.distances(origin, (directions / length) @ turn.T, REACH * float(length.max()))
    cast = (ranges / length[:, 0]).reshape(computed.shape)

    near = (cast > 0.0) & (cast < REACH)
    error = np.abs(computed - cast)[near] / cast[near]
    assert np.quantile(error, 0.999) < 0.005
    assert np.count_nonzero(near != ((computed > 0.0) & (computed < REACH))) < 0.001 * near.size


@pytest.mark.parametrize("edge", [8, 9, 14])
def test_an_edge_between_two_planes_takes_one_ray_a_row(edge: int) -> None:
    columns, height = np.arange(24, dtype=np.float32), 8
    row = np.where(columns < edge, 0.2 + 0.001 * columns, 0.05 + 0.002 * columns).astype(np.float32)
    picture, infill, asked = np.tile(row, (height, 1)), Infill(height, len(row)), np.zeros((height, len(row)), bool)

    def cast(pixels: Pixels) -> np.ndarray:
        asked.flat[pixels] = True
        return picture.flat[pixels]

    computed = infill.inverse_depths(picture.flat[infill.first], cast)
    assert np.allclose(computed, picture, atol=1e-6)
    last = columns == len(row) - 1  # of these there is no neighbour on the right
    assert np.array_equal(np.flatnonzero(asked[0] & ~last), [(edge - 1) // 2 * 2 + 1])


@pytest.mark.parametrize("low", range(4, 8))
@pytest.mark.parametrize("left", range(4, 6))
def test_what_is_two_pixels_wide_or_four_high_is_seen(low: int, left: int) -> None:
    for shape in (np.s_[low : low + 4, :], np.s_[:, left : left + 2]):
        picture = np.full((16, 12), 0.05, dtype=np.float32)
        picture[shape] = 0.2
        infill = Infill(*picture.shape)
        computed = infill.inverse_depths(picture.flat[infill.first], lambda pixels, of=picture: of.flat[pixels])
        assert np.array_equal(computed, picture)


def test_a_wall_seen_slantwise_is_matched_up_to_the_end_of_each_row() -> None:
    ramp = np.tile(np.linspace(0.0, 39.0, 320, dtype=np.float32), (4, 1))
    assert not _unmatchable(ramp).any()


@given(DISPARITIES)
def test_a_pixel_is_lost_where_it_is_hidden_or_disparity_changes_steeply(disparity: np.ndarray) -> None:
    height, width = disparity.shape

    def lost(row: int, column: int) -> bool:
        own = disparity[row, column]
        seen_at = column - own
        if seen_at < 0.0 or any(right - disparity[row, right] < seen_at for right in range(column + 1, width)):
            return True
        around = ((row, column - 1), (row, column + 1), (row - 1, column), (row + 1, column))
        return any(0 <= r < height and 0 <= c < width and abs(disparity[r, c] - own) > 1.0 for r, c in around)

    expected = [[lost(row, column) for column in range(width)] for row in range(height)]
    assert _unmatchable(disparity).tolist() == expected


@st.composite
def images(draw: st.DrawFn, count: int) -> list[np.ndarray]:
    """Images of one size. Inverse depths are in the first, with values beyond the reach and without a return."""
    shape = draw(st.tuples(st.integers(2, 9), st.integers(2, 40)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    ramps = rng.uniform(0.02, 0.5) + rng.normal(0.0, 0.003, shape).cumsum(axis=1)
    inverse = np.where(rng.random(shape) < 0.1, 0.0, np.abs(ramps))
    noises = [rng.standard_normal(shape) * draw(st.sampled_from([0.3, 1.0, 3.0])) for _ in range(count - 1)]
    return [np.asarray(each, dtype=np.float32) for each in (inverse, *noises)]


@given(images(3))
def test_loops_measure_what_numpy_measures(given_images: list[np.ndarray]) -> None:
    inverse, matching, noise = given_images
    disparity = np.float32(FOCAL * BASELINE) * inverse
    found = _measured(inverse, disparity, _hidden(disparity), matching, noise)
    assert np.array_equal(found, numpy_depth.measured(inverse, matching, noise))
    assert np.array_equal(_unmatchable(disparity), numpy_depth.unmatchable(disparity))


@given(images(1), st.sampled_from([np.s_[:], np.s_[::2], np.s_[:, ::2]]), st.booleans())
def test_loops_interpolate_as_numpy_does(given_images: list[np.ndarray], part: slice, turned: bool) -> None:
    known = given_images[0][part]
    known = known.T if turned else known
    (middle, bent), numbers = numpy_depth.between(known), np.arange(known.size).reshape(known.shape)
    assert all(map(np.array_equal, _between(known), (middle, bent)))
    room = np.zeros((known.shape[0], known.shape[1]), dtype=np.float32)
    assert np.array_equal(_insert(middle, bent, room, numbers), numbers[bent])
    assert np.array_equal(room[:-1], middle)


def test_a_whole_picture_is_the_same_in_numpy() -> None:
    rays = RayScene(make_world(1).triangles())
    camera, noise = DepthCamera(rays, np.random.default_rng(5)), NoiseTable(np.random.default_rng(5))
    motion = Motion(0.0, (12.0, 1.0, 4.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    inverse = camera._inverse_depth(motion)
    drawn = [noise.draw(inverse.size).reshape(inverse.shape) for _ in range(2)]
    assert np.array_equal(camera.picture(motion), numpy_depth.measured(inverse, *drawn))


def _unmatchable(disparity: np.ndarray) -> np.ndarray:
    """Pixels that are hidden, or whose disparity is steep."""
    return _hidden(disparity) | [[_is_steep(disparity, *at) for at in row] for row in _places(disparity)]


def _places(image: np.ndarray) -> list[list[tuple[int, int]]]:
    rows, columns = image.shape
    return [[(row, column) for column in range(columns)] for row in range(rows)]
