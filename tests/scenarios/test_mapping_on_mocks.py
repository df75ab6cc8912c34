"""Missions without a robot: the managers are real, the skills and the world play the M600's mock scripts."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.missions import inspection
from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT, SKILLSET
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.mocking import MockWorld, load_scripts, make_mock_managers
from skillwing.services.mocking.system import scripts_for
from skillwing.services.protocol import GoalStatus, Keys, MissionStatus, Record, RecordKind

M600 = ROBOT.load_skillset()
CAMERA_FAILS = SKILLSET.with_name("camera_fails.mock.toml")
IDLE = {"axes_authority": "AVAILABLE", "heading_authority": "AVAILABLE", "flight_status": "ON_GROUND"}


class MockFlight:
    """A mocked M600, and the mission that flies on it."""

    def __init__(self, script: Path | None = None, mission: Mission = MISSION) -> None:
        self.network = InProcessNetwork(seed=1, jitter=0.002)
        self.goals: dict[str, GoalStatus] = {}
        self.records: list[Record] = []
        keys = Keys(M600.name)
        observer = self.network.bus("observer")
        follow_records(observer, keys, self.records.append, self._follow)
        played = load_scripts(scripts_for(SKILLSET, script), M600)
        for node in (*make_mock_managers(M600, played), MockWorld(M600, played)):
            self.network.attach(node)
        self.node = MissionNode(mission, M600, mission.read_options({}), rescue_goal=ROBOT.rescue_goal)

    def _follow(self, status: GoalStatus) -> None:
        self.goals[status.goal_id] = status

    def fly(self) -> MissionStatus:
        self.network.attach(self.node)
        assert self.network.run_until(lambda: self.node.over, 200.0), self.node.status
        self.network.run_for(3.0)
        return self.node.status

    def ends(self, skill: str) -> list[str]:
        return [goal.terminal.label for goal in self.goals.values() if goal.skill == skill and goal.terminal]

    def states(self) -> dict[str, str]:
        return {each.subject: each.after for each in self.records if each.kind is RecordKind.RESOURCE}


def test_the_mission_succeeds_on_mocks_alone() -> None:
    flight = MockFlight()
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", 4)
    assert flight.ends("goto_straight") == ["S_ARRIVED"] * 4
    assert flight.ends("lidar_depthmap") == []
    assert flight.ends("land") == ["S_LANDED"]
    assert IDLE.items() <= flight.states().items()


def test_the_mission_goes_on_by_lidar_when_the_script_fails_the_camera() -> None:
    flight = MockFlight(CAMERA_FAILS)
    status = flight.fly()
    assert (status.phase, status.waypoint) == ("SUCCEEDED", 4)
    assert flight.ends("zed_depthmap") == ["RI"]
    assert flight.ends("goto_straight") == ["S_ARRIVED", "IT"]
    assert flight.ends("goto") == ["S_ARRIVED"] * 3
    assert flight.ends("lidar_mapping") == ["IT"]
    assert IDLE.items() <= flight.states().items()


def test_the_camera_fails_because_a_leg_has_ended() -> None:
    """A reaction of the script to an event has that event as its cause, as on a robot."""
    flight = MockFlight(CAMERA_FAILS)
    flight.fly()
    by_id = {each.id: each for each in flight.records}
    failure = next(each for each in flight.records if (each.subject, each.after) == ("zed_status", "FAILED"))
    assert failure.cause is not None
    assert by_id[failure.cause].subject == "goto_straight"


@pytest.mark.parametrize("script", [None, CAMERA_FAILS])
def test_the_same_script_gives_the_same_flight(script: Path | None) -> None:
    first, second = MockFlight(script), MockFlight(script)
    first.fly()
    second.fly()
    told = [[(each.t, each.subject, each.after) for each in flight.records] for flight in (first, second)]
    assert told[0] == told[1]


# --- the inspection --------------------------------------------------------------------------------------------------

INSPECTION_FILE = Path(inspection.__file__).with_suffix(".xml")
VIDEO_FAILS = """
[skill.stream]
result = "FPS_LOST"
delay = 3.0
"""


@pytest.mark.parametrize("fails", [False, True])
def test_the_inspection_and_its_tree_file_do_the_same(tmp_path: Path, fails: bool) -> None:
    script = None
    if fails:
        script = tmp_path / "video_fails.mock.toml"
        script.write_text(VIDEO_FAILS)
    stories: list[list[tuple[str, str]]] = []
    for mission in (inspection.MISSION, find_mission(str(INSPECTION_FILE))):
        flight = MockFlight(script, mission)
        assert flight.fly().phase == ("FAILED" if fails else "SUCCEEDED")
        ended = (goal for goal in flight.goals.values() if goal.terminal is not None)
        stories.append([(goal.skill, goal.terminal.label) for goal in ended if goal.terminal])
        assert flight.ends("stream") == ["S_FPS_LOST" if fails else "IT"]
        assert flight.ends("inspect") == ["IT" if fails else "S_COMPLETED"]
        assert flight.ends("hover") == (["S_DONE"] if fails else [])
        assert flight.ends("land") == ["S_LANDED"]
        assert IDLE.items() <= flight.states().items()
    assert stories[0] == stories[1]
