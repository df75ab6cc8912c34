"""The mapping mission on real managers and a toy drone: nominal, and any failure at any time."""

from __future__ import annotations

import pytest
from flights import ROOT, ROUTE, Flight
from hypothesis import given
from hypothesis import strategies as st

from law_settings import examples
from skillwing.bt_missions.library import find_mission
from skillwing.services.protocol import RecordKind

TREE_FILE = ROOT / "bt_missions/skillwing/bt_missions/missions/mapping.xml"

LONGEST = 42.0
"""Longer than the nominal mission takes, in seconds: a failure may also come after it."""
moments = st.floats(0.0, LONGEST)
seeds = st.integers(0, 2**16)


def test_nominal() -> None:
    flight = Flight()
    status = flight.fly()
    assert (status.phase, status.waypoint, status.waypoints) == ("SUCCEEDED", 3, 3)
    assert flight.idle
    assert flight.on_ground
    assert flight.drone.position == (0.0, 0.0, 0.0)
    assert flight.started[0] == "takeoff"
    assert set(flight.started[1:3]) == {"lidar_mapping", "zed_depthmap"}, "together, in any order"
    assert flight.started[3:] == ["goto_straight", "goto_straight", "goto_straight", "return_home", "land"]
    assert flight.ends("lidar_mapping") == flight.ends("zed_depthmap") == ["IT"]
    assert flight.ends("goto_straight") == ["S_ARRIVED"] * 3
    assert [status.phase for status in flight.statuses if status.phase != "RUNNING"][-1] == "SUCCEEDED"
    assert flight.statuses[-1].t < LONGEST


def test_the_camera_fails_on_the_second_leg() -> None:
    """Figure 12, with the chain of causes from the resource to the new branch."""
    flight = Flight()
    flight.at(17.0, lambda: flight.drone.set("zed_status", "FAILED"))
    status = flight.fly()
    assert status.phase == "SUCCEEDED"
    assert flight.idle
    assert flight.on_ground
    assert flight.ends("zed_depthmap") == ["RI"]
    assert flight.ends("goto_straight") == ["S_ARRIVED", "IT"]
    assert flight.ends("goto") == ["S_ARRIVED", "S_ARRIVED"]
    assert flight.ends("lock_head") == ["IT", "IT"]
    assert flight.ends("lidar_mapping") == ["IT"]
    assert "NR" not in [label for skill in set(flight.started) for label in flight.ends(skill)]

    switch = next(record for record in flight.records if record.kind is RecordKind.MISSION and record.before == "ZED")
    subjects = [record.subject for record in flight.chain(switch)]
    assert subjects[0] == "navigation"
    assert "zed_depthmap" in subjects
    assert subjects[-1] == "zed_status"
    begun = next(record for record in flight.records if record.subject == "lidar_depthmap")
    assert switch in flight.chain(begun)


def test_the_lidar_fails_on_the_second_leg() -> None:
    """No map can be made any more, and the camera sees the way home."""
    flight = Flight()
    flight.at(17.0, lambda: flight.drone.set("lidar_status", "FAILED"))
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("FAILED", 1)
    assert status.text.startswith("lidar_mapping ended RI: ")
    assert flight.idle
    assert flight.drone.position == (0.0, 0.0, 0.0)
    assert flight.started[-3:] == ["zed_depthmap", "return_home", "land"]
    assert flight.ends("zed_depthmap") == ["IT", "IT"]
    assert "NR" not in [label for skill in set(flight.started) for label in flight.ends(skill)]

    (switch,) = (
        record for record in flight.records if record.kind is RecordKind.MISSION and record.before == "mapping"
    )
    assert switch.after == "coming home by ZED"
    assert [record.subject for record in flight.chain(switch)][-1] == "lidar_status"
    begun = next(record for record in flight.records if record.subject == "return_home")
    assert switch in flight.chain(begun)


@pytest.mark.parametrize(
    ("failures", "phase"),
    [
        ([], "SUCCEEDED"),
        ([(17.0, "zed_status")], "SUCCEEDED"),
        ([(17.0, "lidar_status")], "FAILED"),
        ([(17.0, "lidar_status"), (20.0, "zed_status")], "FAILED"),
    ],
)
def test_the_tree_file_flies_as_the_mission_in_python_does(failures: list[tuple[float, str]], phase: str) -> None:
    flights = [Flight(), Flight(mission=find_mission(str(TREE_FILE)), route=ROUTE)]
    for flight in flights:
        for moment, sensor in failures:
            flight.at(moment, lambda flight=flight, sensor=sensor: flight.drone.set(sensor, "FAILED"))
        assert flight.fly().phase == phase
    by_python, by_file = ([(goal.skill, goal.terminal) for goal in flight.goals.values()] for flight in flights)
    assert by_file == by_python


@given(seed=seeds, moment=moments)
@examples(5)
def test_the_camera_may_fail_at_any_time(seed: int, moment: float) -> None:
    flight = Flight(seed=seed)
    flight.at(moment, lambda: flight.drone.set("zed_status", "FAILED"))
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", len(ROUTE))
    assert flight.idle
    assert flight.on_ground


@given(seed=seeds, moment=st.floats(1.0, LONGEST))
@examples(5)
def test_the_lidar_may_fail_at_any_time_and_the_drone_comes_home(seed: int, moment: float) -> None:
    flight = Flight(seed=seed)
    flight.at(moment, lambda: flight.drone.set("lidar_status", "FAILED"))
    status = flight.fly()
    assert flight.idle
    assert flight.drone.position == (0.0, 0.0, 0.0)
    if status.phase != "SUCCEEDED":
        assert status.waypoint < len(ROUTE)
        assert "lidar" in status.text


@given(seed=seeds, moment=st.floats(1.0, LONGEST), apart=st.floats(0.0, 30.0), camera_first=st.booleans())
@examples(10)
def test_both_sensors_may_fail_at_any_time_and_the_drone_lands(
    seed: int, moment: float, apart: float, camera_first: bool
) -> None:
    flight = Flight(seed=seed)
    first, second = ("zed_status", "lidar_status") if camera_first else ("lidar_status", "zed_status")
    flight.at(max(0.0, moment - apart), lambda: flight.drone.set(first, "FAILED"))
    flight.at(moment, lambda: flight.drone.set(second, "FAILED"))
    status = flight.fly()
    assert flight.idle
    assert flight.on_ground
    if status.phase != "SUCCEEDED":
        assert status.phase == "FAILED"
        assert "lidar" in status.text


@given(seed=seeds, moment=st.floats(1.0, LONGEST))
@examples(5)
def test_the_pilot_may_keep_the_drone_at_any_time_and_nothing_is_commanded_after(seed: int, moment: float) -> None:
    flight = Flight(seed=seed, pilot_patience=20.0)
    started_before: list[int] = []

    def take_over() -> None:
        flight.drone.set("SDK_authority", "UNAVAILABLE")
        flight.observer.after(0.05, lambda: started_before.append(len(flight.started)))

    flight.at(moment, take_over)
    status = flight.fly()
    assert flight.idle
    if not started_before:
        assert status.phase == "SUCCEEDED"
    elif status.phase != "SUCCEEDED":
        assert status.phase == "FAILED"
        assert "SDK_authority is UNAVAILABLE" in status.text
        assert len(flight.started) == started_before[0]


@given(
    seed=seeds,
    moment=st.floats(1.0, LONGEST),
    kept=st.floats(0.01, 15.0),
)
@examples(5)
def test_a_drone_that_the_pilot_gives_back_flies_its_whole_route(seed: int, moment: float, kept: float) -> None:
    flight = Flight(seed=seed)
    flight.at(moment, lambda: flight.drone.set("SDK_authority", "UNAVAILABLE"))
    flight.at(moment + kept, lambda: flight.drone.set("SDK_authority", "AVAILABLE"))
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", len(ROUTE))
    assert flight.idle
    assert flight.drone.position == (0.0, 0.0, 0.0)
    assert len(flight.ends("lidar_mapping")) <= 1, "the map is not started again"


def test_a_hold_is_reported_as_a_phase_with_its_cause() -> None:
    flight = Flight()
    flight.at(17.0, lambda: flight.drone.set("SDK_authority", "UNAVAILABLE"))
    flight.at(25.0, lambda: flight.drone.set("SDK_authority", "AVAILABLE"))
    assert flight.fly().phase == "SUCCEEDED"
    phases = [status.phase for status in flight.statuses]
    assert list(dict.fromkeys(phases)) == ["IDLE", "RUNNING", "HELD", "SUCCEEDED"]
    held = next(record for record in flight.records if record.after == "HELD")
    assert [record.subject for record in flight.chain(held)] == ["mapping", "SDK_authority"]
    again = next(record for record in flight.records if (record.before, record.after) == ("HELD", "RUNNING"))
    resumed = next(record for record in flight.records if record.subject == "goto_straight" and record.t > 25.0)
    assert again in flight.chain(resumed)


@given(seed=seeds, moment=st.floats(1.0, LONGEST))
@examples(5)
def test_the_battery_may_run_low_at_any_time_and_the_drone_lands(seed: int, moment: float) -> None:
    flight = Flight(seed=seed)
    flight.at(moment, lambda: flight.drone.set("battery_status", "CRITICAL"))
    status = flight.fly()
    assert flight.idle
    assert flight.on_ground
    if status.phase != "SUCCEEDED":
        assert "battery_status is CRITICAL" in status.text


@pytest.mark.parametrize("camera", ["OK", "FAILED"])
def test_a_pole_on_the_leg_is_gone_round(camera: str) -> None:
    flight = Flight(poles=((10.0, 0.1), (20.0, 5.0)))
    flight.drone.truth["zed_status"] = camera
    status = flight.fly()
    assert (status.phase, status.text) == ("SUCCEEDED", "3 of 3 waypoints reached")
    motion = "goto_straight" if camera == "OK" else "goto"
    assert flight.ends(motion).count("S_BLOCKED") >= 2
    assert flight.drone.nearest_pole > 1.5
    assert flight.idle


def test_a_waypoint_that_cannot_be_reached_is_left_out_and_said_so() -> None:
    ring = tuple((20.0 + x, 10.0 + y) for x in range(-3, 4) for y in range(-3, 4) if 3 in (abs(x), abs(y)))
    flight = Flight(poles=ring)
    status = flight.fly()
    assert status.phase == "SUCCEEDED"
    assert status.text.startswith("2 of 3 waypoints reached (2 given up")
    assert flight.idle


def test_a_mission_that_reached_no_waypoint_fails_and_says_which_it_gave_up() -> None:
    flight = Flight(poles=((20.0, 0.1),), route=((20.0, 0.0, 4.0),))
    status = flight.fly()
    assert status.phase == "FAILED"
    assert status.text.startswith("0 of 1 waypoints reached (1 given up: ")
    assert flight.drone.position == (0.0, 0.0, 0.0), "it came home all the same"
    assert flight.started[-2:] == ["return_home", "land"]
    assert flight.idle


@pytest.mark.parametrize("victim", ["goto_straight", "zed_depthmap"])
def test_a_manager_that_dies_costs_the_branch_and_not_the_mission(victim: str) -> None:
    flight = Flight()
    flight.at(10.0, flight.buses[f"skill/{victim}"].close)
    status = flight.fly()
    assert status.phase == "SUCCEEDED"
    assert flight.ends("lidar_depthmap") == ["IT"], "asked for once, when the lost goal's resources were free"
    assert flight.on_ground


def test_the_same_seed_flies_the_same_mission() -> None:
    def story(seed: int) -> list[tuple[float, str, str]]:
        flight = Flight(seed=seed)
        flight.at(20.0, lambda: flight.drone.set("zed_status", "FAILED"))
        flight.fly()
        return [(record.t, record.subject, record.after) for record in flight.records]

    assert story(7) == story(7)
