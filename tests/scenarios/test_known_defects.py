"""Two defects of earlier missions, found by verification, which must not come back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import MappingProxyType
from unittest.mock import patch

import pytest
from py_trees.behaviours import Success

from skillwing.bt_missions.checking import mission_check
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.missions import inspection, mapping
from skillwing.bt_missions.running.publisher import MissionPublisher
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT, SKILLSET
from skillwing.services.bus import Node
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.causal_view import CausalView
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.mocking import MockWorld, load_scripts, make_mock_managers, world
from skillwing.services.mocking.fitting import fit_script
from skillwing.services.mocking.script import MockScript
from skillwing.services.mocking.skill import MockSkillNode
from skillwing.services.mocking.system import scripts_for
from skillwing.services.protocol import FireExtern, GoalStatus, Keys, MissionPhase, Record, State, encode

M600 = ROBOT.load_skillset()
KEYS = Keys(M600.name)
SEEDS = range(200)
"""One flight in ten at each delay begins its way home wrongly if messages have no order."""
JITTERS = (0.010, 0.050, 0.150)
"""Longest delays of single messages, in seconds."""


class MockFlight:
    """A mission on a mocked M600. The network delays each message by up to `jitter` seconds.

    robot: the managers and the world, which run for a moment before the mission comes.
    """

    def __init__(self, mission: Mission, seed: int, jitter: float, robot: Iterable[Node]) -> None:
        self.network = InProcessNetwork(seed=seed, jitter=jitter)
        self.records: list[Record] = []
        self.running: set[str] = set()
        self.observer = self.network.bus("observer")
        follow_records(self.observer, KEYS, self.records.append, self._note)
        for node in robot:
            self.network.attach(node)
        self.network.run_for(2 * jitter + 0.1)
        self.node = MissionNode(mission, M600, mission.read_options({}), rescue_goal=ROBOT.rescue_goal)
        self.network.attach(self.node)

    def _note(self, status: GoalStatus) -> None:
        if status.state is State.RUNNING:
            self.running.add(status.skill)

    def fly_until_running(self, skill: str) -> None:
        assert self.network.run_until(lambda: skill in self.running, 100.0), f"{skill} never ran"

    def report(self, resource: str, state: str) -> None:
        """Report a state as the robot's bridge does."""
        request = FireExtern(resource=resource, target=state, source="test")
        self.observer.ask(KEYS.resource_extern, encode(request), lambda answer: None)

    def time_of(self, subject: str, after: str) -> float:
        return next(each.t for each in self.records if (each.subject, each.after) == (subject, after))

    def granted(self, skill: str) -> list[float]:
        return [each.t for each in self.records if (each.subject, each.after) == (skill, "GRANTED")]

    def state(self, resource: str) -> str:
        return [each.after for each in self.records if each.subject == resource][-1]


def script(extra: Path | None = None) -> MockScript:
    """The scripts of the M600."""
    return load_scripts(scripts_for(SKILLSET, extra), M600)


# --- F2: the end of a goal was known before the change that had ended it ----------------------------------------------


class Airborne(inspection.InspectionMission):
    """The inspection from the end of its take-off on."""

    needs = MappingProxyType({**inspection.InspectionMission.needs, "flight_status": ("IN_AIR",)})


@pytest.fixture
def robot() -> Iterator[Callable[[], tuple[Node, ...]]]:
    """Maker of an M600 in the air. The mission's tree is always the same: its check and pictures are left out."""
    played = script()
    fitted = fit_script(played, M600)
    skills = ("lidar_depthmap", "stream", "inspect", "return_home", "land")

    def make() -> tuple[Node, ...]:
        mocks = (MockSkillNode(M600, skill, fitted) for skill in skills)
        manager = ResourceManagerNode(M600, {"flight_status": "IN_AIR"})
        return (DataManagerNode(M600), manager, *mocks, MockWorld(M600, played))

    with (
        patch.object(inspection, "take_off", lambda context, height: Success("in the air")),
        patch.object(mission_check, "preflight", lambda mission, trees, context: []),
        patch.object(MissionPublisher, "publish_tree", lambda publisher: False),
        patch.object(world, "fit_script", lambda script, skillset: fitted),
    ):
        yield make


def returns_home_with_a_critical_battery(robot: Iterable[Node], seed: int, jitter: float) -> bool:
    flight = MockFlight(Airborne(), seed, jitter, robot)
    flight.fly_until_running("inspect")
    flight.network.run_for(2 * jitter)
    flight.report("battery_status", "CRITICAL")
    assert flight.network.run_until(lambda: "land" in flight.running, 30.0)
    critical = flight.time_of("battery_status", "CRITICAL")
    return any(t >= critical for t in flight.granted("return_home"))


@pytest.mark.parametrize("jitter", JITTERS)
def test_no_flight_home_begins_with_a_critical_battery(robot: Callable[[], Iterable[Node]], jitter: float) -> None:
    assert [seed for seed in SEEDS if returns_home_with_a_critical_battery(robot(), seed, jitter)] == []


@pytest.mark.parametrize("jitter", JITTERS)
def test_without_the_order_of_messages_flights_home_do_begin(
    robot: Callable[[], Iterable[Node]], jitter: float
) -> None:
    """The test above fails without this rule."""
    with patch.object(CausalView, "take_status", lambda view, status: (status,)):
        assert any(returns_home_with_a_critical_battery(robot(), seed, jitter) for seed in SEEDS)


# --- F1: the pilot gave the drone back while the mission waited for goals to stop -------------------------------------


@pytest.mark.parametrize("mission", [mapping.MISSION, inspection.MISSION], ids=lambda mission: mission.name)
def test_a_drone_that_the_pilot_gives_back_late_is_landed(mission: Mission, tmp_path: Path) -> None:
    slow = tmp_path / "slow.mock.toml"
    slow.write_text("".join(f"[skill.{skill}]\nstop_delay = 4.0\n" for skill in ("lidar_mapping", "stream")))
    slowed = script(slow)
    flight = MockFlight(mission, 0, 0.002, (*make_mock_managers(M600, slowed), MockWorld(M600, slowed)))
    flight.fly_until_running("takeoff")
    assert flight.network.run_until(lambda: flight.running > {"takeoff"}, 60.0)
    flight.network.run_for(1.0)
    flight.report("SDK_authority", "UNAVAILABLE")
    flight.network.run_for(122.0)  # Two seconds longer than missions are patient with the pilot.
    assert not flight.node.over
    flight.report("SDK_authority", "AVAILABLE")
    assert flight.network.run_until(lambda: flight.node.over, 60.0)
    flight.network.run_for(1.0)
    assert flight.node.status.phase is MissionPhase.FAILED
    assert flight.state("flight_status") == "ON_GROUND", flight.node.status.text
