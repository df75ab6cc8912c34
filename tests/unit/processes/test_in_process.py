"""A robot in one process: who is there, and from when on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from skillwing.dsl import parse
from skillwing.dsl.model import UnknownNameError
from skillwing.services.mocking import MockScript, MockWorld, make_mock_managers
from skillwing.services.names import MOCKED_WORLD, RESOURCE_MANAGER
from skillwing.services.processes.in_process import RobotInProcess
from skillwing.services.protocol import Keys
from skillwing.services.robot import Robot

GATE = parse(
    """
    skillset gate {
        data { width: float64 period=1.0 }
        resource power { initial ON  extern ON -> OFF }
        skill wait { result { success DONE } }
    }
    """
)
SCRIPT = MockScript()
KEYS = Keys(GATE.name)


class TokenHolders:
    """Holder of a liveliness token."""

    def __init__(self, gate: RobotInProcess) -> None:
        self.there: set[str] = set()
        self._bus = gate.network.bus("watch", GATE.name)
        self._bus.watch_alive(KEYS.alive("**"), self._note)

    def _note(self, key: str, alive: bool) -> None:
        (self.there.add if alive else self.there.discard)(key)

    def after(self, seconds: float) -> set[str]:
        end = self._bus.now() + seconds
        self._bus.run_until(lambda: self._bus.now() >= end, seconds)
        return self.there


@pytest.fixture
def gate() -> Iterator[RobotInProcess]:
    with RobotInProcess(Robot(GATE.name, Path("gate.skillset"), {})) as robot:
        yield robot


def test_a_node_is_there_from_its_beginning_to_its_end(gate: RobotInProcess) -> None:
    holders = TokenHolders(gate)
    for manager in make_mock_managers(GATE, SCRIPT):
        gate.attach(manager)
    assert holders.after(0.1) >= {KEYS.alive(RESOURCE_MANAGER), KEYS.alive("skill/wait")}
    gate.kill(RESOURCE_MANAGER)
    assert KEYS.alive(RESOURCE_MANAGER) not in holders.after(0.1)
    with pytest.raises(UnknownNameError):
        gate.kill(RESOURCE_MANAGER)
    gate.close()
    assert holders.after(0.1) == set()


def test_one_that_tells_when_it_is_ready_is_not_there_before(gate: RobotInProcess) -> None:
    """The mocked world is alive once the resource manager has its data."""
    holders = TokenHolders(gate)
    gate.attach(MockWorld(GATE, SCRIPT))
    assert holders.after(1.0) == set()
    for manager in make_mock_managers(GATE, SCRIPT):
        gate.attach(manager)
    assert KEYS.alive(MOCKED_WORLD) in holders.after(5.0)
