"""The inspection on real managers and a toy drone: nominal, and any event at any time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from flights import AWAY, BACK, ROOT, Flight
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_drone import PIECES

from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.missions.inspection import MISSION
from skillwing.services.protocol import RecordKind

TREE_FILE = ROOT / "bt_missions/skillwing/bt_missions/missions/inspection.xml"
LAPS = 0.5
BUILDING = {"center": (9.0, 0.0, 0.0), "radius": 5.0, "height": 4.0, "laps": LAPS, "return_height": 4.0, "hover": 2.0}
LONGEST = 30.0
"""Longer than the nominal flight takes, in seconds: whatever happens may also come after it."""
FLOWN = ["takeoff", "inspect", "return_home", "land"]
seeds = st.integers(0, 2**16)
moments = st.floats(0.0, LONGEST)
few = settings(max_examples=3, deadline=None)


def inspection(seed: int = 0, **options: Any) -> Flight:
    return Flight(seed=seed, mission=MISSION, **BUILDING, **options)


def assert_flown_on_as_if_nothing_had_been(flight: Flight, holds: int = 1) -> None:
    """Round the building once, and home. A hold costs what was flown since the last feedback, and no more."""
    status = flight.fly()
    assert status.phase == "SUCCEEDED"
    assert flight.drone.position == (0.0, 0.0, 0.0)
    assert flight.idle
    assert flight.ends("inspect")[-1] == "S_COMPLETED"
    assert LAPS - 0.001 <= flight.drone.laps <= LAPS + 3.0 * holds / PIECES
    assert len(flight.ends("stream")) <= 1, "there was video all the time"


def assert_safe(flight: Flight) -> None:
    assert flight.idle
    assert flight.on_ground


def test_nominal() -> None:
    flight = inspection()
    assert_flown_on_as_if_nothing_had_been(flight, holds=0)
    assert [skill for skill in flight.started if skill in FLOWN] == FLOWN
    assert flight.ends("stream") == flight.ends("lidar_depthmap") == ["IT"]
    assert flight.statuses[-1].t < LONGEST


def lose_link(flight: Flight) -> None:
    flight.drone.bandwidth = 0.0


def lose_lidar(flight: Flight) -> None:
    flight.drone.set("lidar_status", "FAILED")


@pytest.mark.parametrize(
    ("failures", "phase"),
    [
        ([], "SUCCEEDED"),
        ([(15.0, lose_link)], "FAILED"),
        ([(10.0, lose_lidar)], "FAILED"),
        ([(10.0, lose_lidar), (12.0, lose_link)], "FAILED"),
    ],
)
def test_the_tree_file_flies_as_the_mission_in_python_does(
    failures: list[tuple[float, Callable[[Flight], None]]], phase: str
) -> None:
    flights = [inspection(), Flight(mission=find_mission(str(TREE_FILE)), **BUILDING)]
    for flight in flights:
        for moment, fail in failures:
            flight.at(moment, partial(fail, flight))
        assert flight.fly().phase == phase
    by_python, by_file = ([(goal.skill, goal.terminal) for goal in flight.goals.values()] for flight in flights)
    assert by_file == by_python


@given(seed=seeds, moment=moments, narrow=st.floats(0.0, 0.4))
@few
def test_the_link_may_get_critical_at_any_time_and_the_drone_hovers_and_lands(
    seed: int, moment: float, narrow: float
) -> None:
    flight = inspection(seed)
    flight.at(moment, lambda: setattr(flight.drone, "bandwidth", narrow))
    status = flight.fly()
    assert_safe(flight)
    if status.phase == "SUCCEEDED":
        [end] = [each for each in flight.records if each.subject == "stream" and each.after in ("IT", "S_FPS_LOST")]
        [home] = [each for each in flight.records if each.subject == "return_home" and each.after == "S_ARRIVED"]
        assert end.t > home.t, "the link was good enough until it was home"
        return
    assert status.phase == "FAILED"
    assert "stream" in status.text
    assert flight.started[-2:] == ["hover", "land"]
    if flight.ends("stream") == ["S_FPS_LOST"]:
        told = [each for each in flight.records if each.kind is RecordKind.MISSION]
        switch = next(each for each in told if each.subject == "inspection" and each.before == "flying with video")
        assert flight.chain(switch)[1].subject == "stream"
    else:
        assert flight.ends("stream") == ["NR"], "without a link it does not begin"


def test_the_lidar_fails_on_the_way_round() -> None:
    """The camera sees the way home, and the video goes on."""
    flight = inspection()
    flight.at(10.0, lambda: lose_lidar(flight))
    status = flight.fly()
    assert status.phase == "FAILED"
    assert status.text.startswith("inspecting -> coming home by ZED, for lidar_depthmap ended RI: ")
    assert flight.idle
    assert flight.drone.position == (0.0, 0.0, 0.0)
    assert flight.started[-3:] == ["zed_depthmap", "return_home", "land"]
    assert flight.ends("stream") == flight.ends("zed_depthmap") == ["IT"]
    assert "hover" not in flight.started
    (switch,) = (each for each in flight.records if each.kind is RecordKind.MISSION and each.before == "inspecting")
    assert flight.chain(switch)[-1].subject == "lidar_status"
    begun = next(each for each in flight.records if each.subject == "return_home")
    assert switch in flight.chain(begun)


@given(seed=seeds, moment=moments)
@few
def test_the_lidar_may_fail_at_any_time_and_the_drone_comes_home(seed: int, moment: float) -> None:
    flight = inspection(seed)
    flight.at(moment, lambda: lose_lidar(flight))
    status = flight.fly()
    assert_safe(flight)
    assert flight.drone.position == (0.0, 0.0, 0.0)
    if status.phase != "SUCCEEDED" and flight.started:
        assert "lidar" in status.text
        assert flight.started[-1] == "land"


@given(seed=seeds, moment=moments, apart=st.floats(0.0, 10.0))
@few
def test_the_camera_may_fail_after_the_lidar_and_the_drone_lands(seed: int, moment: float, apart: float) -> None:
    flight = inspection(seed)
    flight.at(moment, lambda: lose_lidar(flight))
    flight.at(moment + apart, lambda: flight.drone.set("zed_status", "FAILED"))
    flight.fly()
    assert_safe(flight)


@given(seed=seeds, moment=st.floats(1.0, LONGEST), state=st.sampled_from(["LOW", "CRITICAL"]))
@few
def test_the_battery_may_run_low_at_any_time_and_the_drone_comes_down(seed: int, moment: float, state: str) -> None:
    flight = inspection(seed)
    flight.at(moment, lambda: flight.drone.set("battery_status", state))
    status = flight.fly()
    assert_safe(flight)
    if status.phase == "SUCCEEDED":
        assert flight.ends("inspect") == ["S_COMPLETED"]
    elif state == "CRITICAL":
        assert "battery_status is CRITICAL" in status.text
    elif "stream" in flight.started:
        assert flight.drone.position == (0.0, 0.0, 0.0), "a low one is enough to come home"


@given(
    seed=seeds,
    moment=st.floats(6.0, LONGEST),
    kept=st.floats(0.01, 8.0),
)
@few
def test_a_drone_that_the_pilot_gives_back_flies_its_lap_on_from_where_it_was(
    seed: int, moment: float, kept: float
) -> None:
    flight = inspection(seed)
    flight.at(moment, lambda: flight.drone.set(*AWAY))
    flight.at(moment + kept, lambda: flight.drone.set(*BACK))
    assert_flown_on_as_if_nothing_had_been(flight)


@given(seed=seeds, moment=moments)
@few
def test_the_pilot_may_keep_the_drone_at_any_time_and_nothing_is_commanded_after(seed: int, moment: float) -> None:
    flight = inspection(seed, pilot_patience=10.0)
    started_before: list[int] = []

    def take_over() -> None:
        flight.drone.set(*AWAY)
        flight.observer.after(0.05, lambda: started_before.append(len(flight.started)))

    flight.at(moment, take_over)
    status = flight.fly()
    assert flight.idle
    if status.phase != "SUCCEEDED":
        assert status.phase == "FAILED"
        assert "SDK_authority is UNAVAILABLE" in status.text
        assert len(flight.started) == started_before[0]


@given(seed=seeds, moment=st.floats(1.0, LONGEST), length=st.floats(0.5, 8.0))
@few
def test_a_pause_at_any_time_keeps_the_video_and_costs_nothing_but_time(
    seed: int, moment: float, length: float
) -> None:
    flight = inspection(seed)
    flight.network.run_for(moment)
    paused = flight.node.pause() is None
    if paused:
        flight.network.run_for(2.0)
        place = flight.drone.position
        flight.network.run_for(length)
        assert flight.drone.position == place
        assert flight.node.resume() is None
    assert_flown_on_as_if_nothing_had_been(flight, holds=int(paused))


@given(seed=seeds, moment=moments, paused=st.booleans())
@few
def test_an_abort_at_any_time_brings_the_drone_down(seed: int, moment: float, paused: bool) -> None:
    flight = inspection(seed)
    if paused:
        flight.at(max(0.0, moment - 1.0), lambda: flight.node.pause() and None)
    flight.at(moment, lambda: flight.node.abort("the wind gets up") and None)
    status = flight.fly()
    assert status.phase in ("ABORTED", "SUCCEEDED")
    assert status.phase == "SUCCEEDED" or status.text.startswith("the wind gets up")
    assert_safe(flight)
