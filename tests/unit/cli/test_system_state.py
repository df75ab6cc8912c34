"""System state that a command reads before it advises on a refused start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import pytest

from skillwing.dsl import load
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.connection import Target
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockRun, MockScript, MockWorld, make_mock_managers
from skillwing.services.names import MISSION
from skillwing.services.protocol import DataSample, Keys, MissionPhase, MissionStatus, encode
from skillwing.services.terminal.connection import System
from skillwing.services.terminal.system_state import RunningMission, system_state

if TYPE_CHECKING:
    from skillwing.services.bus.zenoh_bus import ZenohBus

KEYS = Keys("balloon")
SKILLSET = """
skillset balloon {
    data { wind: float64 [m/s] period=1.0 }
    resource place { state { DOWN UP }  initial DOWN  extern DOWN -> UP  extern UP -> DOWN }
    skill rise { result { success AT_HEIGHT } }
    skill look { result { success DONE } }
    skill sink { result { success LANDED } }
}
"""
SCRIPT = """
[[reaction]]
when = {starts = "rise"}
trigger = {place = "UP"}
"""


class Balloon:
    """Managers of a balloon without a functional layer, and an observer."""

    def __init__(self, folder: Path) -> None:
        file = folder / "balloon.skillset"
        file.write_text(SKILLSET)
        (folder / "balloon.mock.toml").write_text(SCRIPT)
        self.skillset = load(file)
        self.network = InProcessNetwork()
        long = (MockRun(forever=True),)
        self.script = MockScript(skills={skill.name: long for skill in self.skillset.skills})
        for node in make_mock_managers(self.skillset, self.script):
            self.network.attach(node)
        self.bus = self.network.bus("somebody")
        target = Target("balloon-of-a-test", "", file, "wall")
        self.system = System(target, cast("ZenohBus", self.network.bus("cli")), self.skillset)

    def start(self, skill: str, client: str) -> None:
        goal = SkillsetInterface(self.bus, self.skillset, client=client).start(skill)
        assert self.network.run_until(lambda: goal.state is not None, 5.0)


@pytest.fixture
def balloon(tmp_path: Path) -> Balloon:
    return Balloon(tmp_path)


def test_a_mission_is_named_for_the_skills_that_it_has_started(balloon: Balloon) -> None:
    balloon.bus.declare_alive(KEYS.alive(MISSION))
    status = MissionStatus(mission="patrol", phase=MissionPhase.RUNNING, t=0.0, text="", rescue="sinking")
    balloon.bus.advertise(KEYS.mission_status, events=True).put(encode(status))
    balloon.start("rise", MISSION)
    balloon.start("look", "cli")
    found = system_state(balloon.system)
    assert found.running == {"rise": RunningMission("patrol", "sinking"), "look": None}
    assert found.states == {"place": "DOWN"}


def test_a_mission_that_is_gone_is_not_named(balloon: Balloon) -> None:
    balloon.start("rise", MISSION)
    assert system_state(balloon.system).running == {"rise": None}


def test_it_is_known_who_reports(balloon: Balloon) -> None:
    assert system_state(balloon.system).reporter == "nobody"
    balloon.bus.declare_alive(KEYS.alive(MISSION))
    balloon.bus.declare_alive(KEYS.alive("client/cli-1"))
    assert system_state(balloon.system).reporter == "nobody"
    balloon.bus.declare_alive(KEYS.alive("bridge"))
    assert system_state(balloon.system).reporter == "robot"


def test_data_tell_that_there_is_a_robot(balloon: Balloon) -> None:
    assert system_state(balloon.system).unheard == ["wind"]
    balloon.bus.advertise(KEYS.data("wind")).put(encode(DataSample(name="wind", value=1.0, t=0.0)))
    balloon.network.run_for(0.1)
    found = system_state(balloon.system)
    assert (found.reporter, found.unheard) == ("robot", [])


def test_a_mocked_world_is_no_robot(balloon: Balloon) -> None:
    balloon.network.attach(MockWorld(balloon.skillset, balloon.script))
    balloon.network.run_for(2.0)
    assert system_state(balloon.system).reporter == "mock"


def test_what_a_mock_would_do_is_read_beside_the_skillset(balloon: Balloon, tmp_path: Path) -> None:
    assert [reaction.trigger for reaction in system_state(balloon.system).reactions] == [{"place": "UP"}]
    (tmp_path / "balloon.mock.toml").write_text("no script")
    assert system_state(balloon.system).reactions == ()
