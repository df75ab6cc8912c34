"""Occupancy grid: hits fill, rays clear, and neither order nor place matters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from skillwing.onboard.mapping.mapper import Mapper
from skillwing.onboard.mapping.occupancy import OccupancyGrid, grid_shape
from skillwing.onboard.sensor_data.scans import PlacedPoints

SIZE = 0.5
ORIGIN = np.array([0.1, 0.1, 0.1])
# Away from the faces of voxels, where rounding decides.
coordinates = st.integers(-15, 15).map(lambda k: k * SIZE + 0.2)
points = st.tuples(coordinates, coordinates, coordinates)
clouds = st.lists(points, min_size=1, max_size=30).map(lambda cloud: np.array(cloud, dtype=np.float32))


def make_grid(shift: float = 0.0) -> OccupancyGrid:
    low, high = shift - 10.0, shift + 10.0
    return OccupancyGrid((low, low, low), (high, high, high), SIZE)


def integrate(grid: OccupancyGrid, cloud: NDArray[np.float32], origin: NDArray[np.float64] = ORIGIN) -> None:
    grid.integrate(origin, grid.hit_by(cloud))


@given(clouds)
@settings(max_examples=50, deadline=None)
def test_what_is_hit_again_and_again_is_occupied_and_nothing_else(cloud: NDArray[np.float32]) -> None:
    grid = make_grid()
    for _ in range(3):
        integrate(grid, cloud)
    expected = np.unique(np.floor((cloud + 10.0) / SIZE), axis=0) * SIZE - 10.0 + SIZE / 2
    assert np.array_equal(np.unique(grid.occupied_centres(), axis=0), expected.astype(np.float32))


def test_a_single_hit_is_not_enough() -> None:
    grid = make_grid()
    integrate(grid, np.array([[5.2, 0.2, 0.2]], dtype=np.float32))
    assert len(grid.occupied()) == 0


@given(st.integers(1, 20))
@settings(max_examples=20, deadline=None)
def test_rays_that_pass_clear_what_is_no_longer_there(hits: int) -> None:
    grid = make_grid()
    near, far = np.array([[4.2, 0.2, 0.2]], dtype=np.float32), np.array([[9.2, 0.2, 0.2]], dtype=np.float32)
    for _ in range(hits):
        integrate(grid, near)
    for _ in range(30):
        integrate(grid, far)
    assert np.allclose(grid.occupied_centres(), [[9.25, 0.25, 0.25]])


@given(clouds, st.randoms(use_true_random=False))
@settings(max_examples=30, deadline=None)
def test_the_order_of_points_and_their_number_in_a_voxel_do_not_matter(cloud: NDArray[np.float32], random) -> None:
    one, other = make_grid(), make_grid()
    order = list(range(len(cloud))) * 2
    random.shuffle(order)
    for _ in range(3):
        integrate(one, cloud)
        integrate(other, cloud[order])
    assert np.array_equal(one.occupied(), other.occupied())
    assert one.fit(one.hit_by(cloud)) == other.fit(other.hit_by(cloud))


@given(st.lists(clouds, min_size=1, max_size=15))
@settings(max_examples=50, deadline=None)
def test_to_ask_what_is_occupied_changes_nothing(scans: list[NDArray[np.float32]]) -> None:
    often, once = make_grid(), make_grid()
    for scan in scans * 2:
        integrate(often, scan)
        integrate(once, scan)
        assert often.count_occupied() == len(often.occupied())
    assert np.array_equal(often.occupied(), once.occupied())


@given(clouds, st.integers(-4, 4))
@settings(max_examples=30, deadline=None)
def test_a_world_moved_by_whole_voxels_gives_the_same_map_there(cloud: NDArray[np.float32], steps: int) -> None:
    shift = steps * SIZE
    here, there = make_grid(), make_grid(shift)
    for _ in range(3):
        integrate(here, cloud)
        integrate(there, cloud + np.float32(shift), ORIGIN + shift)
    assert np.array_equal(here.occupied(), there.occupied())
    assert np.allclose(here.occupied_centres() + shift, there.occupied_centres())


def test_what_lies_outside_the_box_is_left_out() -> None:
    grid = make_grid()
    for _ in range(3):
        integrate(grid, np.array([[50.0, 0.2, 0.2], [1e9, 0.0, -1e9]], dtype=np.float32))
    assert len(grid.occupied()) == 0


def test_changes_are_what_came_and_what_went() -> None:
    grid = make_grid()
    near, far = np.array([[4.2, 0.2, 0.2]], dtype=np.float32), np.array([[9.2, 0.2, 0.2]], dtype=np.float32)
    for _ in range(2):
        integrate(grid, near)
    before = grid.occupied()
    assert len(before) == 1
    for _ in range(20):
        integrate(grid, far)
    change = grid.changed_since(before)
    assert np.array_equal(change.vanished, before)
    assert np.array_equal(change.appeared, grid.occupied())


@pytest.mark.parametrize(
    ("low", "high", "size"),
    [((0.0, 0.0, 0.0), (1.0, 0.0, 1.0), 0.4), ((0.0,) * 3, (1.0,) * 3, 0.0), ((0.0,) * 3, (float("inf"),) * 3, 0.4)],
)
def test_a_box_without_a_finite_volume_is_refused(low, high, size) -> None:
    with pytest.raises(ValueError, match="finite volume"):
        grid_shape(low, high, size)


# --- the mapper, which decides what is taken in -------------------------------------------------------------


def wall(x: float) -> PlacedPoints:
    """A scan of a wall across the x axis, seen from the origin."""
    y, z = np.meshgrid(np.arange(-5.0, 5.0, 0.4), np.arange(-3.0, 3.0, 0.4))
    points = np.stack([np.full(y.shape, x), y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    return PlacedPoints(0.0, np.eye(3), ORIGIN, points)


def test_nothing_is_mapped_unless_it_runs_and_the_map_is_kept_when_it_stops() -> None:
    mapper = Mapper(make_grid())
    mapper.add(wall(8.2))
    assert mapper.scans == 0
    mapper.start()
    for _ in range(3):
        mapper.add(wall(8.2))
    mapper.stop()
    kept = mapper.grid.occupied()
    assert len(kept) > 100
    mapper.add(wall(5.2))
    assert np.array_equal(mapper.grid.occupied(), kept)
    mapper.start()
    assert np.array_equal(mapper.grid.occupied(), kept)
    assert mapper.scans == 3


def test_scans_that_contradict_the_map_do_not_spoil_it_and_in_a_row_mean_divergence() -> None:
    mapper = Mapper(make_grid())
    mapper.start()
    for _ in range(12):
        mapper.add(wall(8.2))
    sound = mapper.grid.occupied()
    for _ in range(9):
        mapper.add(wall(5.2))
    assert not mapper.diverged
    mapper.add(wall(8.2))
    for _ in range(9):
        mapper.add(wall(5.2))
    assert not mapper.diverged
    mapper.add(wall(5.2))
    assert mapper.diverged
    mapper.add(wall(8.2))
    assert np.array_equal(mapper.grid.occupied(), sound)
    assert mapper.scans == 13
    mapper.stop()
    mapper.start()
    assert mapper.diverged
    mapper.renew()
    assert (mapper.diverged, mapper.running, mapper.scans, len(mapper.grid.occupied())) == (False, True, 0, 0)
