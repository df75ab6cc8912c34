"""The drone under test: skill managers of the M600 with the real bridge, on a functional layer without physics."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from m600_layer import M600Layer

from skillwing.m600.bridge.node import RobotBridge
from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics.sensors import SensorStatus
from skillwing.services.managers.hooks import F, I, O, SkillHooks
from skillwing.services.testing import SkillTest
from skillwing.services.testing.in_process import HooksFactory

SKILLSET = ROBOT.load_skillset()
START_UP = 2.0
"""Time until the bridge has set every resource to the robot's state [s]."""


class Drone(SkillTest[I, O, F]):
    """One skill of the drone, healthy and ready; in the air at `height` if one is given.

    A test sets its context in `layer`: the bridge brings the resources to these states.
    """

    def __init__(
        self, hooks: Callable[[], SkillHooks[I, O, F]], others: Iterable[HooksFactory] = (), height: float | None = None
    ) -> None:
        self._m600 = M600Layer(height)
        super().__init__(SKILLSET, hooks, others, layer=self._m600, nodes=(RobotBridge(SKILLSET),))
        for sensor in ("zed", "lidar"):
            self.layer.report_health(sensor, SensorStatus.OK, f"{sensor}-ok")
        self.run(START_UP)

    @property
    def layer(self) -> M600Layer:
        return self._m600
