"""A whole robot in virtual time: the fake functional layer, the bridge, the managers, and a client."""

from __future__ import annotations

from typing import Any

from fake_layer import FakeLayer

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Answer, Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.options import imported
from skillwing.services.protocol import Keys, Record, State, Terminal, decode
from skillwing.sim_mujoco.topics import SensorStatus

SKILLSET = ROBOT.load_skillset()


class RobotRig:
    """`layer` is at a test's mercy; the rest is what flies. With `height` the drone is in the air from the start."""

    def __init__(self, *skills: str, height: float | None = None) -> None:
        self.network = InProcessNetwork()
        self.layer = FakeLayer()
        if height is not None:
            self.layer.fly_at(height)
        self.network.attach(self.layer)
        self.network.attach(DataManagerNode(SKILLSET))
        self.network.attach(ResourceManagerNode(SKILLSET))
        self.bridge_bus = self.network.attach(RobotBridge(SKILLSET))
        self.manager_buses: dict[str, Bus] = {}
        for skill in skills:
            hooks = imported({"hooks": ROBOT.hooks[skill]}, "hooks")()
            self.manager_buses[skill] = self.network.attach(SkillManagerNode(hooks, SKILLSET))
        bus = self.network.bus("client")
        self.records: list[Record] = []
        bus.subscribe(
            Keys(SKILLSET.name).timeline,
            lambda sample: self.records.append(decode(sample.payload, Record)),
            events=True,
        )
        self.interface = SkillsetInterface(bus, SKILLSET, client="client")
        for sensor in ("zed", "lidar"):
            self.layer.report_health(sensor, SensorStatus.OK, f"{sensor}-ok")
        self.run(2.0)

    def run(self, seconds: float) -> None:
        self.network.run_for(seconds)

    def start(self, skill: str, **inputs: Any) -> GoalHandle:
        """Start a skill and wait until it runs, or is over already."""
        goal = self.interface.start(skill, inputs)
        assert self.network.run_until(lambda: goal.state in (State.RUNNING, State.TERMINATED), 5.0), goal
        return goal

    def end(self, goal: GoalHandle, within: float = 60.0) -> Terminal:
        """Wait for the terminal answer, and a moment more for what `on_ended` has to do."""
        assert self.network.run_until(lambda: goal.done, within), goal
        self.run(1.0)
        assert goal.terminal is not None
        return goal.terminal

    def interrupt(self, goal: GoalHandle) -> Terminal:
        self.interface.interrupt(goal)
        return self.end(goal)

    def trigger(self, resource: str, target: str) -> None:
        """Drive an extern transition past the bridge, for a moment."""
        answers: list[Answer] = []
        self.interface.trigger(resource, target, answers.append)
        assert self.network.run_until(lambda: bool(answers), 1.0)

    def motions(self) -> list[str]:
        """The names of the motions that guidance has been asked for."""
        return [type(command.motion).__name__ for command in self.layer.commands]
