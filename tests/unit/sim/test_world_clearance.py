"""The distance to the nearest surface, which judges report."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.sim_mujoco.physics.clearance import Clearance
from skillwing.sim_mujoco.world.triangles import Triangles

coordinate = st.floats(-30.0, 30.0)


@given(
    st.lists(st.tuples(*[coordinate] * 3), min_size=1, max_size=12),
    st.tuples(*[coordinate] * 3),
    st.integers(0, 1000),
)
@settings(max_examples=50, deadline=None)
def test_it_is_the_least_distance_to_any_point_on_any_triangle(
    corners: list[tuple[float, ...]], point: tuple[float, float, float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    first = np.array(corners)
    triangles = np.stack([first, first + rng.uniform(-4, 4, first.shape), first + rng.uniform(-4, 4, first.shape)], 1)
    labels = np.zeros(len(first), np.int8)
    soup = Triangles(
        triangles.reshape(-1, 3).astype(np.float32), np.arange(3 * len(first), dtype=np.int32).reshape(-1, 3), labels
    )
    distance = Clearance(soup, ignore=1, reach=40.0).distance(point)
    share = np.linspace(0.0, 1.0, 60)
    u, v = (each.ravel() for each in np.meshgrid(share, share))
    u, v = u[u + v <= 1.0], v[u + v <= 1.0]
    sides = triangles[:, 1:] - triangles[:, :1]
    spots = triangles[:, 0, None] + u[None, :, None] * sides[:, 0, None] + v[None, :, None] * sides[:, 1, None]
    sampled = float(np.linalg.norm(spots - np.array(point), axis=-1).min())
    grid = 8.0 / 59
    assert distance <= min(sampled, 40.0) + 1e-4
    assert distance >= min(sampled - grid, 40.0) - 1e-4


@given(
    st.integers(0, 1000), st.lists(st.tuples(*[st.floats(-0.7, 0.7)] * 3), max_size=20), st.tuples(*[coordinate] * 3)
)
@settings(max_examples=50, deadline=None)
def test_along_a_way_it_tells_what_it_tells_of_each_place(
    seed: int, steps: list[tuple[float, float, float]], start: tuple[float, float, float]
) -> None:
    corners = np.random.default_rng(seed).uniform(-20.0, 20.0, (90, 3)).astype(np.float32)
    soup = Triangles(corners, np.arange(90, dtype=np.int32).reshape(-1, 3), np.zeros(30, np.int8))
    along, place = Clearance(soup, ignore=1), start
    for step in ((0.0, 0.0, 0.0), *steps):
        x, y, z = (at + by for at, by in zip(place, step, strict=True))
        place = x, y, z
        assert along.distance(place) == Clearance(soup, ignore=1).distance(place)


def test_what_is_ignored_or_out_of_reach_does_not_count() -> None:
    soup = Triangles(
        np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32), np.array([(0, 1, 2)], np.int32), np.array([1], np.int8)
    )
    assert Clearance(soup, ignore=1).distance((0.2, 0.2, 3.0)) == 15.0
    assert Clearance(soup, ignore=0).distance((0.2, 0.2, 30.0)) == 15.0
    assert Clearance(soup, ignore=0).distance((0.2, 0.2, 3.0)) == pytest.approx(3.0)
