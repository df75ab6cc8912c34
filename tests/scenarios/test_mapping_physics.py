"""Short mapping missions on the whole simulated M600: physics, ray-cast sensors, guidance, managers, tree."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT, functional_layer
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus import Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import GoalStatus, Keys, MissionStatus, decode
from skillwing.services.robot import ProcessSpec

CAMERA_FAILS = {"sensor": "zed", "kind": "blackout", "at": 10.0}
ROUTE = [[4.0, 0.0, 2.0], [0.0, 0.0, 2.0]]
OPTIONS = {"route": ROUTE, "return_height": 3.0}


def make(spec: ProcessSpec) -> Any:
    module, _, factory = spec.factory.partition(":")
    return getattr(import_module(module), factory)(spec.resolved().options)


class Flight:
    """The robot with all its processes on the in-process bus, and a mission that is about to start."""

    def __init__(self, faults: list[dict[str, Any]]) -> None:
        skillset, self.network = ROBOT.load_skillset(), InProcessNetwork()
        self.specs = {spec.name: spec for spec in (*functional_layer({"seed": 1, "faults": faults}), *ROBOT.managers())}
        self.buses: dict[str, Bus] = {name: self.network.attach(make(spec)) for name, spec in self.specs.items()}
        self.truths: list[Truth] = []
        self.ends: list[tuple[str, str]] = []
        observer = self.network.bus("observer")
        observer.subscribe(TRUTH, lambda sample: self.truths.append(decode(sample.payload, Truth)))
        observer.subscribe(
            Keys(skillset.name).status("*"), lambda sample: self._note(decode(sample.payload, GoalStatus)), events=True
        )
        self._mission = MissionNode(MISSION, skillset, MISSION.read_options(OPTIONS), rescue_goal=ROBOT.rescue_goal)
        self.network.attach(self._mission)

    def _note(self, status: GoalStatus) -> None:
        if status.terminal is not None:
            self.ends.append((status.skill, status.terminal.label))

    def start_again(self, name: str) -> None:
        """Start a process again, as a supervisor does after a kill."""
        self.buses[name].close()
        self.buses[name] = self.network.attach(make(self.specs[name]))

    def fly(self) -> MissionStatus:
        """Fly to the end of the mission. The drone may hit nothing and has to come down inside the fence."""
        assert self.network.run_until(lambda: self._mission.over, 120.0)
        assert self.truths[-1].collisions == 0
        assert all(truth.inside_fence for truth in self.truths)
        assert self.truths[-1].position[2] < 1.0
        return self._mission.status


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_the_camera_fails_in_flight_and_the_lidar_brings_the_drone_home() -> None:
    flight = Flight([CAMERA_FAILS])
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", 2)
    assert ("zed_depthmap", "RI") in flight.ends
    assert ("goto_straight", "IT") in flight.ends
    assert ("goto", "S_ARRIVED") in flight.ends
    assert ("lidar_mapping", "IT") in flight.ends


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_mapping_process_that_was_killed_costs_the_map_and_the_drone_comes_home() -> None:
    """The new process knows nothing of the goal. A mission once succeeded with an empty map."""
    flight = Flight([])
    assert flight.network.run_until(lambda: bool(flight.truths) and flight.truths[-1].position[0] > 2.0, 60.0)
    flight.start_again("mapping")
    status = flight.fly()
    assert status.phase == "FAILED"
    assert "has lost the map" in status.text
    assert ("lidar_mapping", "ERROR") in flight.ends
    assert ("return_home", "S_ARRIVED") in flight.ends
    assert ("land", "S_LANDED") in flight.ends
