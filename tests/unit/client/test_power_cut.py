"""Clients elsewhere, after a power cut that has cost a robot the latest steps of its journal."""

from __future__ import annotations

import shutil
from pathlib import Path

from skillwing.dsl import parse
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import FireExtern, Keys, encode

LAMP = parse(
    "skillset lamp { resource bulb { initial A  extern A -> B  extern B -> C  extern C -> D } }", "lamp.skillset"
)
KEYS = Keys(LAMP.name)


class Robot:
    """A resource manager with a journal, and the bridge that drives its resource."""

    def __init__(self, network: InProcessNetwork, folder: Path) -> None:
        self._network = network
        self._folder = folder
        self._bridge = network.bus("bridge")
        self.power_on()

    def power_on(self) -> None:
        journal = Journal(self._folder / "journal.sqlite", Identity("", LAMP.name, LAMP.schema_hash))
        self._manager: InProcessBus = self._network._join(RESOURCE_MANAGER, "r1")
        ResourceManagerNode(LAMP, journal=journal).attach(self._manager)
        self._network.run_for(1.0)

    def report(self, state: str) -> None:
        request = FireExtern(resource="bulb", target=state, source="bridge")
        self._bridge.ask(KEYS.resource_extern, encode(request), lambda answer: None)
        self._network.run_for(0.1)

    def save_disk(self, copy: Path) -> None:
        shutil.copytree(self._folder, copy)

    def lose_power(self, disk: Path) -> None:
        """End at once, with the disk as it was at its latest write."""
        self._manager.close()
        shutil.rmtree(self._folder)
        shutil.copytree(disk, self._folder)
        self._network.run_for(1.0)


def written_at_b(tmp_path: Path) -> tuple[Robot, SkillsetInterface]:
    """A robot whose disk was copied to `written` when its bulb was in B, and a client of it."""
    network = InProcessNetwork()
    (tmp_path / "disk").mkdir()
    robot = Robot(network, tmp_path / "disk")
    interface = SkillsetInterface(network.bus("station"), LAMP, client="station")
    robot.report("B")
    robot.save_disk(tmp_path / "written")
    return robot, interface


def test_a_client_hears_of_the_states_of_a_robot_that_has_lost_one_step(tmp_path: Path) -> None:
    """The return of its resource manager is a step as well, and takes the number of the lost one."""
    robot, interface = written_at_b(tmp_path)
    robot.report("C")
    lost = interface.step
    seen: list[str | None] = []
    interface.on_change(lambda: seen.append(interface.state("bulb")))
    robot.lose_power(tmp_path / "written")
    robot.power_on()
    assert interface.step == lost, "the number is the same"
    assert interface.states == {"bulb": "B"}
    assert seen[-1:] == ["B"], "who waits for a change hears of it"
    assert not interface.resource_manager_silent


def test_a_client_believes_a_robot_that_has_lost_its_latest_steps(tmp_path: Path) -> None:
    robot, interface = written_at_b(tmp_path)
    for state in ("C", "D"):
        robot.report(state)
    lost = interface.step
    assert interface.states == {"bulb": "D"}
    robot.lose_power(tmp_path / "written")
    robot.power_on()
    assert interface.states == {"bulb": "B"}
    assert interface.change_record("bulb") is None, "the client has not seen the step again that led there"
    robot.report("C")
    assert interface.states == {"bulb": "C"}
    assert interface.step is not None
    assert lost is not None
    assert interface.step <= lost, "numbers of lost steps are used again"
    assert interface.change_record("bulb") is not None
