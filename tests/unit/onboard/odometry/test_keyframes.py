"""Laws of keyframes, the mapping poses whose errors stay in the filter: scans correct the motion, not the position."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from box_room import Room
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.deskew import deskew
from skillwing.onboard.odometry.filter import Posterior, update
from skillwing.onboard.odometry.keyframes import MAPPING_SIGMA, MOST, STEP, TURN, Keyframes
from skillwing.onboard.odometry.plane_map import PlaneMap
from skillwing.onboard.odometry.propagation import Track
from skillwing.onboard.odometry.registration import ScanRegistration
from skillwing.onboard.odometry.state import POSE, POSITION, SIZE, VELOCITY, FilterState

vectors = st.tuples(*[st.floats(-1.8, 1.8)] * 3).map(np.array)
seeds = st.integers(0, 2**31)


def covariance_of(size: int, rng: np.random.Generator) -> np.ndarray:
    roots = rng.standard_normal((size, 2 * size))
    return roots @ roots.T / size


def strung(count: int, rng: np.random.Generator) -> tuple[Keyframes, np.ndarray]:
    """Keyframes along a random path, `count` of them with random shifts, and a covariance of all errors."""
    keyframes, covariance = Keyframes(), covariance_of(SIZE, rng)
    for _ in range(count):
        turn = so3.exp(rng.uniform(-1.0, 1.0, 3))
        keyframes, covariance = keyframes.with_one_more(rng.uniform(-9.0, 9.0, 3), turn, covariance)
        keyframes = keyframes.plus(rng.standard_normal(6 * keyframes.kept))
    return keyframes, covariance


@given(st.integers(0, 2 * MOST), seeds)
@settings(max_examples=20, deadline=None)
def test_a_new_keyframe_errs_as_the_drone_does_and_the_oldest_goes(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    keyframes, before = strung(count, rng)
    position, turn = rng.uniform(-9.0, 9.0, 3), so3.exp(rng.uniform(-1.0, 1.0, 3))
    more, after = keyframes.with_one_more(position, turn, before)
    assert more.kept == min(count + 1, MOST)
    assert (more.newest, more.oldest) == (count, max(count + 1 - MOST, 0))
    assert after.shape == (SIZE + 6 * more.kept,) * 2
    # Errors that remain keep their covariance: the drone's own, and those of all keyframes that are still kept.
    left = 6 * (more.kept - 1)
    stay = np.r_[0:SIZE, len(before) - left : len(before)]
    assert np.allclose(after[:-6, :-6], before[np.ix_(stay, stay)])
    assert np.allclose(more.places, np.vstack([keyframes.places, position]))
    assert np.allclose(more.shifts, np.vstack([keyframes.shifts, np.zeros(6)]))
    # The drone has not moved since the keyframe: their errors differ by MAPPING_SIGMA only.
    between = np.zeros((6, len(after)))
    between[:, POSE], between[:, -6:] = np.eye(6), -more.seen_from(position, turn, np.array([count]))[0]
    assert np.allclose(between @ after @ between.T, np.diag(MAPPING_SIGMA**2), atol=1e-9)


@given(vectors, vectors, vectors, vectors, vectors, vectors)
def test_a_shift_moves_the_world_as_the_error_that_it_is_seen_as(
    place: np.ndarray, position: np.ndarray, turn: np.ndarray, move: np.ndarray, about: np.ndarray, point: np.ndarray
) -> None:
    """A shift moves a point as an error of the pose moves a point that is seen there, to first order."""
    keyframes = Keyframes(place[None], np.eye(3), np.zeros((1, 6)))
    attitude = so3.exp(turn)
    error = keyframes.seen_from(position, attitude, np.array([0]))[0] @ np.concatenate([move, about])
    shifted = move + np.cross(about, point - place)
    seen = error[:3] + np.cross(attitude @ error[3:], point - position)
    assert np.allclose(shifted, seen, atol=1e-9)


@given(st.integers(1, 2 * MOST), seeds)
@settings(max_examples=20, deadline=None)
def test_errors_of_keyframes_add_and_subtract(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    keyframes, _ = strung(count, rng)
    state = FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), keyframes=keyframes)
    error = 0.3 * rng.standard_normal(SIZE + 6 * keyframes.kept)
    moved = state.plus(error)
    assert np.allclose(moved.minus(state), error)
    # Keyframes that were dropped keep their last shifts.
    assert np.array_equal(moved.keyframes.shifts[: keyframes.oldest], keyframes.shifts[: keyframes.oldest])


@given(vectors, vectors, vectors, st.floats(-0.2, 0.2), seeds)
@settings(max_examples=20, deadline=None)
def test_what_is_laid_from_a_shifted_keyframe_lies_right_with_its_shift(
    place: np.ndarray, move: np.ndarray, axis: np.ndarray, turned: float, seed: int
) -> None:
    points = np.random.default_rng(seed).uniform(-9.0, 9.0, (20, 3))
    shift = np.concatenate([move, turned * axis])
    laid = Keyframes(place[None], np.eye(3), shift[None]).mapped(points)
    assert np.allclose(place + move + (laid - place) @ so3.exp(shift[3:]).T, points, atol=1e-9)


def test_one_is_due_after_half_a_metre_or_a_turn() -> None:
    assert Keyframes().is_due(np.zeros(3), np.eye(3))
    keyframes, _ = Keyframes().with_one_more(np.ones(3), np.eye(3), np.eye(SIZE))
    east = np.eye(3)[0]
    assert not keyframes.is_due(np.ones(3) + 0.99 * STEP * east, so3.exp(0.99 * TURN * east))
    assert keyframes.is_due(np.ones(3) + 1.01 * STEP * east, np.eye(3))
    assert keyframes.is_due(np.ones(3), so3.exp(1.01 * TURN * east))


def mapped(keyframe: int, shift: np.ndarray | None = None) -> tuple[PlaneMap, ScanRegistration]:
    """The walls of a room as a drone in its middle lays them from a keyframe, and its next scan.

    shift (6,): error of the keyframe, and with it of the map.
    """
    room = Room(lidar_noise=0.01)
    times = np.linspace(1.0, 1.1, 26)
    still = Track(times, np.zeros((26, 3)), np.broadcast_to(np.eye(3), (26, 3, 3)))
    planes = PlaneMap((-20.0, -20.0, -10.0), (20.0, 20.0, 20.0), 1.0)
    *earlier, last = (deskew(room.scan(1.0, 1.1), still, 60.0) for _ in range(5))
    wrong = Keyframes(np.zeros((1, 3)), np.eye(3), (np.zeros(6) if shift is None else shift)[None])
    for scan in earlier:
        laid = wrong.mapped(np.vstack([scan.points.astype(np.float64), scan.sensor]))
        planes.insert(laid[:-1], laid[-1], keyframe)
    return planes, ScanRegistration(last.points.astype(np.float64), last.sensor, planes)


def in_the_middle(keyframes: Keyframes) -> FilterState:
    return FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), keyframes=keyframes)


@given(st.tuples(*[st.floats(-0.25, 0.25)] * 3).map(np.array), st.sampled_from([1, MOST + 3]))
@settings(max_examples=8, deadline=None)
def test_a_shift_that_is_known_makes_good_what_is_wrong_with_the_map(move: np.ndarray, count: int) -> None:
    """Laid from the first keyframe, which is kept or was dropped long ago: with its shift the scan fits where it is."""
    shift = np.concatenate([move, np.zeros(3)])
    shifts = np.zeros((count, 6))
    shifts[0] = shift
    _, look = mapped(0, shift)
    state = in_the_middle(Keyframes(np.zeros((count, 3)), np.eye(3), shifts))
    evidence = look(state, 3)
    assert look.agreement.close > 0.95 * look.agreement.matched
    pulled = np.linalg.solve(evidence.information[POSE, POSE], evidence.gradient[POSE])
    assert np.abs(pulled).max() < 0.02
    # Without it, the map seems to be somewhere else, and one step finds most of the shift. In the corners beyond 0.2 m
    # too few points are near planes for one step: up to 0.88 of the shift is left there, on a grid of moves.
    without = in_the_middle(Keyframes(np.zeros((count, 3)), np.eye(3), np.zeros((count, 6))))
    blind = look(without, 0)
    if 0.1 < np.abs(move).max() <= 0.2:
        pulled = np.linalg.solve(blind.information[POSE, POSE], blind.gradient[POSE])
        assert np.linalg.norm(pulled[:3] + move) < 0.25 * np.linalg.norm(move)


def test_a_keyframe_is_pulled_the_other_way_and_one_that_was_dropped_not_at_all() -> None:
    _, look = mapped(0)
    error = np.zeros(SIZE + 6)
    error[0] = 0.1
    kept = in_the_middle(Keyframes(np.zeros((1, 3)), np.eye(3), np.zeros((1, 6)))).plus(error)
    evidence = look(kept, 3)
    assert evidence.gradient[0] < 0.0
    assert np.allclose(evidence.gradient[SIZE : SIZE + 3], -evidence.gradient[:3])
    # A common motion and rotation of drone and keyframe changes nothing, wherever the keyframe is.
    away = Keyframes(np.array([[3.0, -2.0, 1.0]]), np.eye(3), np.zeros((1, 6)))
    turned = replace(in_the_middle(away), turn=so3.exp(np.array([0.02, -0.01, 0.03])))
    seen = look(turned, 3).information
    shift = np.array([0.3, -0.2, 0.1, 0.4, -0.5, 0.6])
    alike = np.zeros(SIZE + 6)
    alike[POSE] = away.seen_from(turned.position, turned.turn, np.array([0]))[0] @ shift
    alike[SIZE:] = shift
    assert np.abs(seen @ alike).max() < 1e-6 * np.abs(seen).max()
    count = MOST + 1
    dropped = in_the_middle(Keyframes(np.zeros((count, 3)), np.eye(3), np.zeros((count, 6))))
    evidence = look(dropped.plus(np.r_[error[:SIZE], np.zeros(6 * MOST)]), 3)
    assert evidence.gradient[0] < 0.0
    assert np.allclose(evidence.gradient[SIZE:], 0.0)


def test_each_keyframe_is_pulled_by_its_own_planes_only() -> None:
    """Walls to the east were mapped from the third keyframe, those to the west from the first, none from the second."""
    _, look = mapped(0)
    scan = look._points  # pyright: ignore[reportPrivateUsage]
    planes, east = PlaneMap((-20.0, -20.0, -10.0), (20.0, 20.0, 20.0), 1.0), scan[:, 0] > 0.0
    for side, keyframe in ((east, 2), (~east, 0)):
        planes.insert(scan[side], np.zeros(3), keyframe)
    look = ScanRegistration(scan, np.zeros(3), planes)
    state = in_the_middle(Keyframes(np.arange(9.0).reshape(3, 3), np.eye(3), np.zeros((3, 6))))
    evidence = look(state.plus(np.r_[[0.1, 0.05, -0.1], np.zeros(SIZE + 15)]), 3)
    first, second, third = (slice(start, start + 6) for start in (SIZE, SIZE + 6, SIZE + 12))
    assert np.all(evidence.information[second] == 0.0)
    assert np.all(evidence.gradient[second] == 0.0)
    assert np.all(evidence.information[first, third] == 0.0)
    assert np.allclose(evidence.information, evidence.information.T)
    # Both together give as much information on the drone as all planes of a map without errors.
    own = evidence.information[:3, :3]
    assert np.allclose(own, evidence.information[first, first][:3, :3] + evidence.information[third, third][:3, :3])
    assert np.allclose(evidence.gradient[:3], -evidence.gradient[first][:3] - evidence.gradient[third][:3])
    assert min(evidence.information[some, some][:3, :3].trace() for some in (first, third)) > 0.1 * own.trace()


def test_a_plane_takes_in_nothing_that_was_laid_much_later() -> None:
    planes, look = mapped(5)
    state = in_the_middle(Keyframes(np.zeros((99, 3)), np.eye(3), np.zeros((99, 6))))
    scan = state.placed(look._points)  # pyright: ignore[reportPrivateUsage]
    before = planes.match(scan, np.zeros(3))
    for _ in range(20):
        planes.insert(scan + 0.05, np.zeros(3), 5 + MOST)
    after = planes.match(scan, np.zeros(3))
    same = np.isin(after.planes, before.planes)
    assert np.array_equal(after.distances[same], before.distances)
    assert np.all(after.keyframes[same] == 5)


@given(st.integers(1, 7), st.integers(MOST, 300))
@settings(max_examples=10, deadline=None)
def test_a_plane_is_laid_from_where_its_points_were_seen(few: int, later: int) -> None:
    """A few old points, too few for a plane, do not change the keyframe from which the later plane was mapped."""
    rng, sensor = np.random.default_rng(few), np.array([0.5, 0.5, 4.0])
    floor = np.column_stack([rng.uniform(0.05, 0.95, (400, 2)), rng.normal(0.5, 0.01, 400)])
    planes = PlaneMap((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0)
    planes.insert(floor[:few], sensor, 0)
    for k in range(10):
        planes.insert(floor[few + 30 * k : few + 30 * k + 30], sensor, later)
    matches = planes.match(floor, sensor)
    assert len(matches.points) == len(floor)
    assert np.all(matches.keyframes == later)
    assert matches.plane_variances.max() < 0.02**2


PLACE, SPEED = 0.2, 0.1
"""Uncertainty of the keyframe's place [m] and of the speed since [m/s]."""


def after_a_second(error: float) -> Posterior:
    """Posterior a second after a keyframe of uncertain position, with a speed that is wrong by `error` [m/s]."""
    _, look = mapped(0)
    there = FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    covariance = np.diag(np.full(SIZE, 1e-6))
    covariance[POSITION, POSITION] = PLACE**2 * np.eye(3)
    covariance[VELOCITY, VELOCITY] = SPEED**2 * np.eye(3)
    keyframes, covariance = Keyframes().with_one_more(there.position, there.turn, covariance)
    gone = np.eye(len(covariance))
    gone[POSITION, VELOCITY] = np.eye(3)
    east = np.eye(3)[0]
    prior = replace(there, position=error * east, velocity=error * east, keyframes=keyframes)
    return update(prior, gone @ covariance @ gone.T, look, iterations=8)


@given(st.floats(-0.2, 0.2))
@settings(max_examples=5, deadline=None)
def test_what_was_laid_from_a_wrong_place_tells_how_the_drone_moves_and_not_where_it_is(error: float) -> None:
    posterior = after_a_second(error)
    sigmas = np.sqrt(np.diag(posterior.covariance))
    # The scan fits where the drone has not moved at all: the speed was wrong.
    assert np.abs(posterior.state.velocity).max() < 0.02
    assert sigmas[VELOCITY].max() < 0.2 * SPEED
    # The position follows from that. It is as uncertain as that of the keyframe: no wall improves it.
    assert np.abs(posterior.state.position).max() < 0.02
    assert np.allclose(sigmas[POSITION], PLACE, rtol=0.05)


def test_a_place_that_becomes_known_later_is_corrected_with_the_keyframe() -> None:
    """A later fix of the position has to shift the planes that were mapped from the keyframe as well."""
    posterior = after_a_second(0.0)
    told = np.zeros((1, len(posterior.covariance)))
    told[0, 0] = 1.0
    spread = told @ posterior.covariance @ told.T + 1e-4
    change = (posterior.covariance @ told.T / spread).ravel() * 0.3
    state = posterior.state.plus(change)
    assert math.isclose(state.position[0], 0.3, rel_tol=0.05)
    assert math.isclose(state.keyframes.shifts[0, 0], state.position[0], rel_tol=0.05)
