"""Path monitor: a motion stops in time, at any speed and for any obstacle."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace as replaced

from skillwing.onboard.frames.extent import TIP_RADIUS
from skillwing.onboard.guidance.path_monitor import (
    GONE,
    LATENCY,
    LEAST_MARGIN,
    MARGIN,
    MIN_SPEED,
    REPORTED,
    SETTLE_TIME,
    SILENCE,
    STALE,
    STEEPEST,
    TOLERANCE,
    PathMonitor,
    PathVisibility,
    fastest,
    stopping_distance,
)
from skillwing.onboard.guidance.trajectory import ACCELERATION, BRAKING
from skillwing.onboard.obstacles.node import PERIOD
from skillwing.onboard.topics.obstacles import ObstacleSource, ObstacleStatus
from skillwing.sim_mujoco.sensors.depth_pictures import FOCAL, HEIGHT

TICK, REPORT = 0.02, 0.1
DELAY = 0.2
"""Age of a measurement in the report on it [s]: one revolution, and a second one that agrees."""
LAG = 0.1
"""Time until the drone leans back to brake [s]."""


def told(t: float, stamp: float, free: float | None, horizon: float = 14.0) -> ObstacleStatus:
    return ObstacleStatus(t=t, source=ObstacleSource.ZED, free_distance=free, horizon=horizon, ahead=None, stamp=stamp)


def gap_after_stopping(
    speed: float,
    obstacle: float,
    horizon: float,
    phase: float,
    last_measured: float = math.inf,
    last_report: float = math.inf,
) -> float:
    """Distance from an obstacle at which the drone's centre comes to rest [m]. The obstacle stands `obstacle` metres
    ahead and is visible from `horizon` on. `phase` shifts the reports against the ticks. Measurements end at
    `last_measured`, and reports at `last_report`."""
    monitor, t, s, v, braking_from = PathMonitor(), 0.0, 0.0, 0.0, math.inf
    track: list[tuple[float, float]] = []
    monitor.report(told(0.0, 0.0, 50.0, horizon))
    monitor.begin(0.0)
    speed = min(speed, monitor.speed_limit(0.0))
    next_report = phase * REPORT
    while v > 0.0 or t < 1.0:
        track.append((t, s))
        if next_report <= t <= last_report:
            next_report += REPORT
            stamp = min(max(0.0, t - DELAY), last_measured)
            then = next(place for moment, place in reversed(track) if moment <= stamp + 1e-9)
            seen = obstacle - s if obstacle - then <= horizon else 50.0
            monitor.report(told(t, stamp, seen, horizon))
        if monitor.view(t, v, math.inf) in (PathVisibility.BLOCKED, PathVisibility.BLIND):
            braking_from = min(braking_from, t + LAG)
        v = max(0.0, v - BRAKING * TICK) if t >= braking_from else min(speed, v + ACCELERATION * TICK)
        s, t = s + v * TICK, t + TICK
        if s > obstacle:
            return obstacle - s
    return obstacle - s


@given(
    speed=st.floats(0.3, 5.0),
    obstacle=st.floats(MARGIN + 0.5, 40.0),
    horizon=st.floats(3.0, 14.0),
    phase=st.floats(0.0, 1.0),
)
@settings(max_examples=150, deadline=None)
def test_it_stops_in_time_at_every_speed(speed: float, obstacle: float, horizon: float, phase: float) -> None:
    gap = gap_after_stopping(speed, obstacle, horizon, phase)
    assert gap >= LEAST_MARGIN - 0.1
    assert gap - TIP_RADIUS > 0.3


@given(
    speed=st.floats(0.3, 5.0),
    obstacle=st.floats(14.0, 40.0),
    horizon=st.floats(3.0, 14.0),
    phase=st.floats(0.0, 1.0),
    silent_at=st.floats(1.0, 12.0),
    whole_node=st.booleans(),
)
@settings(max_examples=150, deadline=None)
def test_it_stops_in_time_also_where_the_sensor_or_the_obstacle_node_falls_silent(
    speed: float, obstacle: float, horizon: float, phase: float, silent_at: float, whole_node: bool
) -> None:
    ends = {"last_report": silent_at} if whole_node else {"last_measured": silent_at}
    gap = gap_after_stopping(speed, obstacle, horizon, phase, **ends)
    assert gap >= LEAST_MARGIN - 0.15


@pytest.mark.parametrize("horizon", [5.7, 14.0])
def test_what_shows_itself_as_the_sensor_falls_silent_is_still_stopped_for(horizon: float) -> None:
    """The drone flies at the fastest speed, and the last measurement is from just before the obstacle is visible."""
    speed, silent_at = fastest(horizon), 10.0
    then = speed * silent_at - speed * speed / (2.0 * ACCELERATION)
    gaps = [gap_after_stopping(9.0, then + horizon + 0.05, horizon, phase / 8, silent_at) for phase in range(8)]
    assert LEAST_MARGIN - 2 * TICK * speed < min(gaps) < LEAST_MARGIN + 0.5


def test_a_late_report_is_reduced_by_the_path_flown_since() -> None:
    monitor, free = PathMonitor(), stopping_distance(4.0) + 0.5
    monitor.begin(0.0)
    monitor.report(told(1.0, 1.0, free))
    assert monitor.view(1.0 + REPORTED, 4.0, 30.0) is PathVisibility.CLEAR
    assert monitor.view(1.2 + REPORTED, 4.0, 30.0) is PathVisibility.BLOCKED


@given(st.floats(LEAST_MARGIN + 0.5, 40.0))
def test_the_speed_limit_is_that_at_which_the_drone_stops_at_the_horizon(horizon: float) -> None:
    speed = fastest(horizon)
    assert speed == MIN_SPEED or stopping_distance(speed, LEAST_MARGIN, SILENCE) == pytest.approx(horizon)


def test_the_reach_of_both_sensors_allows_the_speeds_that_are_flown() -> None:
    assert fastest(14.0) >= 4.5, "the camera's"
    assert 2.3 <= fastest(5.7) <= 3.0, "the ring's; missions fly 2 m/s"
    assert LATENCY >= DELAY + REPORT + LAG
    assert SILENCE >= STALE + LAG
    assert PERIOD <= REPORTED, "of the obstacle node"


@pytest.mark.parametrize("free", [None, 9.0])
def test_a_way_is_watched_from_the_first_word_on_it_and_then_has_to_stay_in_view(free: float | None) -> None:
    monitor = PathMonitor()
    monitor.report(told(0.9, 0.9, 5.0))
    monitor.begin(1.0)
    assert monitor.view(1.05, 0.1, 20.0) is PathVisibility.CLEAR, "that report speaks of the way before"
    monitor.report(told(1.4, 1.4, free))
    assert monitor.view(1.4, 0.1, 20.0) is (PathVisibility.UNWATCHED if free is None else PathVisibility.CLEAR)
    monitor.report(told(1.6, 1.6, None))
    assert monitor.view(1.6, 0.1, 20.0) is (PathVisibility.UNWATCHED if free is None else PathVisibility.BLIND)


def test_a_depth_map_that_falls_silent_as_a_way_begins_is_missed() -> None:
    monitor = PathMonitor()
    monitor.report(told(0.9, 0.9, 5.0))
    monitor.begin(1.0)
    assert monitor.view(1.0 + SETTLE_TIME + STALE - 0.01, 0.1, 20.0) is PathVisibility.CLEAR
    assert monitor.view(1.0 + SETTLE_TIME + STALE + 0.01, 0.1, 20.0) is PathVisibility.BLIND


@pytest.mark.parametrize("stamp", [0.3, None])
def test_a_way_that_begins_while_the_sensor_is_silent_is_not_flown_unwatched(stamp: float | None) -> None:
    """The last measurement is too old, or the source was chosen just now and has none yet."""
    monitor, begun, given_up = PathMonitor(), told(1.0, 0.3, 3.0), ObstacleSource.NONE
    monitor.report(replaced(begun, stamp=stamp))
    monitor.begin(1.0)
    assert monitor.has_depth_map(1.0)
    monitor.report(replaced(begun, t=2.0, stamp=stamp))
    assert monitor.view(1.0 + SETTLE_TIME + STALE - 0.01, 0.1, 20.0) is PathVisibility.CLEAR
    assert monitor.view(2.0, 0.1, 20.0) is PathVisibility.BLIND
    assert not monitor.may_go_on(2.0)
    monitor.report(told(2.1, 2.1, None))
    assert monitor.may_go_on(2.1), "it looks elsewhere"
    monitor.report(replaced(begun, t=2.2, source=given_up, stamp=None))
    assert monitor.may_go_on(2.2), "nobody looks any more"
    assert monitor.view(2.2, 0.1, 20.0) is PathVisibility.UNWATCHED


@pytest.mark.parametrize("across", [False, True])
def test_a_way_that_the_drone_has_turned_to_is_not_flown_unless_it_is_seen(across: bool) -> None:
    monitor, elsewhere = PathMonitor(), replaced(told(1.0, 1.0, None), across=across)
    monitor.report(elsewhere)
    monitor.begin(1.0, across=across)
    assert monitor.view(1.1, 0.1, 20.0) is PathVisibility.CLEAR, "that report speaks of the way before"
    monitor.report(replaced(elsewhere, t=1.4, stamp=1.4))
    assert monitor.view(1.4, 0.1, 20.0) is PathVisibility.BLIND
    assert not monitor.may_go_on(1.4)
    monitor.report(replaced(elsewhere, t=1.5, stamp=1.5, free_distance=9.0))
    assert monitor.may_go_on(1.5)
    assert monitor.view(1.5, 0.1, 20.0) is PathVisibility.CLEAR


@pytest.mark.parametrize("turned", [None, True])
def test_a_source_that_does_not_look_where_the_drone_has_turned_need_not_see(turned: bool | None) -> None:
    monitor = PathMonitor()
    monitor.report(told(1.4, 1.4, None))
    monitor.begin(1.0, across=turned)
    assert monitor.view(1.4, 0.1, 20.0) is PathVisibility.UNWATCHED
    assert monitor.may_go_on(1.4)


def test_the_steepest_way_is_in_the_camera_s_view_while_the_drone_leans_to_fly_off() -> None:
    lean = math.atan2(ACCELERATION, 9.81)
    assert math.tan(STEEPEST + lean) < HEIGHT / 2 / FOCAL


def test_a_way_that_was_watched_is_not_flown_on_when_the_depth_map_is_given_up() -> None:
    monitor = PathMonitor()
    monitor.begin(0.0)
    monitor.report(told(1.0, 1.0, 20.0))
    assert monitor.view(1.0, 0.1, 20.0) is PathVisibility.CLEAR
    monitor.report(replaced(told(1.1, 1.1, None), source=ObstacleSource.NONE, stamp=None))
    assert monitor.view(1.1, 0.1, 20.0) is PathVisibility.BLIND
    assert not monitor.may_go_on(1.1)


def test_an_obstacle_process_that_has_ended_keeps_no_way_from_being_flown() -> None:
    monitor = PathMonitor()
    monitor.report(told(1.0, 1.0, 5.0))
    monitor.begin(1.0 + GONE + 0.1)
    assert not monitor.has_depth_map(1.0 + GONE + 0.1)
    assert monitor.view(9.0, 2.0, 20.0) is PathVisibility.UNWATCHED


def test_without_a_depth_map_nothing_is_watched_and_no_speed_is_too_high() -> None:
    monitor = PathMonitor()
    monitor.report(
        ObstacleStatus(t=1.0, source=ObstacleSource.NONE, free_distance=None, horizon=0.0, ahead=None, stamp=None)
    )
    monitor.begin(1.0)
    assert monitor.speed_limit(1.0) == math.inf
    assert monitor.view(5.0, 5.0, 20.0) is PathVisibility.UNWATCHED


def test_a_view_that_becomes_short_makes_the_speed_too_high() -> None:
    monitor = PathMonitor()
    monitor.begin(0.0)
    monitor.report(told(1.0, 1.0, 20.0))
    assert monitor.view(1.0, 4.0, 30.0) is PathVisibility.CLEAR
    monitor.report(told(1.1, 1.1, 20.0, horizon=5.0))
    assert monitor.view(1.1, 4.0, 30.0) is PathVisibility.TOO_FAST
    assert monitor.view(1.1, fastest(5.0) + 2.0 * TOLERANCE, 30.0) is PathVisibility.TOO_FAST
    assert monitor.view(1.1, fastest(5.0), 30.0) is PathVisibility.CLEAR
