"""Odometry in a room: its accuracy, its initial pose, and its detection of its own errors."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy

import numpy as np
import pytest
from box_room import BATCH, HIGH, IMU_RATE, LOW, STANDING, Room

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.divergence_monitor import MOST_REJECTED
from skillwing.onboard.odometry.odometry import KEPT, PATIENCE, SCANS_WITHOUT_IMU, LidarInertialOdometry, Phase


def make_odometry() -> LidarInertialOdometry:
    return LidarInertialOdometry(LOW, HIGH)


_flown: dict[tuple[str, float], tuple[Room, LidarInertialOdometry]] = {}
"""Flights of rooms, as text, after so many seconds: most tests begin with the same one."""


def flying(room: Room, seconds: float = 2.0) -> LidarInertialOdometry:
    """Odometry in the air, `seconds` after the drone began to move. room: a new one."""
    key = repr(room), seconds
    if key not in _flown:
        flown, odometry = deepcopy(room), make_odometry()
        for _ in flown.fly(odometry, STANDING + seconds):
            pass
        _flown[key] = flown, odometry
    flown, odometry = deepcopy(_flown[key])
    vars(room).update(vars(flown))
    assert odometry.phase is Phase.TRACKING
    return odometry


def test_it_follows_a_drone_through_a_room_and_finds_the_biases() -> None:
    room, odometry = Room(), make_odometry()
    fixes = list(room.fly(odometry, 14.0))
    assert len(fixes) == 119
    errors = [np.linalg.norm(fix.state.position - room.position(fix.t)) for fix in fixes]
    turns = [np.linalg.norm(so3.log(fix.state.turn.T @ room.turn(fix.t))) for fix in fixes]
    assert max(errors) < 0.05
    assert max(turns) < np.radians(0.3)
    last = fixes[-1]
    assert np.allclose(last.state.gyro_bias, room.gyro_bias, atol=1.5e-3)
    assert np.allclose(last.state.accel_bias, room.accel_bias, atol=0.04)
    assert all(fix.accepted for fix in fixes)
    assert all(errors[k] < 4.0 * np.linalg.norm(fix.position_sigma) for k, fix in enumerate(fixes))
    assert last.agreement.share > 0.6


def test_the_same_measurements_give_the_same_poses_bit_by_bit() -> None:
    runs = [[fix.state.position.tobytes() for fix in Room().fly(make_odometry(), 4.0)] for _ in range(2)]
    assert runs[0] == runs[1]


def test_it_begins_after_two_seconds_at_rest_where_navigation_says() -> None:
    room, odometry = Room(), make_odometry()
    assert list(room.fly(odometry, 1.9)) == []
    assert odometry.phase is Phase.STARTING
    (first, *_) = room.fly(odometry, 0.3)
    assert odometry.begun_at == pytest.approx(2.0, abs=0.11)
    assert np.allclose(first.state.position, room.position(0.0), atol=0.01)


def test_it_begins_in_flight_from_navigation_and_learns_the_biases_there() -> None:
    room, odometry = Room(begins_at=6.0), make_odometry()
    fixes = list(room.fly(odometry, 8.0))
    assert odometry.begun_at == pytest.approx(6.0, abs=0.3)
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.1
    assert np.allclose(fixes[-1].state.gyro_bias, room.gyro_bias, atol=3e-3)
    assert odometry.phase is Phase.TRACKING


def test_a_frame_that_begins_leaning_is_levelled_in_flight() -> None:
    room, odometry = Room(tilt=np.array([0.012, -0.01, 0.0])), make_odometry()
    last = list(room.fly(odometry, 14.0))[-1]
    upright = room.turn(last.t)
    assert np.linalg.norm(so3.log(last.state.turn @ upright.T)[:2]) > 0.01
    assert np.linalg.norm(so3.log(last.levelled.turn @ upright.T)[:2]) < 0.005
    assert np.all(np.abs(last.levelled.position - room.position(last.t)) < 4.0 * last.position_sigma)


def test_without_navigation_it_does_not_begin() -> None:
    room, odometry = Room(), make_odometry()
    for k in range(200):
        odometry.imu(room.inertial(k * BATCH, (k + 1) * BATCH))
    assert odometry.scan(room.scan(3.9, 4.0)) is None
    assert odometry.phase is Phase.STARTING


def biased(room: Room) -> None:
    room.lidar_bias = 1.0


def noisy(room: Room) -> None:
    room.lidar_noise = 2.0


def turning(room: Room) -> None:
    room.gyro_bias = room.gyro_bias + 1.0


def falling(room: Room) -> None:
    room.accel_bias = room.accel_bias + 1.0


def both(room: Room) -> None:
    turning(room)
    falling(room)


@pytest.mark.parametrize("break_", [biased, noisy, turning, falling, both])
def test_it_notices_within_two_seconds_that_a_sensor_lies(break_: Callable[[Room], None]) -> None:
    room = Room()
    odometry = flying(room)
    break_(room)
    broken_at = room.t
    fixes = list(room.fly(odometry, 2.0))
    assert odometry.phase is Phase.LOST
    assert odometry.text
    assert fixes[-1].t - broken_at < 2.0
    assert len(fixes) >= MOST_REJECTED - 1


def test_a_small_bias_of_the_ranges_is_borne_and_one_that_grows_is_noticed() -> None:
    room = Room()
    odometry = flying(room)
    room.lidar_bias = 0.05
    assert all(fix.accepted for fix in room.fly(odometry, 4.0))
    while odometry.phase is not Phase.LOST and room.lidar_bias < 1.0:
        room.lidar_bias += 0.01
        list(room.fly(odometry, 0.1))
    assert odometry.phase is Phase.LOST
    assert "fit the planes" in odometry.text
    assert room.lidar_bias < 0.4


@pytest.mark.parametrize("thickness", [0.15, 0.4])
def test_flying_through_a_doorway_in_a_thin_wall_and_back_is_no_divergence(thickness: float) -> None:
    """Both faces of the wall lie in the same voxels, and the drone sees only one of them at a time."""
    front, back = 2.5 - 0.5 * thickness, 2.5 + 0.5 * thickness
    right = np.array([front, -20.0, -20.0]), np.array([back, -2.5, 20.0])
    left = np.array([front, 2.5, -20.0]), np.array([back, 20.0, 20.0])
    room, odometry = Room(blocks=(right, left)), make_odometry()
    fixes = list(room.fly(odometry, 13.0))
    assert max(fix.state.position[0] for fix in fixes) > back + 1.0
    assert fixes[-1].state.position[0] < front - 1.0
    assert all(fix.accepted for fix in fixes)
    assert min(fix.agreement.close / fix.agreement.matched for fix in fixes[3:]) > 0.95
    assert max(np.linalg.norm(fix.state.position - room.position(fix.t)) for fix in fixes) < 0.06


def test_a_lost_odometry_gives_no_poses_until_restarted() -> None:
    room = Room()
    odometry = flying(room)
    room.lidar_bias = 1.0
    list(room.fly(odometry, 2.0))
    room.lidar_bias = 0.0
    assert list(room.fly(odometry, 1.0)) == []
    odometry.restart()
    assert odometry.phase is Phase.STARTING
    fixes = list(room.fly(odometry, 6.0))
    assert odometry.phase is Phase.TRACKING
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.1


@pytest.mark.parametrize(("begins", "broken"), [(False, "lost"), (True, "lidar_bias"), (True, "blind")])
def test_inertial_measurements_that_no_scan_asks_for_are_not_kept_for_ever(begins: bool, broken: str) -> None:
    room = Room()
    odometry = flying(room) if begins else make_odometry()
    setattr(room, broken, True)
    list(room.fly(odometry, 10.0))
    assert odometry.phase is (Phase.LOST if begins else Phase.STARTING)
    assert len(odometry._memory.take(-np.inf, np.inf)) <= (KEPT + BATCH) * IMU_RATE


def test_a_single_wrong_scan_is_left_out_and_changes_nothing() -> None:
    room = Room()
    odometry = flying(room)
    room.lidar_bias = 1.0
    rejected = list(room.fly(odometry, 0.1))
    room.lidar_bias = 0.0
    fixes = list(room.fly(odometry, 2.0))
    assert [fix.accepted for fix in rejected] == [False]
    assert all(fix.accepted for fix in fixes)
    assert odometry.phase is Phase.TRACKING
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.05


def test_scans_may_be_missing_for_a_moment_but_not_for_long() -> None:
    room = Room()
    odometry = flying(room)
    room.blind = True
    list(room.fly(odometry, PATIENCE - 0.2))
    assert odometry.phase is not Phase.LOST
    list(room.fly(odometry, 0.4))
    assert odometry.phase is Phase.LOST
    assert f"no scans for {PATIENCE:g} s" in odometry.text


def test_scans_without_inertial_measurements_tell_soon_that_these_are_gone() -> None:
    room = Room()
    odometry = flying(room)
    room.deaf = True
    list(room.fly(odometry, 0.1 * (SCANS_WITHOUT_IMU - 1)))
    assert odometry.phase is not Phase.LOST
    list(room.fly(odometry, 0.2))
    assert odometry.phase is Phase.LOST
    assert "no inertial measurements" in odometry.text


def test_scans_that_were_missing_are_bridged_by_inertial_measurements() -> None:
    room = Room()
    odometry = flying(room)
    room.blind = True
    list(room.fly(odometry, 1.5))
    room.blind = False
    fixes = list(room.fly(odometry, 1.0))
    assert odometry.phase is Phase.TRACKING
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.06


def without_everything(room: Room, odometry: LidarInertialOdometry, seconds: float) -> None:
    """Let time pass without any measurements, as while the router is restarted."""
    room.deaf = room.blind = room.lost = True
    list(room.fly(odometry, seconds))
    room.deaf = room.blind = room.lost = False


@pytest.mark.parametrize("seconds", [0.1, 0.12, 0.14, 0.16, 0.2])
@pytest.mark.parametrize("before", [1.6, 1.7, 1.8, 1.9, 2.0])
def test_a_scan_may_pass_without_any_inertial_measurement(before: float, seconds: float) -> None:
    """Rounding decides whether a gap of one scan's length counts."""
    room = Room()
    odometry = flying(room, before)
    room.deaf = True
    list(room.fly(odometry, seconds))
    room.deaf = False
    fixes = list(room.fly(odometry, 0.6))
    assert odometry.phase is Phase.TRACKING
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.1


@pytest.mark.parametrize("every", [6, 8, 10, 20])
def test_measurements_that_stay_too_few_are_not_bridged_for_ever(every: int) -> None:
    room = Room()
    odometry = flying(room)
    room.every = every
    fixes = list(room.fly(odometry, 2.0 * PATIENCE))
    if odometry.phase is Phase.LOST:
        assert "inertial measurements" in odometry.text
    else:
        assert room.t - fixes[-1].t <= PATIENCE
        assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.2


def test_one_batch_of_ten_is_too_few() -> None:
    room = Room()
    odometry = flying(room)
    room.every = 10
    list(room.fly(odometry, 1.5 * PATIENCE))
    assert odometry.phase is Phase.LOST


@pytest.mark.parametrize("seconds", [0.3, 1.0, 1.6])
def test_missing_inertial_measurements_are_bridged_by_how_navigation_moved(seconds: float) -> None:
    room = Room(tilt=np.array([0.012, -0.01, 0.0]))
    odometry = flying(room)
    without_everything(room, odometry, seconds)
    fixes = list(room.fly(odometry, 1.5))
    assert odometry.phase is Phase.TRACKING
    assert all(fix.accepted for fix in fixes)
    errors = [np.linalg.norm(fix.levelled.position - room.position(fix.t)) for fix in fixes]
    assert errors[-1] < 0.08


def test_what_navigation_does_not_tell_is_not_guessed() -> None:
    room = Room()
    odometry = flying(room)
    without_everything(room, odometry, 1.0)
    room.lost = True
    assert list(room.fly(odometry, 0.5)) == []
    assert odometry.phase is Phase.REJECTING
    list(room.fly(odometry, 1.0))
    assert odometry.phase is Phase.LOST
    assert "inertial measurements" in odometry.text
    assert "navigation" in odometry.text


def test_navigation_may_come_later_than_the_first_scans() -> None:
    room = Room()
    odometry = flying(room)
    without_everything(room, odometry, 0.8)
    room.lost = True
    list(room.fly(odometry, 0.3))
    room.lost = False
    fixes = list(room.fly(odometry, 1.0))
    assert odometry.phase is Phase.TRACKING
    assert odometry.text == ""
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.08


def test_where_navigation_is_does_not_matter_to_the_bridge() -> None:
    room = Room()
    odometry = flying(room)
    room.offset = np.array([30.0, -20.0, 5.0])
    list(room.fly(odometry, 0.1))
    without_everything(room, odometry, 1.0)
    fixes = list(room.fly(odometry, 1.0))
    assert np.linalg.norm(fixes[-1].state.position - room.position(fixes[-1].t)) < 0.08
