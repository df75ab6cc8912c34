"""The parts of the odometry filter, each by the law it has to keep."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from box_room import ASKEW, HALF, Room
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.deskew import deskew, thinned
from skillwing.onboard.odometry.divergence_monitor import LEAST_CLOSE
from skillwing.onboard.odometry.filter import Evidence, update
from skillwing.onboard.odometry.inertial import Inertial, InertialMemory
from skillwing.onboard.odometry.keyframes import Keyframes
from skillwing.onboard.odometry.plane_map import LATELY, PlaneMap
from skillwing.onboard.odometry.propagation import ImuNoise, Track, predict
from skillwing.onboard.odometry.registration import ScanRegistration
from skillwing.onboard.odometry.state import ATTITUDE, POSE, SIZE, FilterState
from skillwing.onboard.topics.sensors import ImuHeader
from skillwing.services.protocol import ProtocolError, encode

vectors = st.tuples(*[st.floats(-1.8, 1.8)] * 3).map(np.array)
half_turns = vectors.filter(lambda axis: np.linalg.norm(axis) > 0.01).map(
    lambda axis: math.pi * axis / np.linalg.norm(axis)
)
errors = st.lists(st.floats(-0.5, 0.5), min_size=SIZE, max_size=SIZE).map(np.array)


def state_at(t: float, room: Room) -> FilterState:
    return FilterState(room.position(t), room.turn(t), room.velocity(t), room.gyro_bias, room.accel_bias)


@given(vectors)
def test_exponential_and_logarithm_undo_each_other(vector: np.ndarray) -> None:
    turn = so3.exp(vector)
    assert np.allclose(turn, Rotation.from_rotvec(vector).as_matrix(), atol=1e-12)
    if np.linalg.norm(vector) < 3.1:  # beyond half a turn the other way round is shorter
        assert np.allclose(so3.log(turn), vector, atol=1e-9)


@given(vectors | half_turns)
def test_a_quaternion_and_its_matrix_are_the_same_rotation(vector: np.ndarray) -> None:
    """Half turns, and rotations next to them, count too."""
    turn = so3.exp(vector)
    assert so3.quaternion(turn)[0] >= 0.0
    assert np.allclose(so3.matrix(np.array(so3.quaternion(turn))), turn, atol=1e-9)
    assert np.allclose(so3.matrix(-3.0 * np.array(so3.quaternion(turn))), turn, atol=1e-9)


@given(errors, errors)
def test_errors_add_and_subtract(first: np.ndarray, second: np.ndarray) -> None:
    origin = FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    one, other = origin.plus(first), origin.plus(second)
    again = one.plus(other.minus(one))
    assert np.allclose(again.turn, other.turn, atol=1e-9)
    assert np.allclose(again.minus(other), 0.0, atol=1e-9)


@given(errors, vectors)
def test_levelling_turns_gravity_down_and_changes_no_distance(error: np.ndarray, origin: np.ndarray) -> None:
    state = FilterState(np.zeros(3), np.eye(3), np.ones(3), np.zeros(3), np.zeros(3)).plus(error)
    keyframes, _ = Keyframes().with_one_more(state.position, state.turn, np.eye(SIZE))
    levelled = replace(state, keyframes=keyframes).levelled(origin)
    assert np.allclose(levelled.gravity, [0.0, 0.0, -float(np.linalg.norm(state.gravity))], atol=1e-9)
    assert np.allclose(levelled.turn @ levelled.turn.T, np.eye(3), atol=1e-9)
    assert np.linalg.norm(levelled.position - origin) == pytest.approx(float(np.linalg.norm(state.position - origin)))
    # Everything looks the same from the drone.
    assert np.allclose(levelled.turn.T @ levelled.gravity, state.turn.T @ state.gravity, atol=1e-9)
    assert np.allclose(levelled.turn.T @ levelled.velocity, state.turn.T @ state.velocity, atol=1e-9)
    # Planes and the poses from which they were mapped keep their tilt: keyframes are dropped.
    assert levelled.keyframes.kept == 0


def test_inertial_measurements_without_noise_lead_along_the_true_path() -> None:
    room = Room()
    times = np.linspace(4.0, 5.0, 250, endpoint=False)
    forces, rates = room.felt(times)
    ideal = Inertial(times, forces + room.accel_bias, rates + room.gyro_bias)
    told = predict(state_at(4.0, room), np.zeros((SIZE, SIZE)), ideal, 4.0, 5.0, ImuNoise())
    assert np.allclose(told.state.position, room.position(5.0), atol=2e-3)
    assert np.allclose(told.state.velocity, room.velocity(5.0), atol=5e-3)
    assert np.allclose(told.state.turn, room.turn(5.0), atol=1e-3)
    assert np.allclose(told.track.positions[125], room.position(4.5), atol=1e-3)


def test_the_covariance_tells_how_far_errors_spread() -> None:
    """Many starts with errors drawn from the covariance end as far apart as the propagated covariance says."""
    room, rng = Room(), np.random.default_rng(2)
    sigmas = np.array([0.1] * 3 + [0.01] * 3 + [0.1] * 3 + [0.002] * 3 + [0.05] * 3 + [0.03] * 3)
    measured, noise = room.inertial(4.0, 4.6), ImuNoise(0.0, 0.0, 0.0, 0.0)
    start = state_at(4.0, room)
    nominal = predict(start, np.diag(sigmas**2), measured, 4.0, 4.6, noise)
    ends = [
        predict(start.plus(sigmas * rng.standard_normal(SIZE)), np.eye(SIZE), measured, 4.0, 4.6, noise).state
        for _ in range(150)
    ]
    spread = np.std([end.minus(nominal.state) for end in ends], axis=0)
    assert np.allclose(spread / np.sqrt(np.diag(nominal.covariance)), 1.0, atol=0.25)


@given(st.floats(3.0, 9.0))
@settings(max_examples=5, deadline=None)
def test_a_scan_without_its_motion_lies_on_the_walls(t: float) -> None:
    room = Room(lidar_noise=0.0)
    times = np.linspace(t, t + 0.1, 26)
    track = Track(times, np.array([room.position(s) for s in times]), np.array([room.turn(s) for s in times]))
    still = deskew(room.scan(t, t + 0.1), track, 60.0)
    in_room = (still.points @ room.turn(t + 0.1).T + room.position(t + 0.1)) @ ASKEW
    distances = np.abs(np.abs(in_room) - HALF).min(axis=1)
    assert np.quantile(distances, 0.99) < 2e-3
    assert len(still.points) > 4000
    assert np.array_equal(still.within(5.0), still.points[still.ranges <= 5.0])


@given(st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_thinning_keeps_one_point_of_a_cell_at_most(seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-3.0, 3.0, (500, 3)).astype(np.float32)
    left = thinned(points, 0.5)
    cells = np.floor(left / np.float32(0.5))
    assert len(np.unique(cells, axis=0)) == len(left)
    assert len(left) >= 0.9 * len(np.unique(np.floor(points / np.float32(0.5)), axis=0))
    assert {tuple(p) for p in left.tolist()} <= {tuple(p) for p in points.tolist()}


def on_a_plane(normal: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points (4000, 3) about the origin, up to 4 m to each side of it, on the plane with this unit normal."""
    across = np.linalg.svd(normal[None])[2][1:]
    return rng.uniform(-4.0, 4.0, (4000, 2)) @ across + 0.01 * rng.standard_normal((4000, 1)) * normal


@given(vectors.filter(lambda v: np.linalg.norm(v) > 0.3), st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_planes_are_found_and_distances_from_them_are_right(normal: np.ndarray, seed: int) -> None:
    normal = normal / np.linalg.norm(normal)
    points = on_a_plane(normal, np.random.default_rng(seed))
    planes = PlaneMap((-6.0, -6.0, -6.0), (6.0, 6.0, 6.0), 1.0)
    planes.insert(points[:2000], 5.0 * normal)
    planes.insert(points[2000:], 5.0 * normal)
    matches = planes.match(points[:500] + 0.1 * normal, 5.0 * normal)
    assert len(matches.points) > 100
    good = matches.plane_variances < 0.01**2
    assert np.allclose(matches.normals[good] @ normal, 1.0, atol=5e-3)
    assert np.allclose(matches.distances[good], 0.1, atol=0.06)


@given(vectors.filter(lambda v: np.linalg.norm(v) > 0.3), st.floats(0.1, 0.9), st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_the_faces_of_a_thin_wall_are_planes_of_their_own(normal: np.ndarray, thickness: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    normal = normal / np.linalg.norm(normal)
    sides = [side * normal for side in (1.0, -1.0)]
    faces = [on_a_plane(normal, rng) + 0.5 * thickness * side for side in sides]
    planes = PlaneMap((-6.0, -6.0, -6.0), (6.0, 6.0, 6.0), 1.0)
    planes.insert(faces[0], 5.0 * sides[0])
    assert len(planes.match(faces[0], 5.0 * sides[1]).points) == 0
    planes.insert(faces[1], 5.0 * sides[1])
    for face, side in zip(faces, sides, strict=True):
        matches = planes.match(face, 5.0 * side)
        assert len(matches.points) > 100
        # In some voxels there are too few points of one face for a plane before those of the other come.
        assert np.quantile(np.abs(matches.distances), 0.8) < 0.05
        assert np.quantile(matches.normals @ side, 0.2) > 0.99


@given(st.floats(0.25, 0.45), st.integers(0, 2**31))
@settings(max_examples=5, deadline=None)
def test_a_plane_speaks_against_a_scan_only_if_one_lay_on_it_lately(offset: float, seed: int) -> None:
    """Planes mapped long ago are displaced after a drift, which is no fault of the scan."""
    rng, sensor = np.random.default_rng(seed), np.zeros(3)
    east, down = np.eye(3)[0], -np.eye(3)[2]
    ground = on_a_plane(down, rng) + 2.5 * down
    wall = on_a_plane(east, rng) + 4.5 * east
    planes = PlaneMap((-6.0, -6.0, -6.0), (6.0, 6.0, 6.0), 1.0)

    def compare(*surfaces: np.ndarray) -> ScanRegistration:
        registration = ScanRegistration(np.vstack(surfaces), sensor, planes)
        registration(FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3)), 3)
        return registration

    def take_in(*surfaces: np.ndarray) -> None:
        registration = compare(*surfaces)
        planes.confirm(registration.met, registration.close)
        planes.insert(np.vstack(surfaces), sensor)

    def unreliable() -> bool:
        agreement = compare(ground, wall - offset * east).agreement
        assert agreement.close > 0.9 * len(ground)
        return agreement.close < LEAST_CLOSE * agreement.matched

    take_in(ground, wall)
    assert not unreliable()
    take_in(ground, wall)
    assert unreliable()
    for _ in range(LATELY - 1):
        take_in(ground)
    assert unreliable()
    take_in(ground)
    assert not unreliable()
    take_in(ground, wall)
    assert unreliable()


def test_what_is_no_plane_or_outside_is_not_matched() -> None:
    rng = np.random.default_rng(1)
    planes = PlaneMap((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0), 1.0)
    sensor = np.array([0.0, 0.0, 5.0])
    planes.insert(rng.uniform(0.0, 1.0, (500, 3)), sensor)
    planes.insert(np.outer(rng.uniform(-1.0, 0.0, 500), [1.0, 1.0, 1.0]), sensor)
    planes.insert(np.array([[50.0, 0.0, 0.0]] * 20), sensor)
    assert planes.planes == 0
    assert len(planes.match(rng.uniform(-3.0, 3.0, (200, 3)), sensor).points) == 0


def test_a_map_grows_beyond_its_first_table() -> None:
    points = np.stack(np.meshgrid(*[np.arange(0.05, 12.0, 0.1)] * 2, [0.5]), axis=-1).reshape(-1, 3)
    sensor = np.array([6.0, 6.0, 5.0])
    planes = PlaneMap((0.0, 0.0, 0.0), (12.0, 12.0, 1.0), 0.1)
    planes.insert(points, sensor)
    fine = PlaneMap((0.0, 0.0, 0.0), (12.0, 12.0, 1.0), 1.0)
    fine.insert(points, sensor)
    assert fine.planes == 144


@given(errors.map(lambda e: 0.2 * e[POSE]))
@settings(max_examples=10, deadline=None)
def test_the_filter_finds_the_pose_from_which_the_walls_fit(error: np.ndarray) -> None:
    """Errors of up to 0.1 m and 0.03 rad at once. From 0.15 m, one of a hundred corners matches a wrong plane."""
    room = Room(lidar_noise=0.01)
    times = np.linspace(1.0, 1.1, 26)
    track = Track(times, np.zeros((26, 3)), np.broadcast_to(np.eye(3), (26, 3, 3)))
    planes = PlaneMap((-20.0, -20.0, -10.0), (20.0, 20.0, 20.0), 1.0)
    *earlier, last = (deskew(room.scan(1.0, 1.1), track, 60.0) for _ in range(5))
    for scan in earlier:
        planes.insert(scan.points.astype(np.float64), scan.sensor)
    truth = FilterState(np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    wrong = np.zeros(SIZE)
    wrong[POSE] = error
    wrong[ATTITUDE] *= 0.3
    look = ScanRegistration(last.points.astype(np.float64), last.sensor, planes)
    found = update(truth.plus(wrong), 0.3**2 * np.eye(SIZE), look, iterations=8)
    assert np.abs(found.state.minus(truth)[POSE]).max() < 0.01


def test_a_flat_floor_does_not_hold_the_drone_along_it() -> None:
    """Planes seen as narrow strips have random tilts. The drone has moved above them by a way with an uncertainty of
    0.3 m. The scan may neither reduce that uncertainty nor move the drone."""
    steps, sigmas = zip(*(_above_strips(seed) for seed in range(20)), strict=True)
    assert np.sqrt(np.mean(np.square(steps))) < 0.15
    assert min(sigmas) > 0.2


def _above_strips(seed: int) -> tuple[float, float]:
    """Shift of the drone along the floor by a scan of it, and the standard deviation of its position there [m]."""
    rng = np.random.default_rng(seed)

    def strips() -> np.ndarray:
        """Points of a ring across the x axis on the floor 4 m below, as wide as in a few scans."""
        x = np.repeat(np.arange(-5.5, 6.0), 300) + rng.uniform(-0.2, 0.2, 3600)
        return np.column_stack([x, rng.uniform(-6.0, 6.0, 3600), rng.normal(-4.0, 0.02, 3600)])

    planes = PlaneMap((-8.0, -8.0, -6.0), (8.0, 8.0, 6.0), 1.0)
    planes.insert(strips(), np.zeros(3))
    prior = FilterState(np.array([0.6, 0.0, 0.0]), np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))
    covariance = np.diag(np.full(SIZE, 1e-8))
    covariance[0, 0] = covariance[2, 2] = 0.3**2
    found = update(prior, covariance, ScanRegistration(strips(), np.zeros(3), planes))
    return float(found.step[0]), math.sqrt(found.covariance[0, 0])


def test_with_nothing_to_see_the_prior_stays() -> None:
    prior = state_at(4.0, Room())
    covariance = np.diag(np.linspace(0.1, 1.0, SIZE))
    blind = update(prior, covariance, lambda state, iteration: Evidence(np.zeros((6, 6)), np.zeros(6)))
    assert np.allclose(blind.step, 0.0)
    assert np.allclose(blind.covariance, covariance)


# --- inertial measurements as published ----------------------------------------------------------------------


def rows(count: int, period: float = 0.004) -> np.ndarray:
    table = np.zeros((count, 7), dtype=np.float32)
    table[:, 0] = np.arange(count) * period
    table[:, 3] = 9.81
    return table


def batch(t0: float, count: int = 5) -> Inertial:
    return Inertial.decode(rows(count).tobytes(), encode(ImuHeader(t0=t0, count=count)))


@pytest.mark.parametrize(
    ("payload", "header"),
    [
        (b"", ImuHeader(t0=0.0, count=0)),
        (rows(5).tobytes(), ImuHeader(t0=0.0, count=4)),
        (rows(5)[::-1].tobytes(), ImuHeader(t0=0.0, count=5)),
        (np.full((2, 7), math.nan, np.float32).tobytes(), ImuHeader(t0=0.0, count=2)),
    ],
)
def test_a_payload_that_is_no_batch_is_refused(payload: bytes, header: ImuHeader) -> None:
    with pytest.raises(ProtocolError):
        Inertial.decode(payload, encode(header))


def test_the_memory_gives_what_was_asked_for_and_drops_what_came_twice() -> None:
    memory = InertialMemory(10.0)
    assert [memory.add(batch(t)) for t in (1.0, 1.02, 1.02, 1.04)] == [True, True, False, True]
    assert memory.covered_until == pytest.approx(1.06)
    taken = memory.take(1.01, 1.05)
    assert np.allclose(taken.times, np.arange(1.012, 1.05, 0.004))
    assert taken.largest_gap(1.01, 1.05) == pytest.approx(0.004)
    assert memory.take(1.05, 1.09).largest_gap(1.05, 1.09) == pytest.approx(0.034)


def test_the_memory_forgets_what_nobody_took() -> None:
    memory = InertialMemory(2.0)
    for k in range(500):
        memory.add(batch(0.02 * k))
    assert memory.take(0.0, 10.0).times[0] == pytest.approx(8.0, abs=0.03)


def test_the_memory_is_empty_after_a_time_reset() -> None:
    memory = InertialMemory(10.0)
    for t in (50.0, 50.02, 1.0, 1.02):
        assert memory.add(batch(t))
    assert memory.covered_until == pytest.approx(1.04)
    assert len(memory.take(1.0, 1.04)) == 10
    assert len(InertialMemory(10.0).take(0.0, 1.0)) == 0
