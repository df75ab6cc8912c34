"""The mapping tree, tick by tick, on an interface that the test plays."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from fake_interface import FakeGoal, FakeMission
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.preflight import preflight
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.missions.mapping import MISSION, MappingMissionOptions
from skillwing.bt_missions.subtrees.pausing import Pausable
from skillwing.dsl import load
from skillwing.dsl.model import Skillset, UnknownNameError
from skillwing.services.errors import InvalidOptionError

ROUTE = ((20.0, 0.0, 4.0), (20.0, 10.0, 4.0))


@pytest.fixture(scope="module")
def m600() -> Skillset:
    root = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
    return load(root / "services/skillwing/m600/m600.skillset")


class Flight(FakeMission):
    """A mapping mission whose robot does what the test says."""

    def __init__(self, skillset: Skillset) -> None:
        super().__init__(skillset)
        self.interface.states |= {
            "SDK_authority": "AVAILABLE",
            "homepoint_status": "VALID",
            "zed_status": "OK",
            "lidar_status": "OK",
        }
        self.trees = MISSION.build(self.context, MappingMissionOptions(route=ROUTE))
        self.be_at(0.0, 0.0, 4.0)
        self.interface.know("heading", 0.0)

    def be_at(self, x: float, y: float, z: float) -> None:
        self.interface.know("position", {"x": x, "y": y, "z": z})

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

    def start_mapping(self) -> None:
        """Run the tree up to the first leg of the ZED branch."""
        self.tick()
        self.goal("takeoff").end("S_AT_ALTITUDE", success=True)
        self.interface.states["flight_status"] = "IN_AIR"
        self.tick()
        assert self.alive() == ["lidar_mapping", "zed_depthmap"]
        for goal in self.goals:
            goal.run()
        self.interface.states["depthmap_source"] = "ZED"
        self.tick()

    def start_crabwise(self) -> None:
        """Run the tree up to the first turn of the LiDAR branch, after the loss of the camera."""
        self.start_mapping()
        self.lose_camera()
        self.come_to_rest()
        self.goal("lidar_depthmap").run()
        self.interface.states["depthmap_source"] = "LIDAR"
        self.tick()
        assert self.alive() == ["lidar_mapping", "lidar_depthmap", "rotate_head"]

    def lose_camera(self) -> None:
        self.interface.states |= {"zed_status": "FAILED", "depthmap_source": "NONE"}
        self._violate("zed_status", "zed_ok", "zed_depthmap")

    def lose_lidar(self) -> None:
        self.interface.states |= {"lidar_status": "FAILED", "slam_status": "IDLE"}
        self._violate("lidar_status", "lidar_ok", "lidar_mapping", "lidar_depthmap")

    def _violate(self, resource: str, invariant: str, *skills: str) -> None:
        for goal in self.goals:
            if goal.skill in skills and not goal.done:
                goal.end("RI", invariant=invariant, subject=resource)

    def fly_route(self) -> None:
        """Fly the route by the camera, up to the way home."""
        for x, y, z in ROUTE:
            self.be_at(x, y, z)
            self.goal("goto_straight").end("S_ARRIVED", success=True)
            self.tick()
            self.tick()

    def come_to_rest(self) -> None:
        """Let the tree react, end the goals that it has interrupted, and let the drone settle."""
        self.tick()
        for goal in self.goals:
            if goal.interrupts and not goal.done:
                goal.end("IT")
        if not {"zed_depthmap", "lidar_depthmap"}.intersection(self.alive()):
            self.interface.states["depthmap_source"] = "NONE"
        self.tick()
        for _ in range(2):  # a way home that cannot begin and the landing instead, each waits for itself
            self.tick(later=1.0)

    def rest_and_look(self, source: str) -> None:
        """Let the drone come to rest, and then set another source of the depth map."""
        self.come_to_rest()
        self.interface.states["depthmap_source"] = source
        self.tick()

    def land_at_home(self) -> Status:
        """End `return_home` and the landing. Returns the status of the mission."""
        self.goal("return_home").end("S_ARRIVED", success=True)
        self.come_to_rest()
        self.goal("land").end("S_LANDED", success=True)
        return self.tick()


@pytest.fixture
def flight(m600: Skillset) -> Flight:
    return Flight(m600)


def test_the_mission_fits_the_m600(flight: Flight, m600: Skillset) -> None:
    assert preflight(MISSION, flight.trees, offline_context(m600)) == []


def test_the_nominal_mission(flight: Flight) -> None:
    flight.start_mapping()
    for x, y, z in ROUTE:
        assert flight.goal("goto_straight").inputs["target"] == {"x": x, "y": y, "z": z}
        flight.be_at(x, y, z)
        flight.goal("goto_straight").end("S_ARRIVED", success=True)
        flight.tick()
        flight.tick()
    assert flight.alive() == ["lidar_mapping", "zed_depthmap", "return_home"], "the depth map watches the way home"
    assert [flight.goal(skill).interrupts for skill in ("lidar_mapping", "zed_depthmap")] == [0, 0]
    flight.goal("return_home").end("S_ARRIVED", success=True)
    flight.tick()
    assert [flight.goal(skill).interrupts for skill in ("lidar_mapping", "zed_depthmap")] == [1, 1]
    flight.goal("lidar_mapping").end("IT")
    flight.goal("zed_depthmap").end("IT")
    flight.tick()
    flight.goal("land").end("S_LANDED", success=True)
    assert flight.tick() is Status.SUCCESS
    assert flight.journal == []
    assert flight.trees.progress().waypoint == 2


def test_the_drone_does_not_move_before_something_looks_ahead(flight: Flight) -> None:
    flight.start_mapping()
    assert flight.alive()[-1] == "goto_straight"
    another = Flight(flight.interface.skillset)
    another.tick()
    another.goal("takeoff").end("S_AT_ALTITUDE", success=True)
    another.interface.states["flight_status"] = "IN_AIR"
    another.tick()
    another.tick()
    assert "goto_straight" not in another.alive()


def test_the_switch_of_figure_12(flight: Flight) -> None:
    flight.start_mapping()
    x, y, z = ROUTE[0]
    flight.be_at(x, y, z)
    flight.goal("goto_straight").end("S_ARRIVED", success=True)
    flight.tick()
    flight.tick()
    leg, zed = flight.goal("goto_straight"), flight.goal("zed_depthmap")

    flight.lose_camera()
    flight.tick()
    assert (leg.interrupts, leg.interrupt_cause) == (1, zed.record)
    assert flight.journal == [("navigation", "ZED", "LiDAR", "zed_depthmap ended RI: RI for the test", zed.record)]
    assert flight.goal("lidar_depthmap").cause == "mission#1"
    assert flight.goal("lidar_mapping").interrupts == 0

    flight.goal("lidar_depthmap").run()
    flight.interface.states["depthmap_source"] = "LIDAR"
    flight.tick()
    assert "rotate_head" not in flight.alive(), "the drone still flies nose first"
    leg.end("IT")
    flight.tick()
    turn = flight.goal("rotate_head")
    assert abs(math.cos(turn.inputs["heading"] - math.pi / 2)) < 1e-9, "the second leg goes north"
    turn.end("S_ALIGNED", success=True)
    flight.tick()
    assert flight.goal("lock_head").inputs == turn.inputs
    assert flight.goal("goto").inputs["target"] == {"x": 20.0, "y": 10.0, "z": 4.0}, "waypoint 1 stays done"

    flight.goal("goto").end("S_ARRIVED", success=True)
    flight.tick()
    flight.tick()
    assert flight.goal("lock_head").interrupts == 1
    assert "return_home" not in flight.alive(), "lock_head still holds the heading"
    flight.goal("lock_head").end("IT")
    flight.tick()
    assert flight.alive() == ["lidar_mapping", "lidar_depthmap", "return_home"]


def test_a_camera_that_fails_on_the_way_home_leaves_it_to_the_lidar(flight: Flight) -> None:
    flight.start_mapping()
    flight.fly_route()
    by_camera = flight.goal("return_home")
    flight.lose_camera()
    flight.tick()
    assert by_camera.interrupts == 1
    by_camera.end("IT")
    flight.goal("lidar_depthmap").run()
    flight.interface.states["depthmap_source"] = "LIDAR"
    flight.tick()
    assert flight.alive() == ["lidar_mapping", "lidar_depthmap", "return_home"]


def test_a_camera_that_recovers_is_not_flown_with_again(flight: Flight) -> None:
    flight.start_mapping()
    flight.lose_camera()
    flight.tick()
    flight.interface.states["zed_status"] = "OK"
    flight.tick()
    assert "zed_depthmap" not in flight.alive()


def test_a_camera_that_is_broken_from_the_start_is_not_tried(flight: Flight) -> None:
    flight.interface.states["zed_status"] = "FAILED"
    flight.tick()
    flight.goal("takeoff").end("S_AT_ALTITUDE", success=True)
    flight.interface.states["flight_status"] = "IN_AIR"
    flight.tick()
    assert flight.alive() == ["lidar_mapping", "lidar_depthmap"]


def test_a_blocked_leg_is_followed_by_a_detour(flight: Flight) -> None:
    flight.start_mapping()
    flight.be_at(8.0, 0.0, 4.0)
    stopped = {"x": 8.0, "y": 0.0, "z": 4.0}
    flight.goal("goto_straight").end("S_BLOCKED", output={"stopped_at": stopped, "obstacle_distance": 2.0})
    flight.tick()
    flight.tick()
    assert abs(flight.goal("goto_straight").inputs["target"]["y"]) > 2.0
    assert flight.goal("zed_depthmap").interrupts == 0


@pytest.mark.parametrize("label", ["S_DIVERGED", "RI", "LOST"])
def test_without_a_map_to_be_made_the_drone_comes_home_by_the_camera(flight: Flight, label: str) -> None:
    flight.start_mapping()
    flight.goal("lidar_mapping").end(label)
    assert flight.tick() is Status.RUNNING
    assert [flight.goal(skill).interrupts for skill in ("zed_depthmap", "goto_straight")] == [1, 1]
    flight.come_to_rest()
    assert flight.alive() == ["zed_depthmap"], "nothing looks ahead yet"
    flight.interface.states["depthmap_source"] = "ZED"
    flight.tick()
    assert flight.alive() == ["zed_depthmap", "return_home"]
    assert flight.land_at_home() is Status.FAILURE, "the route was not flown"
    ((*step, reason, _),) = flight.journal
    assert step == ["mission", "mapping", "coming home by ZED"]
    assert reason == f"lidar_mapping ended {label}: {label} for the test"


def test_a_map_that_is_lost_on_the_way_home_was_made_all_the_same(flight: Flight) -> None:
    flight.start_mapping()
    flight.fly_route()
    flight.lose_lidar()
    flight.come_to_rest()
    flight.interface.states["depthmap_source"] = "ZED"
    flight.tick()
    assert flight.alive() == ["zed_depthmap", "return_home"]
    assert flight.land_at_home() is Status.SUCCESS


def test_a_lidar_that_is_lost_as_well_lands_the_drone_where_it_is(flight: Flight) -> None:
    flight.start_crabwise()
    flight.lose_lidar()
    flight.come_to_rest()
    assert flight.alive() == ["land"]
    flight.goal("land").end("S_LANDED", success=True)
    assert flight.tick() is Status.FAILURE
    subject, *step, reason, _ = flight.journal[-1]
    assert [subject, *step] == ["mission", "flight", "landing where it is"]
    assert reason == "lidar_depthmap ended RI: RI for the test", "and not which sensors were asked for since"


def test_sensors_that_are_lost_together_land_the_drone_where_it_is(flight: Flight) -> None:
    """The report of the camera's failure may come a moment after that of the LiDAR's."""
    flight.start_mapping()
    flight.lose_lidar()
    flight.tick()
    flight.lose_camera()
    flight.come_to_rest()
    assert flight.alive() == ["land"]


def test_a_camera_that_is_well_again_leads_home_where_the_lidar_is_lost(flight: Flight) -> None:
    flight.start_crabwise()
    flight.interface.states["zed_status"] = "OK"
    flight.lose_lidar()
    flight.come_to_rest()
    flight.interface.states["depthmap_source"] = "ZED"
    flight.tick()
    assert flight.alive() == ["zed_depthmap", "return_home"]


@pytest.fixture
def coming_home(flight: Flight) -> Flight:
    """A flight that has lost its LiDAR and flies home by the camera."""
    flight.start_mapping()
    flight.lose_lidar()
    flight.come_to_rest()
    flight.goal("zed_depthmap").run()
    flight.interface.states["depthmap_source"] = "ZED"
    flight.tick()
    flight.goal("return_home").run()
    return flight


def test_a_camera_that_is_lost_on_the_way_home_lands_the_drone_where_it_is(coming_home: Flight) -> None:
    coming_home.lose_camera()
    coming_home.come_to_rest()
    assert coming_home.alive() == ["land"]
    assert [step[2] for step in coming_home.journal] == ["coming home by ZED", "landing where it is"]
    assert coming_home.journal[-1][3] == "zed_depthmap ended RI: RI for the test"


def test_a_camera_that_is_lost_on_the_way_home_leaves_it_to_a_lidar_that_is_well_again(coming_home: Flight) -> None:
    coming_home.interface.states["lidar_status"] = "OK"
    coming_home.lose_camera()
    coming_home.rest_and_look("LIDAR")
    assert coming_home.alive() == ["lidar_depthmap", "return_home"]


def test_a_camera_that_is_well_again_leads_home_once_more_where_the_lidar_is_lost_on_the_way(flight: Flight) -> None:
    flight.start_crabwise()
    flight.goal("lidar_mapping").end("S_DIVERGED")
    flight.rest_and_look("LIDAR")
    assert flight.alive() == ["lidar_depthmap", "return_home"]
    flight.interface.states["zed_status"] = "OK"
    flight.lose_lidar()
    flight.rest_and_look("ZED")
    assert flight.alive() == ["zed_depthmap", "return_home"]
    flight.interface.states["lidar_status"] = "OK"
    flight.lose_camera()
    flight.come_to_rest()
    assert flight.alive() == ["land"], "sensors that come and go do not keep it in the air"
    ways = ["coming home by LiDAR", "coming home by ZED", "landing where it is"]
    assert [step[2] for step in flight.journal][-3:] == ways


def test_a_way_home_that_fails_lands_the_drone_where_it_is(coming_home: Flight) -> None:
    coming_home.goal("return_home").end("S_ABORTED")
    coming_home.come_to_rest()
    assert coming_home.alive() == ["land"]


def test_a_battery_that_empties_while_the_drone_comes_home_without_a_map_lands_it(coming_home: Flight) -> None:
    coming_home.interface.states["battery_status"] = "CRITICAL"
    coming_home.come_to_rest()
    assert coming_home.alive() == ["land"]


def test_the_time_limit_holds_for_a_drone_that_comes_home_without_a_map(coming_home: Flight) -> None:
    coming_home.tick(later=901.0)
    coming_home.come_to_rest()
    assert coming_home.alive() == ["land"]


def test_a_takeoff_that_fails_on_the_ground_commands_no_landing(flight: Flight) -> None:
    flight.tick()
    flight.goal("takeoff").end("S_BLOCKED")
    assert flight.tick() is Status.FAILURE
    assert [goal.skill for goal in flight.goals] == ["takeoff"]


def test_a_low_battery_sends_the_drone_home(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["battery_status"] = "LOW"
    flight.tick()
    leg = flight.goal("goto_straight")
    assert leg.interrupts == 1
    leg.end("IT")
    flight.tick()
    assert [flight.goal(skill).interrupts for skill in ("lidar_mapping", "zed_depthmap")] == [0, 0], (
        "they watch the way"
    )
    flight.goal("return_home").end("S_ARRIVED", success=True)
    flight.tick()
    for skill in ("lidar_mapping", "zed_depthmap"):
        flight.goal(skill).end("IT")
    flight.tick()
    flight.goal("land").end("S_LANDED", success=True)
    assert flight.tick() is Status.FAILURE, "the route was not flown"
    assert [(step[1], step[2]) for step in flight.journal] == [("mapping", "coming home early")]


def test_a_battery_that_empties_on_the_way_home_lands_the_drone(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["battery_status"] = "LOW"
    flight.tick()
    flight.goal("goto_straight").end("IT")
    flight.tick()
    flight.interface.states["battery_status"] = "CRITICAL"
    flight.tick()
    assert flight.goal("return_home").interrupts == 1
    for goal in flight.goals:
        if not goal.done:
            goal.end("IT")
    flight.tick(later=1.0)
    assert flight.alive() == ["land"]


def test_an_empty_battery_ends_the_flight_on_the_spot(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["battery_status"] = "CRITICAL"
    flight.tick()
    assert all(goal.interrupts == 1 for goal in flight.goals if not goal.done)
    for goal in flight.goals:
        if not goal.done:
            goal.end("IT")
    flight.tick(later=1.0)
    assert flight.alive() == ["land"]


def test_while_the_pilot_has_the_drone_no_motion_is_commanded(flight: Flight) -> None:
    flight.start_mapping()
    leg = flight.goal("goto_straight")
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    assert flight.tick() is Status.RUNNING
    assert leg.interrupts == 1
    leg.end("IT")
    for _ in range(100):
        flight.tick(later=1.0)
    assert flight.alive() == ["lidar_mapping", "zed_depthmap"], "they move nothing and watch on"


def test_a_pilot_who_keeps_the_drone_ends_the_mission(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    assert flight.tick(later=120.0) is Status.RUNNING
    assert flight.tick(later=0.1) is Status.FAILURE
    assert all(goal.interrupts == 1 for goal in flight.goals if not goal.done)
    assert "land" not in [goal.skill for goal in flight.goals]
    assert flight.trees.root.feedback_message.startswith("SDK_authority is UNAVAILABLE for more than 120 s")


def test_a_drone_that_is_given_back_flies_on_to_the_same_waypoint_from_where_it_is(flight: Flight) -> None:
    flight.start_mapping()
    flight.be_at(10.0, 0.0, 4.0)
    stopped = {"x": 10.0, "y": 0.0, "z": 4.0}
    flight.goal("goto_straight").end("S_BLOCKED", output={"stopped_at": stopped, "obstacle_distance": 2.0})
    flight.tick()
    flight.tick()
    detour = flight.goal("goto_straight")
    assert detour.inputs["target"] != dict(zip("xyz", ROUTE[0], strict=True))

    detour.end("RI", invariant="authority", subject="SDK_authority")
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    flight.be_at(20.0, -12.0, 4.0)
    flight.tick(later=30.0)
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    for _ in range(3):
        flight.tick()
    assert flight.goal("goto_straight").inputs["target"] == dict(zip("xyz", ROUTE[0], strict=True)), "no detour is left"
    assert [goal.skill for goal in flight.goals].count("takeoff") == 1
    assert flight.trees.progress().waypoint == 0


def test_a_drone_that_the_pilot_lands_stays_on_the_ground(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    flight.goal("goto_straight").end("IT")
    flight.interface.states["flight_status"] = "ON_GROUND"
    assert flight.tick(later=5.0) is Status.FAILURE
    assert flight.trees.root.feedback_message == "SDK_authority is UNAVAILABLE and flight_status became ON_GROUND"


def test_a_pilot_who_takes_the_drone_before_it_flies_keeps_it_on_the_ground_for_a_while(flight: Flight) -> None:
    flight.tick()
    flight.goal("takeoff").end("RI", invariant="authority", subject="SDK_authority")
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    assert flight.tick() is Status.RUNNING
    flight.tick(later=20.0)
    assert flight.alive() == []
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    flight.tick(later=1.0)
    assert flight.alive() == ["takeoff"]


def test_a_take_off_that_was_held_in_the_air_goes_on_as_a_climb(flight: Flight) -> None:
    flight.tick()
    flight.goal("takeoff").end("RI", invariant="authority", subject="SDK_authority")
    flight.interface.states |= {"SDK_authority": "UNAVAILABLE", "flight_status": "IN_AIR"}
    flight.tick()
    flight.be_at(1.0, 2.0, 1.5)
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    flight.tick(later=1.0)
    flight.goal("takeoff").end("NR", failing=("on_ground",))
    flight.tick()
    assert flight.goal("goto").inputs["target"] == {"x": 1.0, "y": 2.0, "z": 4.0}
    flight.goal("goto").end("S_ARRIVED", success=True)
    flight.tick()
    assert flight.alive() == ["lidar_mapping", "zed_depthmap"]


def test_a_nose_that_was_held_on_its_way_round_turns_for_a_new_leg(flight: Flight) -> None:
    flight.interface.states["zed_status"] = "FAILED"
    flight.tick()
    flight.goal("takeoff").end("S_AT_ALTITUDE", success=True)
    flight.interface.states["flight_status"] = "IN_AIR"
    flight.tick()
    flight.goal("lidar_depthmap").run()
    flight.interface.states["depthmap_source"] = "LIDAR"
    flight.tick()
    turn = flight.goal("rotate_head")
    assert abs(math.cos(turn.inputs["heading"])) < 1e-9, "the first leg goes east"
    turn.end("RI", invariant="authority", subject="SDK_authority")
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    flight.be_at(20.0, -12.0, 4.0)
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    for _ in range(3):
        flight.tick()
    assert abs(math.sin(flight.goal("rotate_head").inputs["heading"])) < 1e-9, "from here it goes north"


def test_a_camera_that_fails_while_the_pilot_flies_leaves_it_to_the_lidar(flight: Flight) -> None:
    flight.start_mapping()
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.tick()
    flight.goal("goto_straight").end("IT")
    flight.lose_camera()
    flight.tick(later=1.0)
    assert flight.alive() == ["lidar_mapping", "lidar_depthmap"]
    flight.interface.states |= {"SDK_authority": "AVAILABLE", "depthmap_source": "LIDAR"}
    for _ in range(3):
        flight.tick()
    assert flight.alive()[-1] == "rotate_head"


# --- pause and resume ------------------------------------------------------------------------------------------------


@pytest.fixture
def paused(flight: Flight) -> Flight:
    """A flight that was paused on its first leg."""
    flight.start_mapping()
    assert flight.pausable.pause("for a test") is None
    flight.tick()
    flight.goal("goto_straight").end("IT")
    flight.tick()
    return flight


def test_a_paused_drone_hovers_and_flies_on_when_resumed(paused: Flight) -> None:
    assert paused.alive() == ["lidar_mapping", "zed_depthmap", "hover"]
    for _ in range(50):
        paused.tick(later=10.0)
    assert paused.alive() == ["lidar_mapping", "zed_depthmap", "hover"]
    hover = paused.goal("hover")
    paused.pausable.resume()
    paused.tick()
    assert hover.interrupts == 1
    assert "goto_straight" not in paused.alive(), "hover has not let go of the drone yet"
    hover.end("IT")
    paused.tick()
    paused.tick()
    assert paused.goal("goto_straight").inputs["target"] == dict(zip("xyz", ROUTE[0], strict=True))


def test_a_hover_that_ends_is_followed_by_another(paused: Flight) -> None:
    paused.goal("hover").end("S_DONE", success=True)
    paused.tick()
    paused.tick()
    assert paused.alive()[-1] == "hover"
    paused.goal("hover").end("LOST")
    for _ in range(20):
        paused.tick(later=0.01)
        assert "hover" not in paused.alive(), "what failed is not asked again at every tick"
    paused.tick(later=1.0)
    assert paused.alive()[-1] == "hover"


def test_a_low_battery_ends_a_pause_and_brings_the_drone_home(paused: Flight) -> None:
    paused.interface.states["battery_status"] = "LOW"
    paused.tick()
    paused.goal("hover").end("IT")
    paused.tick()
    paused.tick()
    assert paused.alive() == ["lidar_mapping", "zed_depthmap", "return_home"]
    assert paused.pausable.pause("again") == "battery_status is LOW"


def test_an_empty_battery_lands_a_paused_drone(paused: Flight) -> None:
    paused.interface.states["battery_status"] = "CRITICAL"
    paused.tick()
    for goal in paused.goals:
        if not goal.done:
            assert goal.interrupts == 1
            goal.end("IT")
    paused.tick(later=1.0)
    assert paused.alive() == ["land"]
    assert paused.pausable.pause("again") is not None, "a landing is not paused"


def test_a_camera_that_fails_during_a_pause_is_replaced_at_once_and_the_flight_goes_on_later(paused: Flight) -> None:
    paused.lose_camera()
    paused.tick()
    assert paused.alive() == ["lidar_mapping", "hover", "lidar_depthmap"]
    paused.interface.states["depthmap_source"] = "LIDAR"
    for _ in range(20):
        paused.tick(later=1.0)
    assert paused.alive() == ["lidar_mapping", "hover", "lidar_depthmap"]
    paused.pausable.resume()
    paused.tick()
    paused.goal("hover").end("IT")
    paused.tick()
    assert paused.alive()[-1] == "rotate_head"


def test_the_pilot_may_take_a_paused_drone_and_give_it_back(paused: Flight) -> None:
    paused.interface.states["SDK_authority"] = "UNAVAILABLE"
    paused.tick()
    paused.goal("hover").end("IT")
    paused.tick(later=10.0)
    assert paused.alive() == ["lidar_mapping", "zed_depthmap"]
    paused.interface.states["SDK_authority"] = "AVAILABLE"
    paused.tick()
    paused.tick()
    assert paused.alive()[-1] == "hover", "it is still paused"


def test_the_time_limit_counts_pauses(paused: Flight) -> None:
    paused.tick(later=901.0)
    assert paused.goal("hover").interrupts == 1
    assert paused.journal[-1][2] == "landing where it is"


@given(st.lists(st.sampled_from(["pause", "resume", "take", "give", "tick", "wait", "stop", "arrive"]), max_size=60))
@settings(max_examples=100, deadline=None)
def test_after_any_holds_the_route_is_flown(m600: Skillset, order: list[str]) -> None:
    """The route is flown after any holds, with at most one motion at a time, and none during a hold."""
    flight = Flight(m600)
    flight.start_mapping()

    def motions() -> list[FakeGoal]:
        return [goal for goal in flight.goals if not goal.done and goal.skill not in ("lidar_mapping", "zed_depthmap")]

    def stop(label: str, **more: Any) -> None:
        for goal in motions():
            if goal.interrupts or label != "IT":
                goal.end(label, **more)

    for step in order:
        match step:
            case "pause":
                flight.pausable.pause("for a test")
            case "resume":
                flight.pausable.resume()
            case "take":
                flight.interface.states["SDK_authority"] = "UNAVAILABLE"
            case "give":
                flight.interface.states["SDK_authority"] = "AVAILABLE"
            case "wait":
                flight.tick(later=1.0)
            case "stop":
                stop("IT")
            case "arrive" if motions() and motions()[0].skill == "goto_straight" and not motions()[0].interrupts:
                x, y, z = motions()[0].inputs["target"].values()
                flight.be_at(x, y, z)
                motions()[0].end("S_ARRIVED", success=True)
            case _:
                flight.tick()
        assert len(motions()) <= 1
        if step == "tick" and flight.interface.states["SDK_authority"] == "UNAVAILABLE":
            assert all(goal.interrupts == 1 for goal in motions())
    flight.interface.states["SDK_authority"] = "AVAILABLE"
    flight.pausable.resume()
    for _ in range(20):
        flight.tick()
        stop("IT")
        if motions() and motions()[0].skill == "goto_straight":
            x, y, z = motions()[0].inputs["target"].values()
            flight.be_at(x, y, z)
            motions()[0].end("S_ARRIVED", success=True)
    assert flight.trees.progress().waypoint == 2
    assert [goal.skill for goal in flight.goals].count("takeoff") == 1


def test_when_the_pilot_takes_over_during_the_rescue_the_landing_is_left_to_him(flight: Flight) -> None:
    flight.interface.states["flight_status"] = "IN_AIR"
    for _ in range(2):
        flight.time += 1.0
        flight.trees.rescue.tick_once()
    flight.interface.states["SDK_authority"] = "UNAVAILABLE"
    flight.trees.rescue.tick_once()
    assert flight.trees.rescue.status is Status.FAILURE
    assert flight.goal("land").interrupts == 1


def test_a_landing_that_fails_is_tried_three_times(flight: Flight) -> None:
    flight.interface.states["flight_status"] = "IN_AIR"
    tries = 0
    while flight.trees.rescue.status in (Status.INVALID, Status.RUNNING):
        flight.time += 1.0
        flight.trees.rescue.tick_once()
        if flight.alive():
            tries += 1
            flight.goal("land").end("S_BLOCKED")
    assert (tries, flight.trees.rescue.status) == (3, Status.FAILURE)


def test_the_time_limit_ends_the_flight(flight: Flight) -> None:
    flight.start_mapping()
    flight.time = 901.0
    flight.tick()
    assert flight.goal("goto_straight").interrupts == 1
    assert flight.journal[-1][3] == "the flight takes longer than 900 s"


# --- options ---------------------------------------------------------------------------------------------------------


def test_options_are_read_from_plain_values_and_text() -> None:
    options = MISSION.read_options({"route": [[1, 2, 3]], "speed": "1.5", "height": 6})
    assert options == MappingMissionOptions(route=((1.0, 2.0, 3.0),), speed=1.5, height=6.0)


@pytest.mark.parametrize(
    ("given", "option"),
    [
        ({"speeed": 1}, "speeed"),
        ({"speed": 50}, "speed"),
        ({"route": []}, "route"),
        ({"route": [[1, 2]]}, "route"),
        ({"height": "tall"}, "height"),
    ],
)
def test_options_that_do_not_fit_are_named(given: dict[str, object], option: str) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        MISSION.read_options(given)
    assert caught.value.option == option


def test_a_route_that_leaves_the_area_is_refused_before_the_flight() -> None:
    with pytest.raises(InvalidOptionError, match=r"Waypoint 2 of `route` \(300, 0\) lies outside `area`"):
        MISSION.read_options({"route": [[1, 2, 3], [300, 0, 4]]})
    anywhere = MISSION.read_options({"route": [[300, 0, 4]], "area": None})
    assert isinstance(anywhere, MappingMissionOptions)


def test_missions_are_found_by_name() -> None:
    assert find_mission("mapping") is MISSION
    with pytest.raises(UnknownNameError, match="did you mean `mapping`"):
        find_mission("maping")
