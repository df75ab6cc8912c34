"""Table of the functional layer, compared with the traffic of a running robot.

The M600 stands on the ground with all its sensors at work. Needs in the air are checked on the flight of
examples/point_drone (test_point_drone.py). Clients from outside, as the command line or a campaign, are not checked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from observed_network import ObservedNetwork

from skill_needs import seen, told
from skillwing.m600.robot import ROBOT
from skillwing.onboard.interface.table import TOPICS
from skillwing.onboard.topics.flight import AUTOPILOT_SETPOINT
from skillwing.onboard.topics.mapping import MAP_SNAPSHOT
from skillwing.onboard.topics.processes import SKILLS
from skillwing.onboard.topics.sensors import HEALTH
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.protocol import CLOCK_KEY, State
from skillwing.services.wire.channel import Channel, Kind

SENSING = ("zed_depthmap", "lidar_depthmap", "lidar_mapping", "stream")
SETTLING, BEGINNING, WINDOW = 1.5, 0.5, 1.0
"""Waits for the radio link, and for odometry and video; and the time over which rates are counted [s]."""


@dataclass(frozen=True)
class Observation:
    """Observed traffic of the robot, and the rate of each key [Hz]."""

    network: ObservedNetwork
    rates: dict[str, float]
    processes: set[str]


@pytest.fixture(scope="module")
def observed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Observation]:
    options = {"seed": 1, "run_dir": str(tmp_path_factory.mktemp("run"))}
    wanted = {DATA_MANAGER, RESOURCE_MANAGER, *map(skill_process, SENSING)}
    managers = [spec for spec in ROBOT.managers() if spec.name in wanted]
    specs = (*ROBOT.functional_layer(options), *managers, *ROBOT.observers(options))
    network = ObservedNetwork()
    with RobotInProcess(ROBOT, network) as robot:
        robot.start(specs)
        client = SkillsetInterface(network.bus("client", ROBOT.name), ROBOT.load_skillset(), client="client")
        ready = {"zed_status": "OK", "lidar_status": "OK"}
        assert network.run_until(lambda: ready.items() <= client.states.items(), 10.0)
        network.run_for(SETTLING)
        goals = {skill: client.start(skill, {}) for skill in ("zed_depthmap", "lidar_mapping", "stream")}
        network.run_for(BEGINNING)
        rates = network.rates(WINDOW)
        assert {skill: goal.state for skill, goal in goals.items()} == dict.fromkeys(goals, State.RUNNING)
        client.interrupt(goals["zed_depthmap"])
        assert network.run_until(lambda: goals["zed_depthmap"].done, 5.0)
        other = client.start("lidar_depthmap", {})
        assert network.run_until(lambda: other.state is State.RUNNING, 5.0)
        network.run_for(0.1)
        yield Observation(network, rates, {spec.name for spec in specs})


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_topic_is_offered_by_whom_the_table_says(topic: Channel, observed: Observation) -> None:
    network = observed.network
    if topic.kind is Kind.QUERY:
        assert network.serves[topic.key] == set(topic.offered_by)
        assert not network.offers[topic.key]
    else:
        offers = [offer for key in network.offers if covers(topic, key) for offer in network.offers[key]]
        assert set(offers) == {(who, topic.kind is Kind.EVENTS) for who in topic.offered_by}


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_a_topic_is_used_by_whom_the_table_says(topic: Channel, observed: Observation) -> None:
    if topic.key == CLOCK_KEY:
        return  # in one process the network itself has the time
    network = observed.network
    users = {
        who
        for key in {*network.uses, *network.asks}
        if covers(topic, key)
        for who in network.uses[key] | network.asks[key]
    }
    # The recorder asks for the whole map at the end of a mission.
    expected = set[str]() if topic.key == MAP_SNAPSHOT else set(topic.used_by) & observed.processes
    assert users & observed.processes - {skill_process(skill) for skill in SENSING} == expected
    asked_or_followed = {key for asks, follows in told().values() for key in asks | follows}
    assert (SKILLS in topic.used_by) == (topic.key in asked_or_followed)


@pytest.mark.parametrize("topic", [topic for topic in TOPICS if topic.rate], ids=lambda topic: topic.key)
def test_a_topic_comes_as_often_as_the_table_says(topic: Channel, observed: Observation) -> None:
    if topic.key == AUTOPILOT_SETPOINT:
        assert topic.key not in observed.rates, "none on the ground; the other flight looks at those in the air"
        return
    assert topic.rate is not None
    assert abs(observed.rates[topic.key] - topic.rate) <= max(0.5, 0.1 * topic.rate)


def test_nothing_of_the_layer_is_missing_in_the_table(observed: Observation) -> None:
    network = observed.network
    keys = {key for keys in (network.offers, network.serves, network.uses, network.asks) for key in keys}
    assert {key for key in keys if key.startswith("fl/") and not any(covers(topic, key) for topic in TOPICS)} == set()
    assert CLOCK_KEY in keys


def test_the_skills_that_sense_need_what_the_page_says(observed: Observation) -> None:
    needs = told()
    assert seen(observed.network, SENSING) == {skill: needs[skill] for skill in SENSING}


def covers(topic: Channel, key: str) -> bool:
    """True if the row covers this key."""
    return key == topic.key or (topic.key == HEALTH and key.startswith(f"{HEALTH}/"))
