"""Poses from which the map was laid, whose errors stay in the filter: the laws that let it tell moving from being."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from box_room import Room
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.sim_mujoco.slam import so3
from skillwing.sim_mujoco.slam.deskew import deskew
from skillwing.sim_mujoco.slam.filter import Posterior, update
from skillwing.sim_mujoco.slam.keyframes import LAYING, MOST, STEP, TURN, Keyframes
from skillwing.sim_mujoco.slam.plane_map import PlaneMap
from skillwing.sim_mujoco.slam.propagation import Track
from skillwing.sim_mujoco.slam.registration import Registration
from skillwing.sim_mujoco.slam.state import POSE, POSITION, SIZE, VELOCITY, State

vectors = st.tuples(*[st.floats(-1.8, 1.8)] * 3).map(np.array)
seeds = st.integers(0, 2**31)


def covariance_of(size: int, rng: np.random.Generator) -> np.ndarray:
    roots = rng.standard_normal((size, 2 * size))
    return roots @ roots.T / size


def strung(count: int, rng: np.random.Generator) -> tuple[Keyframes, np.ndarray]:
    """So many keyframes along a random path, and a covariance of all errors."""
    keyframes, covariance = Keyframes(), covariance_of(SIZE, rng)
    for _ in range(count):
        turn = so3.exp(rng.uniform(-1.0, 1.0, 3))
        keyframes, covariance = keyframes.with_one_more(rng.uniform(-9.0, 9.0, 3), turn, covariance, SIZE)
    return keyframes, covariance


@given(st.integers(0, 2 * MOST), seeds)
@settings(max_examples=20, deadline=None)
def test_a_new_keyframe_errs_as_the_drone_does_and_the_oldest_goes(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    keyframes, before = strung(count, rng)
    position, turn = rng.uniform(-9.0, 9.0, 3), so3.exp(rng.uniform(-1.0, 1.0, 3))
    more, after = keyframes.with_one_more(position, turn, before, SIZE)
    assert len(more) == min(count + 1, MOST)
    assert (more.laid, more.newest) == (count + 1, count)
    assert after.shape == (SIZE + 6 * len(more),) * 2
    assert np.allclose(after[:SIZE, :SIZE], before[:SIZE, :SIZE])
    # Seen from the drone, which has not moved since, it errs as the drone: nothing is unknown between the two.
    between = np.zeros((6, len(after)))
    between[:, POSE], between[:, -6:] = np.eye(6), -more.seen_from(position, turn)[-1]
    assert np.allclose(between @ after @ between.T, np.diag(LAYING**2), atol=1e-9)
    # Numbers go on, whatever was dropped.
    numbers = np.arange(count + 1)
    rows = more.rows(numbers)
    assert np.all(rows[numbers <= count - MOST] == -1)
    assert rows[-1] == len(more) - 1
    kept = numbers[rows >= 0]
    assert np.allclose(more.places[rows[kept[:-1]]], keyframes.places[keyframes.rows(kept[:-1])])


@given(vectors, vectors, vectors, vectors, vectors, vectors)
def test_a_shift_moves_the_world_as_the_error_that_it_is_seen_as(
    place: np.ndarray, position: np.ndarray, turn: np.ndarray, move: np.ndarray, about: np.ndarray, point: np.ndarray
) -> None:
    """To first order, what a shift does to a point is what an error of the pose does to a point that is seen there."""
    keyframes = Keyframes(place[None], np.eye(3), np.zeros((1, 6)), 1)
    attitude = so3.exp(turn)
    error = keyframes.seen_from(position, attitude)[0] @ np.concatenate([move, about])
    shifted = move + np.cross(about, point - place)
    seen = error[:3] + np.cross(attitude @ error[3:], point - position)
    assert np.allclose(shifted, seen, atol=1e-9)


@given(st.integers(1, MOST), seeds)
@settings(max_examples=20, deadline=None)
def test_errors_of_keyframes_add_and_subtract(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    keyframes, _ = strung(count, rng)
    state = State(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), keyframes=keyframes)
    error = 0.3 * rng.standard_normal(SIZE + 6 * count)
    assert np.allclose(state.plus(error).minus(state), error)


def test_one_is_due_after_half_a_metre_or_a_turn() -> None:
    assert Keyframes().is_due(np.zeros(3), np.eye(3))
    keyframes, _ = Keyframes().with_one_more(np.ones(3), np.eye(3), np.eye(SIZE), SIZE)
    east = np.eye(3)[0]
    assert not keyframes.is_due(np.ones(3) + 0.99 * STEP * east, so3.exp(0.99 * TURN * east))
    assert keyframes.is_due(np.ones(3) + 1.01 * STEP * east, np.eye(3))
    assert keyframes.is_due(np.ones(3), so3.exp(1.01 * TURN * east))


PLACE, SPEED = 0.2, 0.1
"""How much is not known of the keyframe's place [m] and of the speed since [m/s]."""


def after_a_second(error: float) -> Posterior:
    """A second after a keyframe, of whose place nothing better is known, at a speed that is wrong by `error`."""
    room = Room(lidar_noise=0.01)
    times = np.linspace(1.0, 1.1, 26)
    still = Track(times, np.zeros((26, 3)), np.broadcast_to(np.eye(3), (26, 3, 3)))
    planes = PlaneMap((-20.0, -20.0, -10.0), (20.0, 20.0, 20.0), 1.0)
    *earlier, last = (deskew(room.scan(1.0, 1.1), still, 60.0) for _ in range(5))
    for scan in earlier:
        planes.insert(scan.points.astype(np.float64), scan.sensor, 0)
    there = State(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    covariance = np.diag(np.full(SIZE, 1e-6))
    covariance[POSITION, POSITION] = PLACE**2 * np.eye(3)
    covariance[VELOCITY, VELOCITY] = SPEED**2 * np.eye(3)
    keyframes, covariance = Keyframes().with_one_more(there.position, there.turn, covariance, SIZE)
    gone = np.eye(len(covariance))
    gone[POSITION, VELOCITY] = np.eye(3)
    east = np.eye(3)[0]
    prior = replace(there, position=error * east, velocity=error * east, keyframes=keyframes)
    look = Registration(last.points.astype(np.float64), last.sensor, planes)
    return update(prior, gone @ covariance @ gone.T, look, iterations=8)


@given(st.floats(-0.2, 0.2))
@settings(max_examples=5, deadline=None)
def test_what_was_laid_from_a_wrong_place_tells_how_the_drone_moves_and_not_where_it_is(error: float) -> None:
    posterior = after_a_second(error)
    sigmas = np.sqrt(np.diag(posterior.covariance))
    # The scan fits where the drone has not moved at all, so that its speed was the error.
    assert np.abs(posterior.state.velocity).max() < 0.02
    assert sigmas[VELOCITY].max() < 0.2 * SPEED
    # Its place follows from that, and is as uncertain as that of the keyframe was: no surer by any wall.
    assert np.abs(posterior.state.position).max() < 0.02
    assert np.allclose(sigmas[POSITION], PLACE, rtol=0.05)


def test_a_place_that_becomes_known_later_is_corrected_with_the_keyframe() -> None:
    """Something tells the place of the drone: what was laid from the keyframe has then to be shifted as well."""
    posterior = after_a_second(0.0)
    told = np.zeros((1, len(posterior.covariance)))
    told[0, 0] = 1.0
    spread = told @ posterior.covariance @ told.T + 1e-4
    change = (posterior.covariance @ told.T / spread).ravel() * 0.3
    state = posterior.state.plus(change)
    assert math.isclose(state.position[0], 0.3, rel_tol=0.05)
    assert math.isclose(state.keyframes.shifts[0, 0], state.position[0], rel_tol=0.05)
