"""Noise, jumps and contradictions are noticed, and what only looks like them is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.onboard.frames.vectors import Motion
from skillwing.onboard.sensor_data.names import LIDAR, ZED
from skillwing.sim_mujoco.sensors.cross_checks import GroundCrossCheck, ImuCrossCheck
from skillwing.sim_mujoco.sensors.depth_camera import DepthCamera
from skillwing.sim_mujoco.sensors.lidar import Lidar
from skillwing.sim_mujoco.sensors.self_tests import Contradiction, Jump, Roughness, SelfTest
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import make_world

RAYS = RayScene(make_world(3).triangles())


def motion(t: float, *, speed: float = 5.0, turn: float = 0.8) -> Motion:
    """A drone that leaves its pad at full speed and turns as fast as it can."""
    heading = turn * t
    quaternion = (math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2))
    return Motion(t, (0.8 * speed * t, 0.0, 4.0), (speed, 0.0, 0.0), quaternion, (0.0, 0.0, turn))


def measurements(sensor: str, count: int = 16) -> list[tuple[float, np.ndarray]]:
    rng, period = np.random.default_rng(2), SENSORS[sensor].period
    if sensor == ZED:
        camera = DepthCamera(RAYS, rng)
        return [(k * period, camera.picture(motion(k * period))) for k in range(count)]
    lidar = Lidar(RAYS, rng)
    track = [[motion(k * period + 0.01 * j) for j in range(11)] for k in range(count)]
    return [(each[-1].t, lidar.scan(each, each[0].t, each[-1].t)) for each in track]


@pytest.fixture(scope="module")
def recorded() -> dict[str, list[tuple[float, np.ndarray]]]:
    return {sensor: measurements(sensor) for sensor in (ZED, LIDAR)}


def complaints(sensor: str, stream: list[tuple[float, np.ndarray]], kind: type[SelfTest]) -> list[str | None]:
    (test,) = (test for test in SENSORS[sensor].self_tests() if isinstance(test, kind))
    return [test.problem(t, data) for t, data in stream]


@pytest.mark.parametrize("sensor", [ZED, LIDAR])
@pytest.mark.parametrize("kind", [Roughness, Jump])
def test_fast_flight_and_turning_are_no_fault(recorded, sensor: str, kind: type[SelfTest]) -> None:
    assert complaints(sensor, recorded[sensor], kind) == [None] * len(recorded[sensor])


@pytest.mark.parametrize("sensor", [ZED, LIDAR])
def test_noise_is_seen_in_the_second_measurement(recorded, sensor: str) -> None:
    rng = np.random.default_rng(1)
    noisy = [
        (t, (data + np.float32(2.0) * rng.standard_normal(data.shape, dtype=np.float32)).astype(np.float32))
        for t, data in recorded[sensor]
    ]
    first, *others = complaints(sensor, noisy, Roughness)
    assert first is None
    assert all(each is not None for each in others)


@pytest.mark.parametrize("sensor", [ZED, LIDAR])
@pytest.mark.parametrize("offset", [1.5, -1.5, 4.0])
def test_a_bias_is_seen_once_it_stays_and_forgotten_once_it_stays_away(recorded, sensor: str, offset: float) -> None:
    biased = [(t, data + np.float32(offset if 4 <= k < 10 else 0.0)) for k, (t, data) in enumerate(recorded[sensor])]
    told = complaints(sensor, biased, Jump)
    assert [each is not None for each in told] == [5 <= k < 11 for k in range(len(told))]


@pytest.mark.parametrize("rate", [0.4, 0.8, -0.8])
def test_pitching_over_open_ground_is_no_jump(rate: float) -> None:
    """The ground below the horizon comes nearer or goes away in every direction, in several pictures."""
    down = np.linspace(0.05, 0.6, 60, dtype=np.float32)[:, None] * np.ones((1, 80), dtype=np.float32)
    test = Jump(lambda picture: picture, speed=5.0)
    for k in range(20):
        pitch = rate * (min(max(k - 5, 0), 6) / 15.0)
        distance = np.float32(3.0) / np.sin(np.clip(down + np.float32(pitch), 0.01, 1.5))
        assert test.problem(k / 15.0, np.where(distance < 20.0, distance, 0.0).astype(np.float32)) is None


@pytest.mark.parametrize("turned", [False, True])
def test_a_step_beside_which_most_of_the_view_moves_as_well_is_no_jump(turned: bool) -> None:
    """Seen in flight, while the nose rose over open ground: two thirds went away by 0.7 m in one picture, of those
    before and after it a third stood still, and the rest went on."""
    test = Jump(lambda picture: picture, speed=5.0)
    steps = [(0.0, 0.0), (0.0, 0.9), (0.73, 0.73), (0.0, 0.9), (0.0, 0.0), (0.0, 0.0)]
    picture = np.full((20, 30), 8.0, dtype=np.float32)
    for k, (of_two_fifths, of_the_rest) in enumerate(steps):
        picture[:8] += np.float32(of_two_fifths)
        picture[8:] += np.float32(of_the_rest)
        told = (20.0 - picture) if turned else picture
        assert test.problem(k / 15.0, told.copy()) is None


@pytest.mark.parametrize("unseen", [0, 1, 5])
def test_a_step_beside_which_too_little_was_in_view_is_no_jump(unseen: int) -> None:
    """Seen in flight, high over open ground: the nose came down, and brought the ground into the camera's reach. Where
    hardly anything was in view of one picture and the next, nobody knows that the view stood still."""
    near, nearer, dark = (8.0,) * 2, (7.2,) * 3, (0.0,) * unseen
    for distances in ((*near, *dark, 8.0, *nearer), (*near, 7.2, *dark, *nearer)):
        test, told = Jump(lambda picture: picture, speed=5.0), None
        for k, distance in enumerate(distances):
            unlike = 1e-3 * k * (distance > 0.0)  # or else it would be a frozen one
            told = test.problem(k / 15.0, np.full((20, 30), distance + unlike, dtype=np.float32))
        assert (told is None) is (unseen > 0)


def test_the_end_of_a_freeze_is_no_jump(recorded) -> None:
    stream = [(t, recorded[LIDAR][3][1] if 3 <= k < 13 else data) for k, (t, data) in enumerate(recorded[LIDAR])]
    assert complaints(LIDAR, stream, Jump) == [None] * len(stream)


@given(st.lists(st.booleans(), max_size=200))
def test_a_contradiction_needs_more_disagreement_than_agreement(agreements: list[bool]) -> None:
    contradiction = Contradiction(patience=10)
    told = [contradiction.update(agree=agree) for agree in agreements]
    for k in range(len(told)):
        if told[k]:
            assert agreements[max(0, k - 40) : k + 1].count(False) >= 10
        if agreements[max(0, k - 20) : k + 1].count(True) == 21:
            assert not told[k]


def test_two_imus_on_one_body_agree_until_one_is_wrong() -> None:
    rng, check = np.random.default_rng(1), ImuCrossCheck()

    def batch(offset: float = 0.0) -> np.ndarray:
        noise = np.array([0.06] * 3 + [0.005] * 3) * rng.standard_normal((5, 6))
        return (np.array([0.0, 0.0, 9.81, 0.0, 0.0, 0.0]) + offset + noise).astype(np.float32)

    def compare(offset: float, kick: float = 0.0) -> str | None:
        own = [tuple(row) for row in (batch() + np.array([kick, 0, 0, 0, 0, 0])).tolist()]
        return check.residual(batch(offset), own)

    assert [compare(0.0) for _ in range(500)] == [None] * 500
    assert compare(0.0, kick=200.0) is None, "an impact that one of them missed"
    told = [compare(0.1) for _ in range(50)]
    assert "angular rate" in (told[-1] or "")
    assert [compare(0.0) for _ in range(100)][-1] is None


@pytest.mark.parametrize("wrong", [(math.nan,), (math.inf,), (math.inf, -math.inf)])
@pytest.mark.parametrize("axis", range(6))
def test_an_imu_is_blamed_for_what_is_no_number_at_once_and_judged_as_before_afterwards(
    axis: int, wrong: tuple[float, ...]
) -> None:
    check, good, own = ImuCrossCheck(), np.zeros((5, 6), dtype=np.float32), [(0.0,) * 6] * 5
    bad, off = good.copy(), good.copy()
    bad[: len(wrong), axis], off[:, axis] = wrong, 5.0
    assert "no finite" in (check.residual(bad, own) or "")
    assert check.residual(good, own) is None
    assert "off the autopilot's" in ([check.residual(off, own) for _ in range(50)][-1] or "")


def test_the_range_finder_is_held_against_the_lidar_and_the_ground() -> None:
    check, scan = GroundCrossCheck(standing=0.145), np.full((1024, 16), 4.0, dtype=np.float32)

    def measure(t: float, distance: float, *, standing: bool = False) -> str | None:
        if round(20 * t) % 2 == 0:
            check.update(t, scan)
        return check.residual(t, distance, standing=standing)

    assert [measure(0.05 * k, 4.1) for k in range(40)] == [None] * 40
    told = [measure(2.0 + 0.05 * k, 5.0) for k in range(20)]
    assert told[8] is None
    assert "LiDAR" in (told[-1] or "")
    assert [measure(3.0 + 0.05 * k, 0.15, standing=True) for k in range(30)][-1] is None
    assert "stands" in ([measure(5.0 + 0.05 * k, 1.1, standing=True) for k in range(12)][-1] or "")
    assert GroundCrossCheck(standing=0.145).residual(9.0, 7.0, standing=False) is None, (
        "nobody else has seen the ground"
    )
