"""Landing place by memory: no obstacle is below the chosen place, nor on the way to it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from skillwing.onboard.frames.extent import TIP_RADIUS, Box
from skillwing.onboard.obstacles.free_space import TUBE_RADIUS
from skillwing.onboard.obstacles.landing_place import REACH, ROOM, SURROUNDINGS, Below
from skillwing.onboard.obstacles.local_map import VOXEL, LocalMap

Cloud = NDArray[np.float64]
HERE = (3.0, -2.0, 4.0)
NOWHERE: Cloud = np.empty((0, 3))


def plain(reach: float = 12.0, slope: float = 0.0) -> Cloud:
    """Ground around the drone, a point in each voxel."""
    steps = np.arange(-reach, reach, 0.25)
    east, north = (axis.ravel() for axis in np.meshgrid(steps + HERE[0], steps + HERE[1]))
    return np.column_stack([east, north, slope * (east - HERE[0])])


def bush(east: float, north: float, radius: float = 0.6, height: float = 1.8) -> Cloud:
    """Hull of a bush, `east` and `north` of the drone [m]."""
    turns, heights = np.meshgrid(np.linspace(0.0, 2.0 * math.pi, 24), np.arange(0.1, height, 0.25))
    return np.column_stack(
        [
            HERE[0] + east + radius * np.cos(turns.ravel()),
            HERE[1] + north + radius * np.sin(turns.ravel()),
            heights.ravel(),
        ]
    )


def wall(east: float, height: float = 7.0) -> Cloud:
    """A wall from south to north, `east` of the drone [m], of this height."""
    along, heights = np.meshgrid(np.arange(-12.0, 12.0, 0.25), np.arange(0.1, height, 0.25))
    return np.column_stack([np.full(along.size, HERE[0] + east), HERE[1] + along.ravel(), heights.ravel()])


def remembered(*clouds: Cloud, measurements: int = 2) -> LocalMap:
    known = LocalMap()
    for stamp in range(measurements):
        known.see(np.concatenate(clouds), np.array(HERE), 0.1 * stamp, lambda places: np.zeros(len(places), bool))
    return known


def below(*clouds: Cloud, measurements: int = 2, height: float = HERE[2]) -> Below:
    return Below(remembered(*clouds, measurements=measurements), (*HERE[:2], height))


def gap(place: tuple[float, float, float], *things: Cloud) -> float:
    """Level distance between a place and the nearest point of some things."""
    return float(np.linalg.norm(np.concatenate(things)[:, :2] - place[:2], axis=1).min())


def test_over_open_ground_nothing_is_taken() -> None:
    assert not below(plain()).taken


def test_ground_that_nobody_has_seen_is_not_taken() -> None:
    assert not below(NOWHERE).taken
    assert below(NOWHERE).free_place() is None


@pytest.mark.parametrize("slope", [-0.2, 0.2])
def test_a_slope_is_no_obstacle(slope: float) -> None:
    assert not below(plain(slope=slope)).taken


@pytest.mark.parametrize("slope", [-0.35, 0.35])
def test_a_steep_slope_is_landed_beside(slope: float) -> None:
    ground = plain()
    terrace = ground[:, 0] > HERE[0] + 4.0
    ground[:, 2] = np.where(terrace, 0.0, slope * (ground[:, 0] - HERE[0] - 4.0))
    found = below(ground)
    place = found.free_place()
    assert found.taken
    assert place is not None
    assert HERE[0] + 2.5 < place[0] < HERE[0] + 6.0


@given(st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 3.0))
@settings(max_examples=25, deadline=None)
def test_what_stands_below_is_landed_beside(bearing: float, away: float) -> None:
    """Precision is that of voxels: of the points in a voxel, the last one counts."""
    thing = bush(away * math.cos(bearing), away * math.sin(bearing))
    found = below(plain(), thing)
    assert found.taken or gap(HERE, thing) >= TUBE_RADIUS - VOXEL
    assert not found.taken or gap(HERE, thing) < TUBE_RADIUS
    place = found.free_place()
    assert place is not None
    assert place[2] == HERE[2]
    assert math.dist(place, HERE) <= REACH
    assert gap(place, thing) >= ROOM - VOXEL


def test_the_place_is_the_nearest_one() -> None:
    place = below(plain(), bush(0.8, 0.0)).free_place()
    assert place is not None
    assert place[0] < HERE[0]
    assert math.dist(place, HERE) == pytest.approx(1.5, abs=0.3)


def test_no_place_behind_a_wall_is_chosen() -> None:
    hedge = bush(0.0, 0.0, radius=5.0)
    found = below(plain(), hedge, bush(0.0, 0.0, radius=3.0), bush(0.0, 0.0, radius=1.0), wall(2.0))
    place = found.free_place()
    assert place is None or place[0] < HERE[0] + 2.0


def fence(west: float = 20.0, east: float = 20.0, ceiling: float = 30.0) -> Box:
    """Box of permitted targets: `west` and `east` of the drone [m], and at least 1 m above the home pad."""
    return Box((HERE[0] - west, HERE[1] - 20.0, 1.0), (HERE[0] + east, HERE[1] + 20.0, ceiling))


@given(st.floats(-1.0, 6.0), st.floats(-1.0, 6.0))
@settings(max_examples=25, deadline=None)
def test_every_place_lies_where_guidance_may_be_sent(west: float, east: float) -> None:
    targets = fence(west, east)
    place = below(plain(), bush(0.8, 0.0)).free_place(targets)
    assert place is None or targets.contains(place)


def test_near_the_fence_a_place_farther_away_inside_is_chosen() -> None:
    found = below(plain(), bush(0.8, 0.0))
    nearest = found.free_place()
    targets = fence(west=1.0)
    place = found.free_place(targets)
    assert nearest is not None and not targets.contains(nearest)
    assert place is not None and targets.contains(place)
    assert math.dist(place, HERE) > math.dist(nearest, HERE)


def test_where_no_place_lies_inside_the_fence_none_is_chosen() -> None:
    targets = Box((HERE[0] - 1.0, HERE[1] - 1.0, 1.0), (HERE[0] + 1.0, HERE[1] + 1.0, 30.0))
    assert below(plain(), bush(0.0, 0.0)).free_place(targets) is None


def test_a_drone_that_hovers_a_little_above_the_ceiling_is_sent_below_it() -> None:
    ceiling = HERE[2] - 0.2
    place = below(plain(), bush(0.0, 0.0)).free_place(fence(ceiling=ceiling))
    assert place is not None
    assert place[2] == ceiling


def test_of_a_memory_only_the_surroundings_are_looked_at() -> None:
    """The search asks for hundreds of ways, and the memory holds the whole flight."""
    known = remembered(plain(), bush(0.0, 0.0), wall(1.5), wall(SURROUNDINGS + 1.0))
    found = Below(known, HERE)
    assert 0 < len(found._known) < len(known)
    expected = found.free_place()
    known.forget()
    assert expected is not None
    assert found.free_place() == expected
    assert expected[0] < HERE[0] + 1.5 - TUBE_RADIUS


def test_over_unseen_ground_no_way_leads() -> None:
    ground = plain()
    seen = ground[(np.abs(ground[:, 0] - HERE[0]) > 4.0) | (np.abs(ground[:, 1] - HERE[1]) < 0.3)]
    place = below(seen[seen[:, 0] < HERE[0] - 4.0], bush(0.0, 0.0)).free_place()
    assert place is None


def test_ground_is_seen_only_where_it_was_seen_on_all_sides() -> None:
    ground = plain()
    assert below(ground).seen
    assert not below(ground[ground[:, 0] > HERE[0]]).seen
    assert not below(NOWHERE).seen


def track(length: float = 14.0) -> Cloud:
    """The ground under a drone that has come from the east."""
    along = np.arange(0.0, length, 0.1)
    return np.column_stack([HERE[0] + along, np.full(len(along), HERE[1]), np.zeros(len(along))])


def test_of_a_track_the_nearest_place_is_chosen_that_the_blades_fit_into() -> None:
    line = track()
    met = line[:, 0] < HERE[0] + 1.0
    line[met, 2] = 2.0
    found = below(line)
    place = found.free_place()
    assert found.taken
    assert place is not None
    assert gap(place, line[met]) >= TIP_RADIUS
    assert math.dist(place, HERE) < 4.0


@pytest.mark.parametrize("length", [3.0, 6.0])
@pytest.mark.parametrize("taken", [1.0, 2.0])
def test_on_a_short_track_what_stands_below_is_seen_as_well(length: float, taken: float) -> None:
    line = track(length)
    met = line[:, 0] < HERE[0] + taken
    line[met, 2] = 2.0
    found = below(line)
    place = found.free_place()
    assert found.taken
    assert place is None or gap(place, line[met]) >= TIP_RADIUS


@pytest.mark.parametrize("slope", [-0.2, 0.2])
def test_a_short_track_down_a_hillside_is_no_obstacle(slope: float) -> None:
    line = track(6.0)
    line[:, 2] = slope * (line[:, 0] - HERE[0])
    assert not below(line).taken


def test_across_a_track_no_slope_is_seen() -> None:
    line = track()
    line += np.random.default_rng(3).normal(0.0, 0.02, line.shape)
    assert not below(line).taken


def test_better_than_a_track_is_ground_that_was_seen_on_all_sides() -> None:
    ground = plain()
    place = below(track(), ground[ground[:, 0] > HERE[0] + 6.0], bush(0.0, 0.0)).free_place()
    assert place is not None
    assert place[0] >= HERE[0] + 6.0


def test_one_measurement_makes_no_obstacle() -> None:
    assert not below(plain(), bush(0.0, 0.0), measurements=1).taken


@pytest.mark.parametrize("depth", [0.0, -3.0])
def test_a_roof_is_no_ground(depth: float) -> None:
    ground = plain()
    over = np.abs(ground[:, :2] - HERE[:2] - (0.0, 2.0)).max(axis=1) < 6.0
    ground[:, 2] = np.where(over, depth + 6.0, depth)
    found = below(ground, height=depth + 11.0)
    place = found.free_place()
    assert found.taken
    assert place is not None
    assert gap(place, ground[over]) >= ROOM


def test_lower_ground_beyond_an_unseen_gap_makes_no_roof_of_the_ground_below() -> None:
    """A drone over a courtyard had seen 23 squares of ground in a far corner, 0.4 m lower."""
    ground = plain(reach=15.0)
    inwards = np.abs(ground[:, :2] - HERE[:2]).max(axis=1) < 7.0
    corner = (ground[:, :2] - HERE[:2]).min(axis=1) > 12.0
    ground[:, 2] = np.where(corner, -0.45, 0.0)
    found = below(ground[inwards | corner])
    assert not found.taken
    assert found.seen


@pytest.mark.parametrize("beyond", [7.5, 9.0])
def test_a_roof_beyond_an_unseen_gap_is_no_ground(beyond: float) -> None:
    ground = plain(reach=15.0)
    away = np.abs(ground[:, :2] - HERE[:2]).max(axis=1)
    ground[:, 2] = np.where(away < 6.0, 3.0, 0.0)
    found = below(ground[(away < 6.0) | (away > beyond)], height=9.0)
    assert found.taken


@pytest.mark.parametrize("slope", [-0.2, 0.2])
def test_a_hillside_is_no_roof(slope: float) -> None:
    place = below(plain(slope=slope), bush(0.0, 0.0), height=8.0).free_place()
    assert place is not None
    assert math.dist(place, (*HERE[:2], 8.0)) < 4.0
