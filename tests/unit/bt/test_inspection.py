"""The inspection tree, tick by tick, on an interface that the test plays."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_interface import FakeGoal, FakeMission
from py_trees.common import Status

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.preflight import preflight
from skillwing.bt_missions.missions.inspection import MISSION, InspectionOptions
from skillwing.bt_missions.subtrees.pausing import Pausable
from skillwing.dsl import load
from skillwing.dsl.model import Skillset

COMPANIONS = ["stream", "lidar_depthmap"]


@pytest.fixture(scope="module")
def m600() -> Skillset:
    root = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
    return load(root / "services/skillwing/m600/m600.skillset")


class Flight(FakeMission):
    """An inspection whose robot does what the test says."""

    def __init__(self, skillset: Skillset) -> None:
        super().__init__(skillset)
        self.interface.states |= {"SDK_authority": "AVAILABLE", "homepoint_status": "VALID"}
        self.interface.states |= {"lidar_status": "OK", "zed_status": "OK"}
        self.trees = MISSION.build(self.context, InspectionOptions(laps=2.0))
        self.interface.know("position", {"x": 0.0, "y": 0.0, "z": 12.0})

    @property
    def pausable(self) -> Pausable:
        return next(node for node in self.trees.root.iterate() if isinstance(node, Pausable))

    def tick(self, later: float = 0.0) -> Status:
        self.time += later
        self.trees.root.tick_once()
        return self.trees.root.status

    def alive(self) -> list[str]:
        return [goal.skill for goal in self.goals if not goal.done]

    def goal(self, skill: str) -> FakeGoal:
        return next(goal for goal in reversed(self.goals) if goal.skill == skill and not goal.done)

    def stop(self) -> None:
        """End all goals that were interrupted."""
        for goal in self.goals:
            if not goal.done and goal.interrupts:
                goal.end("IT")

    def lose(self, sensor: str, depth_map: str, label: str = "RI") -> None:
        self.interface.states |= {sensor: "FAILED", "depthmap_source": "NONE"}
        self.goal(depth_map).end(label, subject=sensor)

    def come_to_rest(self) -> None:
        """Let the tree react, end the goals that it has interrupted, and let the drone settle."""
        self.tick()
        self.stop()
        self.tick()
        self.tick()

    def see(self, source: str) -> None:
        """Set the source of the depth map, and let all started goals run."""
        self.interface.states["depthmap_source"] = source
        self.tick()
        for goal in self.goals:
            if not goal.done:
                goal.run()

    def take_off(self) -> None:
        self.tick()
        self.goal("takeoff").end("S_AT_ALTITUDE", success=True)
        self.interface.states["flight_status"] = "IN_AIR"
        self.tick()

    def land_at_home(self) -> Status:
        """End `return_home` and the landing. Returns the status of the mission."""
        self.goal("return_home").end("S_ARRIVED", success=True)
        self.come_to_rest()
        return self.land()

    def land(self) -> Status:
        self.goal("land").end("S_LANDED", success=True)
        self.interface.states["flight_status"] = "ON_GROUND"
        return self.tick()


@pytest.fixture
def flight(m600: Skillset) -> Flight:
    """A flight on its first lap."""
    flight = Flight(m600)
    flight.take_off()
    flight.interface.states["depthmap_source"] = "LIDAR"
    flight.tick()
    for goal in flight.goals:
        goal.run()
    assert flight.alive() == [*COMPANIONS, "inspect"]
    return flight


def test_the_mission_fits_the_m600(flight: Flight, m600: Skillset) -> None:
    assert preflight(MISSION, flight.trees, offline_context(m600)) == []


def test_the_nominal_mission(flight: Flight) -> None:
    assert flight.goal("inspect").inputs["laps"] == 2.0
    flight.goal("inspect").end("S_COMPLETED", success=True)
    flight.tick()
    assert flight.alive() == [*COMPANIONS, "return_home"], "there is video all the way home"
    flight.goal("return_home").end("S_ARRIVED", success=True)
    flight.tick()
    flight.stop()
    flight.tick()
    assert flight.land() is Status.SUCCESS
    assert flight.journal == []


def test_nothing_moves_before_the_lidar_looks_along(m600: Skillset) -> None:
    flight = Flight(m600)
    flight.tick()
    flight.goal("takeoff").end("S_AT_ALTITUDE", success=True)
    flight.interface.states["flight_status"] = "IN_AIR"
    flight.tick()
    assert flight.tick(later=1.0) is Status.RUNNING
    assert flight.alive() == COMPANIONS


@pytest.mark.parametrize("label", ["S_FPS_LOST", "LOST", "NR", "ERROR"])
@pytest.mark.parametrize("going", ["inspect", "return_home"])
def test_without_video_the_drone_hovers_and_lands_where_it_is(flight: Flight, going: str, label: str) -> None:
    if going == "return_home":
        flight.goal("inspect").end("S_COMPLETED", success=True)
        flight.tick()
    motion, stream = flight.goal(going), flight.goal("stream")
    stream.end(label)
    flight.tick()
    assert (motion.interrupts, motion.interrupt_cause) == (1, stream.record)
    assert "hover" not in flight.alive(), "the drone has not stopped yet"
    flight.stop()
    flight.tick()
    assert flight.goal("hover").inputs == {"duration": 4.0}
    flight.goal("hover").end("S_DONE", success=True)
    flight.tick()
    assert flight.alive() == ["land"]
    assert flight.land() is Status.FAILURE, "the inspection was not flown to its end"
    assert [step[:3] for step in flight.journal] == [("inspection", "flying with video", "landing where it is")]
    assert flight.context.failure is not None
    assert f"stream ended {label}" in flight.context.failure.text


@pytest.mark.parametrize("label", ["S_BLOCKED", "S_ABORTED", "LOST"])
def test_a_lap_that_cannot_be_flown_brings_the_drone_home_with_video(flight: Flight, label: str) -> None:
    flight.goal("inspect").end(label)
    flight.tick()
    assert flight.alive() == [*COMPANIONS, "return_home"]
    flight.goal("return_home").end("S_ARRIVED", success=True)
    flight.tick()
    flight.stop()
    flight.tick()
    assert flight.land() is Status.FAILURE
    assert [step[2] for step in flight.journal] == ["coming home early"]


def test_a_low_battery_brings_the_drone_home_and_an_empty_one_lands_it(flight: Flight) -> None:
    flight.interface.states["battery_status"] = "LOW"
    flight.tick()
    flight.stop()
    flight.tick()
    assert flight.alive() == [*COMPANIONS, "return_home"]
    flight.interface.states["battery_status"] = "CRITICAL"
    flight.tick()
    flight.stop()
    flight.tick()
    flight.tick()
    assert flight.alive() == ["land"]


def test_a_pause_keeps_the_video_and_what_was_flown(flight: Flight) -> None:
    first = flight.goal("inspect")
    first.progress = {"laps_done": 0.75}
    assert flight.pausable.pause("for a test") is None
    flight.tick()
    flight.stop()
    flight.tick()
    assert flight.alive() == [*COMPANIONS, "hover"]
    flight.pausable.resume()
    flight.tick()
    flight.stop()
    flight.tick()
    second = flight.goal("inspect")
    assert second.inputs == {**first.inputs, "laps": 1.25}

    second.progress = {"laps_done": 1.24}
    second.end("RI", invariant="authority", subject="SDK_authority")
    flight.tick()
    flight.tick()
    assert flight.goal("inspect").inputs["laps"] == 0.1, "the least that the skill flies"


def test_video_that_is_lost_during_a_pause_ends_it(flight: Flight) -> None:
    flight.pausable.pause("for a test")
    flight.tick()
    flight.stop()
    flight.tick()
    holding = flight.goal("hover")
    flight.goal("stream").end("S_FPS_LOST")
    flight.tick()
    assert holding.interrupts == 1
    flight.stop()
    flight.tick()
    assert flight.goal("hover").inputs == {"duration": 4.0}
    assert flight.pausable.pause("again") is not None
    flight.goal("hover").end("S_DONE", success=True)
    flight.tick()
    assert flight.alive() == ["land"]


def test_video_that_is_lost_while_the_pilot_flies_leaves_the_drone_to_him(flight: Flight) -> None:
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    flight.stop()
    flight.goal("stream").end("S_FPS_LOST")
    flight.tick()
    flight.stop()
    for _ in range(5):
        assert flight.tick(later=10.0) is Status.RUNNING
    assert flight.alive() == []
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    flight.tick()
    flight.tick()
    assert flight.alive() == ["hover"]


def assert_hovers_and_lands(flight: Flight) -> None:
    flight.stop()
    assert flight.alive() == ["hover"]
    assert flight.goal("hover").inputs == {"duration": 4.0}
    flight.goal("hover").end("S_DONE", success=True)
    flight.tick()
    assert flight.alive() == ["land"]
    assert flight.land() is Status.FAILURE
    assert [*flight.journal[-1][:3]] == ["inspection", "flying with video", "landing where it is"]


@pytest.mark.parametrize("label", ["RI", "S_NO_DATA", "LOST"])
@pytest.mark.parametrize("going", ["inspect", "return_home"])
def test_without_the_lidar_the_drone_comes_home_by_the_camera_with_video(
    flight: Flight, going: str, label: str
) -> None:
    if going == "return_home":
        flight.goal("inspect").end("S_COMPLETED", success=True)
        flight.tick()
    motion, stream, depth_map = flight.goal(going), flight.goal("stream"), flight.goal("lidar_depthmap")
    flight.lose("lidar_status", "lidar_depthmap", label)
    flight.tick()
    assert (motion.interrupts, motion.interrupt_cause) == (1, depth_map.record)
    flight.stop()
    flight.tick()
    assert flight.alive() == ["stream", "zed_depthmap"], "nothing looks ahead yet"
    flight.see("ZED")
    assert flight.alive() == ["stream", "zed_depthmap", "return_home"]
    assert flight.land_at_home() is Status.FAILURE, "it did not go as planned"
    assert stream.interrupts == 1, "there was video until it was home"
    ((*step, reason, _),) = flight.journal
    assert step == ["inspection", "inspecting", "coming home by ZED"]
    assert reason == f"lidar_depthmap ended {label}: {label} for the test"
    assert flight.context.failure is not None
    assert flight.context.failure.text == f"inspecting -> coming home by ZED, for {reason}"


def test_a_lidar_that_never_looks_along_leaves_it_to_the_camera(m600: Skillset) -> None:
    flight = Flight(m600)
    flight.take_off()
    flight.tick(later=5.0)
    flight.come_to_rest()
    assert flight.alive() == ["stream", "zed_depthmap"]


def test_a_way_home_that_fails_is_tried_with_each_sensor_once_more(flight: Flight) -> None:
    flight.goal("inspect").end("S_COMPLETED", success=True)
    flight.tick()
    for skill, source in (("zed_depthmap", "ZED"), ("lidar_depthmap", "LIDAR")):
        flight.goal("return_home").end("S_ABORTED")
        flight.come_to_rest()
        flight.interface.states["depthmap_source"] = source
        flight.tick()
        assert flight.alive() == ["stream", skill, "return_home"]
    flight.goal("return_home").end("S_ABORTED")
    flight.come_to_rest()
    assert_hovers_and_lands(flight)


@pytest.fixture
def coming_home(flight: Flight) -> Flight:
    """A flight that has lost its LiDAR and flies home by the camera."""
    flight.lose("lidar_status", "lidar_depthmap")
    flight.come_to_rest()
    flight.see("ZED")
    assert flight.alive() == ["stream", "zed_depthmap", "return_home"]
    return flight


def test_video_that_is_lost_while_it_comes_home_by_the_camera_lands_the_drone(coming_home: Flight) -> None:
    coming_home.goal("stream").end("S_FPS_LOST")
    coming_home.come_to_rest()
    assert_hovers_and_lands(coming_home)


def test_video_that_is_lost_while_the_drone_stops_for_want_of_the_lidar_lands_it(flight: Flight) -> None:
    flight.lose("lidar_status", "lidar_depthmap")
    flight.tick()
    flight.goal("stream").end("S_FPS_LOST")
    flight.come_to_rest()
    assert "zed_depthmap" not in [goal.skill for goal in flight.goals]
    assert_hovers_and_lands(flight)


def test_a_camera_that_is_lost_on_the_way_home_lands_the_drone(coming_home: Flight) -> None:
    coming_home.lose("zed_status", "zed_depthmap")
    coming_home.come_to_rest()
    assert_hovers_and_lands(coming_home)


def test_a_camera_that_is_lost_on_the_way_home_leaves_it_to_a_lidar_that_is_well_again(coming_home: Flight) -> None:
    coming_home.interface.states["lidar_status"] = "OK"
    coming_home.lose("zed_status", "zed_depthmap")
    coming_home.come_to_rest()
    coming_home.see("LIDAR")
    assert coming_home.alive() == ["stream", "lidar_depthmap", "return_home"]


@pytest.mark.parametrize("label", ["RI", "S_NO_DATA", "LOST"])
def test_a_lidar_that_leads_home_and_is_lost_again_leaves_it_to_a_camera_that_is_well_again(
    coming_home: Flight, label: str
) -> None:
    coming_home.interface.states["lidar_status"] = "OK"
    coming_home.lose("zed_status", "zed_depthmap")
    coming_home.come_to_rest()
    coming_home.see("LIDAR")
    coming_home.interface.states["zed_status"] = "OK"
    coming_home.lose("lidar_status", "lidar_depthmap", label)
    coming_home.come_to_rest()
    coming_home.see("ZED")
    assert coming_home.alive() == ["stream", "zed_depthmap", "return_home"]


def test_sensors_that_are_lost_together_land_the_drone(flight: Flight) -> None:
    """The report of the camera's failure may come a moment after that of the LiDAR's."""
    flight.lose("lidar_status", "lidar_depthmap")
    flight.tick()
    flight.interface.states["zed_status"] = "FAILED"
    flight.come_to_rest()
    assert_hovers_and_lands(flight)


def test_a_battery_that_empties_while_it_comes_home_by_the_camera_lands_the_drone(coming_home: Flight) -> None:
    coming_home.interface.states["battery_status"] = "CRITICAL"
    coming_home.come_to_rest()
    assert coming_home.alive() == ["land"]


def test_a_pause_while_it_comes_home_by_the_camera_keeps_video_and_depth_map(coming_home: Flight) -> None:
    assert coming_home.pausable.pause("for a test") is None
    coming_home.tick()
    coming_home.stop()
    coming_home.tick()
    assert coming_home.alive() == ["stream", "zed_depthmap", "hover"]
    coming_home.pausable.resume()
    coming_home.come_to_rest()
    assert coming_home.alive() == ["stream", "zed_depthmap", "return_home"]
