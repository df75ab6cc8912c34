"""Bridging by navigation: its movement is added to the filter's state, errors included."""

from __future__ import annotations

import numpy as np

from skillwing.onboard.odometry import so3
from skillwing.onboard.odometry.navigation_bridge import NavigationBridge
from skillwing.onboard.odometry.state import ATTITUDE, GYRO_BIAS, SIZE, FilterState
from skillwing.onboard.topics.navigation import Navigation


def solution(t: float, position: tuple[float, float, float], yaw: float) -> Navigation:
    return Navigation(
        t=t,
        position=position,
        velocity=(1.0, 0.0, 0.0),
        quaternion=so3.quaternion(so3.exp(np.array([0.0, 0.0, yaw]))),
        angular_velocity=(0.0, 0.0, 0.0),
        heading=yaw,
    )


def bridge_over_a_quarter_turn() -> NavigationBridge:
    bridge = NavigationBridge()
    bridge.navigation(solution(1.0, (5.0, 5.0, 5.0), 0.3))
    bridge.reached(1.0)
    bridge.navigation(solution(2.0, (6.0, 4.0, 5.5), 0.3 + np.pi / 2))
    return bridge


def somewhere(error: np.ndarray) -> FilterState:
    zero = np.zeros(3)
    return FilterState(zero, so3.exp(np.array([0.0, 0.0, 0.3])), zero, zero, zero).plus(error)


def test_errors_before_become_the_errors_afterwards_that_the_covariance_tells() -> None:
    """The law by which a covariance is carried on, tried on errors themselves."""
    rng = np.random.default_rng(1)
    sigmas = np.full(SIZE, 1e-4)
    sigmas[ATTITUDE] = 0.05, 0.001, 0.002
    mixing = rng.normal(size=(SIZE, SIZE)) * sigmas[:, None]
    covariance = mixing @ mixing.T / SIZE
    bridge = bridge_over_a_quarter_turn()
    told = bridge.over(somewhere(np.zeros(SIZE)), covariance, 2.0)
    assert told is not None
    errors = rng.multivariate_normal(np.zeros(SIZE), covariance, 4000)
    ends = [bridge.over(somewhere(error), covariance, 2.0) for error in errors]
    seen = np.cov(np.array([end[0].minus(told[0]) for end in ends if end is not None]).T)
    added = bridge.over(somewhere(np.zeros(SIZE)), np.zeros((SIZE, SIZE)), 2.0)
    assert added is not None
    carried = told[1] - added[1]
    for part in (ATTITUDE, GYRO_BIAS):
        scale = np.sqrt(np.outer(np.diag(seen)[ATTITUDE], np.diag(seen)[part]))
        assert np.abs(carried[ATTITUDE, part] - seen[ATTITUDE, part]).max() < 0.1 * scale.max()
    assert carried[ATTITUDE, ATTITUDE][1, 1] > 100 * carried[ATTITUDE, ATTITUDE][0, 0], "roll has become pitch"


def test_a_movement_is_taken_over_whatever_the_place() -> None:
    told = bridge_over_a_quarter_turn().over(somewhere(np.zeros(SIZE)), np.zeros((SIZE, SIZE)), 2.0)
    assert told is not None
    assert np.allclose(told[0].position, (1.0, -1.0, 0.5))
    assert np.allclose(told[0].velocity, (1.0, 0.0, 0.0))
    assert np.allclose(so3.log(told[0].turn), (0.0, 0.0, 0.3 + np.pi / 2))


def test_navigation_that_is_old_or_lost_tells_nothing() -> None:
    state, covariance = somewhere(np.zeros(SIZE)), np.zeros((SIZE, SIZE))
    assert NavigationBridge().over(state, covariance, 2.0) is None
    assert bridge_over_a_quarter_turn().over(state, covariance, 2.5) is None
