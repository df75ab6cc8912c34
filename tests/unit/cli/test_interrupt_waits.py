"""The wait of `skillwing interrupt`, in robot time that runs at another pace than the wall clock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import pytest

from skillwing.services.commands.interrupt import wait_for_end


@dataclass
class SlowRobot:
    """A bus whose robot time passes at `pace`, and the goal itself, which ends at a robot time."""

    pace: float
    ends_at: float
    wall: float = 0.0

    @property
    def done(self) -> bool:
        return self.now() >= self.ends_at

    def now(self) -> float:
        return self.wall * self.pace

    def run_until(self, done: Callable[[], bool], timeout: float) -> bool:
        deadline = self.wall + timeout
        while not done() and self.wall < deadline:
            self.wall += 0.1
        return done()


@pytest.mark.parametrize(
    ("pace", "ends_at", "wall"),
    [(1.0, 3.0, 3.0), (0.1, 3.0, 30.0), (0.1, 99.0, 100.0), (1.0, 99.0, 10.0), (0.0, 3.0, 10.0)],
    ids=["ends", "ends, slowly", "hangs, slowly", "hangs", "time stands still"],
)
def test_it_waits_as_long_as_the_goal_may_take(pace: float, ends_at: float, wall: float) -> None:
    robot: Any = SlowRobot(pace, ends_at)
    wait_for_end(robot, cast(Any, robot), 10.0)
    assert robot.wall == pytest.approx(wall, abs=0.2)
