"""A robot of which everything is mocked, with a table of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from skillwing.services.mocking.system import mock_processes, scripts_for
from skillwing.services.robot import ProcessSpec, Robot


@dataclass(frozen=True)
class MockedRobot(Robot):
    """Its managers are those of a robot, with mocks for its skills and a world below them."""

    def managers(self, run: Mapping[str, Any] = MappingProxyType({})) -> tuple[ProcessSpec, ...]:
        """What `mock_processes` says, by the script beside the skillset and with the seed of the run."""
        robot = Robot(self.name, self.skillset, self.hooks, clock=self.clock)
        return mock_processes(robot, scripts=scripts_for(self.skillset), seed=run.get("seed"), run=run)


def mocked(robot: Robot) -> MockedRobot:
    """A robot's mocks as a robot beside it, called after it: `m600-mocks`. They live in our time."""
    return MockedRobot(f"{robot.name}-mocks", robot.skillset, robot.hooks, clock="wall")
