"""A short mapping mission on the whole simulated M600: physics, ray-cast sensors, guidance, managers, tree."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import pytest

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT, functional_layer
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import GoalStatus, Keys, decode
from skillwing.services.robot import ProcessSpec
from skillwing.sim_mujoco.topics import TRUTH, Truth

CAMERA_FAILS = {"sensor": "zed", "kind": "blackout", "at": 14.0}
ROUTE = [[6.0, 0.0, 3.0], [0.0, 0.0, 3.0]]


def make(spec: ProcessSpec) -> Any:
    module, _, factory = spec.factory.partition(":")
    return getattr(import_module(module), factory)(spec.options)


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_the_camera_fails_in_flight_and_the_lidar_brings_the_drone_home() -> None:
    skillset, network = ROBOT.load_skillset(), InProcessNetwork()
    truths: list[Truth] = []
    ends: list[tuple[str, str]] = []

    def note(status: GoalStatus) -> None:
        if status.terminal is not None:
            ends.append((status.skill, status.terminal.label))

    for spec in (*functional_layer({"seed": 1, "faults": [CAMERA_FAILS]}), *ROBOT.managers()):
        network.attach(make(spec))
    observer = network.bus("observer")
    observer.subscribe(TRUTH, lambda sample: truths.append(decode(sample.payload, Truth)))
    observer.subscribe(
        Keys(skillset.name).status("*"), lambda sample: note(decode(sample.payload, GoalStatus)), events=True
    )
    node = MissionNode(MISSION, skillset, MISSION.read_options({"route": ROUTE}))
    network.attach(node)

    assert network.run_until(lambda: node.over, 120.0)
    assert (node.status.phase, node.status.waypoint) == ("SUCCEEDED", 2)
    assert ("zed_depthmap", "RI") in ends
    assert ("goto_straight", "IT") in ends
    assert ("goto", "S_ARRIVED") in ends
    assert ("lidar_mapping", "IT") in ends
    assert truths[-1].collisions == 0
    assert all(truth.inside_fence for truth in truths)
    assert truths[-1].position[2] < 1.0
