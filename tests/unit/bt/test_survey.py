"""The visit of the survey mission to the shared pad, on interfaces that the test plays."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from fake_interface import FakeMission
from py_trees.common import Status

from skillwing.bt_missions.drone.depth_map import CAMERA, LIDAR
from skillwing.bt_missions.missions.mapping import MappingMissionOptions
from skillwing.dsl import load
from skillwing.evaluation.fleet.survey import DRONE, YARD, SurveyOptions, pad_visit

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
HOLDER = "left"
HOME = (0.0, 4.0, 4.0)
GATE = (4.8, 0.0)
ENDS = {
    "takeoff": "S_AT_ALTITUDE",
    "goto_straight": "S_ARRIVED",
    "goto": "S_ARRIVED",
    "rotate_head": "S_ALIGNED",
    "land": "S_LANDED",
}
"""Skills of the drone that end by themselves, and how."""


class Visit:
    """A drone on the ground and the yard. Each tick, the oldest motion of the drone ends well. places: the robot that
    the yard sees on the pad after each landing."""

    def __init__(self, *places: str) -> None:
        self.drone = FakeMission(load(ROOT / "services/skillwing/m600/m600.skillset"), DRONE)
        self.yard = FakeMission(load(ROOT / "examples/yard/yard.skillset"), YARD)
        self.drone.interface.states |= {"SDK_authority": "AVAILABLE", "zed_status": "OK", "lidar_status": "OK"}
        self.drone.interface.know("position", dict(zip("xyz", HOME, strict=True)))
        self.places = list(places)
        self.refused: set[str] = set()
        """Skills of the yard whose goals are not granted."""
        mapping = MappingMissionOptions(route=((20.0, 0.0, 4.0),))
        options = SurveyOptions(holder=HOLDER, mapping=mapping, home=HOME, gate=GATE)
        self.tree = pad_visit(self.drone.context, self.yard.context, options)

    def fly(self) -> Status:
        """Run to the end of the visit."""
        for _ in range(100):
            self.tree.tick_once()
            if self.tree.status is not Status.RUNNING:
                return self.tree.status
            self.go_on()
        pytest.fail("the visit has no end")

    def go_on(self, *, moves: bool = True) -> None:
        """End or begin goals. moves: motions end as well."""
        for goal in (*self.drone.goals, *self.yard.goals):
            if goal.interrupts and not goal.done:
                goal.end("IT")
            elif goal.skill in self.refused and not goal.done:
                goal.end("NR")
            elif not goal.done:
                goal.run()
        states = self.drone.interface.states
        running = {goal.skill for goal in self.drone.goals if not goal.done}
        states["depthmap_source"] = next((each.source for each in (CAMERA, LIDAR) if each.skill in running), "NONE")
        moving = next((goal for goal in self.drone.goals if goal.skill in ENDS and not goal.done), None)
        if moving is not None and moves:
            moving.end(ENDS[moving.skill], success=True)
            if "target" in moving.inputs:
                self.drone.interface.know("position", moving.inputs["target"])
            if moving.skill == "land":
                states["flight_status"] = "ON_GROUND"
                self.yard.interface.know("pad_robot", self.places.pop(0) if self.places else "")
            elif moving.skill == "takeoff":
                states["flight_status"] = "IN_AIR"

    def landings(self) -> int:
        return sum(goal.skill == "land" for goal in self.drone.goals)


def test_a_visit_lands_on_the_pad_and_then_at_home() -> None:
    visit = Visit(HOLDER)
    assert visit.fly() is Status.SUCCESS
    assert visit.landings() == 2


def test_a_landing_beside_the_pad_is_no_visit_and_the_drone_tries_again() -> None:
    visit = Visit("", HOLDER)
    assert visit.fly() is Status.SUCCESS
    assert visit.landings() == 3


def test_a_drone_that_never_lands_on_the_pad_fails() -> None:
    visit = Visit("", "")
    assert visit.fly() is Status.FAILURE
    assert visit.drone.interface.states["flight_status"] == "ON_GROUND"


def targets(visit: Visit) -> list[tuple[str, float, float]]:
    """Skill, x and y of each motion to a target."""
    motions = [goal for goal in visit.drone.goals if goal.skill in ("goto", "goto_straight")]
    return [(goal.skill, goal.inputs["target"]["x"], goal.inputs["target"]["y"]) for goal in motions]


def test_both_ways_lead_through_the_corridor_under_its_lease() -> None:
    visit = Visit(HOLDER)
    assert visit.fly() is Status.SUCCESS
    places = [GATE, (0.0, 0.0), GATE, HOME[:2]]
    assert targets(visit) == [("goto_straight", *place) for place in places]
    assert [goal.skill for goal in visit.yard.goals] == ["hold_pad", "hold_corridor", "hold_corridor"]
    assert all(goal.interrupts for goal in visit.yard.goals)


def test_by_the_lidar_the_nose_points_across_each_way() -> None:
    visit = Visit(HOLDER)
    visit.drone.interface.states["zed_status"] = "FAILED"
    assert visit.fly() is Status.SUCCESS
    assert [skill for skill, *_ in targets(visit)] == ["goto"] * 4
    headings = [goal.inputs["heading"] for goal in visit.drone.goals if goal.skill == "rotate_head"]
    places = [HOME[:2], GATE, (0.0, 0.0), GATE, HOME[:2]]
    for heading, (start, end) in zip(headings, pairwise(places), strict=True):
        way = math.atan2(end[1] - start[1], end[0] - start[0])
        assert math.cos(heading - way) == pytest.approx(0.0, abs=1e-9)


def test_a_drone_that_does_not_get_the_corridor_stays_on_the_ground() -> None:
    visit = Visit(HOLDER)
    visit.refused = {"hold_corridor"}
    visit.drone.interface.states["flight_status"] = "ON_GROUND"
    for _ in range(20):
        visit.tree.tick_once()
        visit.go_on()
    assert visit.tree.status is Status.RUNNING
    assert not [goal for goal in visit.drone.goals if goal.skill == "takeoff"]


def test_after_a_failure_on_the_way_the_nose_points_across_the_rest_of_it() -> None:
    visit = Visit(HOLDER)
    while len(targets(visit)) < 2:
        visit.tree.tick_once()
        visit.go_on()
    visit.drone.interface.know("position", {"x": 2.0, "y": 0.0, "z": 4.0})
    visit.drone.interface.states["zed_status"] = "FAILED"
    next(goal for goal in visit.drone.goals if goal.skill == "zed_depthmap").end("RI")
    assert visit.fly() is Status.SUCCESS
    heading = next(goal.inputs["heading"] for goal in visit.drone.goals if goal.skill == "rotate_head")
    assert abs(heading) == pytest.approx(math.pi / 2)


def lose(visit: Visit, motions: int, lease: str, seen: str) -> bool:
    """End a lease in a motion of the visit; True if the drone flies on. seen: place in which the yard sees it."""
    while len(targets(visit)) < motions:
        visit.tree.tick_once()
        visit.go_on(moves=len(targets(visit)) < motions)
    for place in ("pad", "corridor"):
        visit.yard.interface.know(f"{place}_robot", HOLDER if place == seen else "")
    [goal for goal in visit.yard.goals if goal.skill == lease][-1].end("RI")
    visit.tree.tick_once()
    motion = [goal for goal in visit.drone.goals if goal.skill == "goto_straight"][-1]
    return not motion.interrupts


@pytest.mark.parametrize(
    ("motions", "seen", "flies_on"),
    [(1, "pad", True), (1, "corridor", True), (1, "", False), (3, "corridor", True), (3, "pad", False), (3, "", False)],
    ids=str,
)
def test_without_the_corridor_a_drone_flies_on_only_where_nobody_else_can_come(
    motions: int, seen: str, flies_on: bool
) -> None:
    """On its way in it holds the pad, and on its way out it has to leave the pad under the lease of the corridor."""
    assert lose(Visit(HOLDER), motions, "hold_corridor", seen) is flies_on


@pytest.mark.parametrize(("seen", "flies_on"), [("pad", True), ("corridor", False), ("", False)])
def test_without_the_pad_a_drone_in_the_corridor_stops_for_another_one_may_get_the_pad(
    seen: str, flies_on: bool
) -> None:
    assert lose(Visit(HOLDER), 2, "hold_pad", seen) is flies_on


def test_the_pad_is_given_back_on_the_pad() -> None:
    visit = Visit(HOLDER)
    while len(targets(visit)) < 3:
        visit.tree.tick_once()
        visit.go_on()
    assert next(goal for goal in visit.yard.goals if goal.skill == "hold_pad").interrupts
    assert visit.drone.interface.states["flight_status"] == "IN_AIR"
