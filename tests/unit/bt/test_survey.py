"""The visit of the survey mission to the shared pad, on interfaces that the test plays."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_interface import FakeMission
from py_trees.common import Status

from skillwing.bt_missions.drone.depth_map import CAMERA, LIDAR
from skillwing.bt_missions.missions.mapping import MappingMissionOptions
from skillwing.dsl import load
from skillwing.evaluation.fleet.survey import SurveyOptions, pad_visit

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
HOLDER = "left"
HOME = (0.0, 4.0, 4.0)
ENDS = {
    "takeoff": "S_AT_ALTITUDE",
    "goto_straight": "S_ARRIVED",
    "goto": "S_ARRIVED",
    "rotate_head": "S_ALIGNED",
    "land": "S_LANDED",
}
"""Skills of the drone that end by themselves, and how."""


class Visit:
    """A drone in the air and the yard. Each tick, the oldest motion of the drone ends well. places: the robot that the
    yard sees on the pad after each landing."""

    def __init__(self, *places: str) -> None:
        self.drone = FakeMission(load(ROOT / "services/skillwing/m600/m600.skillset"))
        self.yard = FakeMission(load(ROOT / "examples/yard/yard.skillset"))
        self.drone.interface.states |= {"SDK_authority": "AVAILABLE", "zed_status": "OK", "lidar_status": "OK"}
        self.places = list(places)
        mapping = MappingMissionOptions(route=((20.0, 0.0, 4.0),))
        options = SurveyOptions(holder=HOLDER, mapping=mapping, home=HOME)
        self.tree = pad_visit(self.drone.context, self.yard.context, options)

    def fly(self) -> Status:
        """Run to the end of the visit."""
        for _ in range(100):
            self.tree.tick_once()
            if self.tree.status is not Status.RUNNING:
                return self.tree.status
            self._go_on()
        pytest.fail("the visit has no end")

    def _go_on(self) -> None:
        for goal in (*self.drone.goals, *self.yard.goals):
            if goal.interrupts and not goal.done:
                goal.end("IT")
            elif not goal.done:
                goal.run()
        states = self.drone.interface.states
        running = {goal.skill for goal in self.drone.goals if not goal.done}
        states["depthmap_source"] = next((each.source for each in (CAMERA, LIDAR) if each.skill in running), "NONE")
        moving = next((goal for goal in self.drone.goals if goal.skill in ENDS and not goal.done), None)
        if moving is not None:
            moving.end(ENDS[moving.skill], success=True)
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
