"""The mapping mission on the simulated M600, two of whose skills are mocked."""

from __future__ import annotations

import pytest

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT, functional_layer
from skillwing.onboard.topics.truth import TRUTH, Truth
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.mocking.system import mock_processes
from skillwing.services.processes.node_host import make_node
from skillwing.services.protocol import GoalStatus, Keys

MOCKED = ("zed_depthmap", "lidar_mapping")
NOT_NEEDED = ("obstacles", "mapping")
"""Nodes below the mocked skills."""
ROUTE = [[4.0, 0.0, 3.0], [0.0, 0.0, 3.0]]


@pytest.mark.slow
def test_real_skills_fly_the_drone_while_others_are_mocked() -> None:
    skillset, network = ROBOT.load_skillset(), InProcessNetwork()
    truths: list[Truth] = []
    ends: dict[str, str] = {}

    def note(status: GoalStatus) -> None:
        if status.terminal is not None:
            ends[status.skill] = status.terminal.label

    for spec in (*functional_layer({"seed": 1}), *mock_processes(ROBOT, skills=MOCKED)):
        if spec.name not in NOT_NEEDED:
            network.attach(make_node(spec))
    observer = network.bus("observer")
    observer.subscribe(TRUTH, message_reader(Truth, truths.append))
    observer.subscribe(Keys(skillset.name).status("*"), message_reader(GoalStatus, note), events=True)
    node = MissionNode(MISSION, skillset, MISSION.read_options({"route": ROUTE}), rescue_goal=ROBOT.rescue_goal)
    network.attach(node)

    assert network.run_until(lambda: node.over, 120.0)
    assert (node.status.phase, node.status.waypoint) == ("SUCCEEDED", len(ROUTE))
    assert {skill: ends[skill] for skill in MOCKED} == {"zed_depthmap": "IT", "lidar_mapping": "IT"}
    assert ends["goto_straight"] == "S_ARRIVED"
    assert max(truth.position[0] for truth in truths) > 3.0
