"""The judge of maps: what could be seen, and how much of that is mapped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from skillwing.evaluation.flights.coverage import RANGE, CoverageJudge, observable_from
from skillwing.onboard.mapping.occupancy import OccupancyGrid
from skillwing.sim_mujoco.world.triangles import Triangles
from skillwing.sim_mujoco.world.world import BUILDING, OTHER, TERRAIN, World, make_world

SIZE = 0.4


@pytest.fixture(scope="module")
def world() -> World:
    return make_world(1)


@pytest.fixture(scope="module")
def judge(world: World) -> CoverageJudge:
    return CoverageJudge(world, world.route[:2])


def upright(x: float, label: int) -> Triangles:
    """A square of 4 m across the x axis."""
    vertices = np.array([[x, -2, 0], [x, 2, 0], [x, 2, 4], [x, -2, 4]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return Triangles(vertices, faces, np.full(2, label, dtype=np.int8))


def together(*parts: Triangles) -> Triangles:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return Triangles(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]).astype(np.int32),
        np.concatenate([part.labels for part in parts]),
    )


def test_what_is_hidden_or_far_cannot_be_seen() -> None:
    triangles = together(upright(10.0, BUILDING), upright(12.0, OTHER), upright(-RANGE - 6.0, TERRAIN))
    seen = observable_from(triangles, [(0.0, 0.0, 2.0), (1.0, 0.0, 2.0)])
    assert len(seen.points) == pytest.approx(16 / 0.2**2, rel=0.15)
    assert set(seen.labels.tolist()) == {BUILDING}


def test_a_perfect_map_covers_everything_and_an_empty_one_nothing(judge: CoverageJudge) -> None:
    grid = OccupancyGrid((-50.0, -50.0, -8.0), (80.0, 70.0, 24.0), SIZE)
    for _ in range(2):
        grid.integrate(np.array([0.0, 0.0, 20.0]), grid.hit_by(judge.observable.points))
    perfect = judge.coverage(grid.occupied_centres(), SIZE)
    assert (perfect.all, perfect.buildings, perfect.terrain) == (1.0, 1.0, 1.0)
    assert perfect.error is not None
    assert perfect.error < SIZE / 2
    empty = judge.coverage(np.empty((0, 3), dtype=np.float32), SIZE)
    assert (empty.all, empty.buildings, empty.terrain, empty.error) == (0.0, 0.0, 0.0, None)


def test_half_a_map_covers_about_half_and_a_misplaced_one_little(judge: CoverageJudge) -> None:
    points = judge.observable.points
    half = judge.coverage(points[points[:, 0] < np.median(points[:, 0])], SIZE)
    assert half.all == pytest.approx(0.5, abs=0.05)
    aloft = judge.coverage(points[::20] + np.array([0.0, 0.0, 30.0], dtype=np.float32), SIZE)
    assert aloft.all is not None
    assert aloft.all < 0.05


def test_the_same_world_and_route_are_judged_by_the_same_points(world: World, judge: CoverageJudge) -> None:
    again = observable_from(world.triangles(), world.route[:2])
    assert np.array_equal(again.points, judge.observable.points)


def test_a_world_without_buildings_has_no_share_of_them(world: World) -> None:
    bare = CoverageJudge(replace(world, obstacles=()), world.route[:2])
    assert bare.coverage(bare.observable.points, SIZE).buildings is None
