"""The system that `recovery.py` measures: router, managers, mocked skills and world, and the mission, of one checkout.

recovery.py starts it. A question names a number of flights. The answer has the time of each recovery: from the failure
of the camera to the grant of the first skill of the LiDAR branch. It also has the part that is robot time by design.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from checkouts import script
from peer_process import PeerProcess, serve

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockWorld, load_scripts, make_mock_managers
from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import AbortMission, Keys, encode

SCRIPT = """
[skill.takeoff]
delay = 0.6

[skill.land]
delay = 0.1

[skill.goto_straight]
delay = 20.0
"""
"""Additions to the mock script of the m600: short ways up and down, and legs that last until the camera fails."""
ON_THE_GROUND = {
    "SDK_authority": "AVAILABLE",
    "homepoint_status": "VALID",
    "flight_status": "ON_GROUND",
    "axes_authority": "AVAILABLE",
    "heading_authority": "AVAILABLE",
    "depthmap_source": "NONE",
    "slam_status": "IDLE",
    "zed_status": "OK",
    "lidar_status": "OK",
}
ON_A_LEG = {"flight_status": "IN_AIR", "axes_authority": "USED", "depthmap_source": "ZED", "slam_status": "RUNNING"}
GRANTED = {"depthmap_source": "LIDAR"}
"""Effect of the grant of `lidar_depthmap`, the first skill of the LiDAR branch. No other skill has it."""
PATIENCE = 30.0


def robot_time(script: Path) -> float:
    """The same time on a network without latency, where only waits in robot time take any [s]."""
    model = ROBOT.load_skillset()
    played = load_scripts(scripts_for(ROBOT.skillset, script), model)
    network = InProcessNetwork(latency=0.0)
    for node in (*make_mock_managers(model, played), MockWorld(model, played)):
        network.attach(node)
    interface = SkillsetInterface(network.bus("observer"), model, client="observer")

    def wait_for(states: dict[str, str]) -> float:
        assert network.run_until(lambda: states.items() <= interface.states.items(), PATIENCE), states
        return network.now()

    wait_for(ON_THE_GROUND)
    network.attach(MissionNode(MISSION, model, MISSION.read_options({})))
    failed = wait_for(ON_A_LEG)
    interface.trigger("zed_status", "FAILED", lambda answer: None)
    return wait_for(GRANTED) - failed


class Observer:
    """The functional layer that reports the failure, and a client that sees the grant."""

    def __init__(self, bus: ZenohBus, mission: PeerProcess) -> None:
        self._bus, self._mission = bus, mission
        self._model = ROBOT.load_skillset()
        self._interface = SkillsetInterface(bus, self._model, client="benchmark")

    def fly(self) -> float:
        """Fly until the camera fails and the LiDAR branch has its first grant; the time between them [s]."""
        self._wait_for(ON_THE_GROUND)
        self._mission.send({})
        self._wait_for(ON_A_LEG)
        failed = time.monotonic()
        self._interface.trigger("zed_status", "FAILED", lambda answer: None)
        self._wait_for(GRANTED)
        granted = time.monotonic()
        self._bus.ask(Keys(self._model.name).mission_abort, encode(AbortMission()), lambda answer: None)
        landed = self._mission.receive(PATIENCE)
        assert landed["over"], landed
        self._interface.trigger("zed_status", "OK", lambda answer: None)
        return granted - failed

    def _wait_for(self, states: dict[str, str]) -> None:
        reached = self._bus.run_until(lambda: states.items() <= self._interface.states.items(), PATIENCE)
        assert reached, f"{dict(self._interface.states)} instead of {states}"


@contextmanager
def running_system(folder: Path, additions: Path) -> Iterator[Observer]:
    """A mocked m600 with its mission process, and its observer."""
    with ExitStack() as stack:
        robot = replace(ROBOT, name="benchmark", clock="wall")
        scripts = scripts_for(robot.skillset, additions)
        launcher = stack.enter_context(Launcher(robot.name, robot.skillset.stem, folder, clock="wall"))
        launcher.start(mock_processes(robot, scripts=scripts, run={"run_dir": str(folder)}))
        command = script("recovery_mission.py", launcher.endpoint, robot.name, str(robot.skillset))
        mission = stack.enter_context(PeerProcess(command))
        bus = ZenohBus("observer", robot.name, launcher.endpoint)
        stack.callback(bus.close)
        yield Observer(bus, mission)


def main() -> None:
    """Measure flights until standard input ends."""
    with tempfile.TemporaryDirectory() as folder:
        additions = Path(folder) / "recovery.mock.toml"
        additions.write_text(SCRIPT, encoding="utf-8")
        by_design = robot_time(additions)
        with running_system(Path(folder), additions) as observer:

            def measure(question: dict[str, Any]) -> dict[str, Any]:
                return {"times": [observer.fly() for _ in range(question["flights"])], "by_design": by_design}

            serve(measure)


if __name__ == "__main__":
    main()
