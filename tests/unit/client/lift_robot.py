"""A small robot with generated code, and its mocks on an in-process network."""

from __future__ import annotations

import sys
from pathlib import Path

from skillwing.dsl import load, parse
from skillwing.dsl.generating.package import RobotFolder, generate, skillset_copy
from skillwing.dsl.generating.skeletons import skeletons
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking import MockScript, MockWorld, make_mock_managers

SOURCE = """
skillset lift {
    enum Load { NONE CRATE }
    type Place { floor: int64  load: Load = NONE }
    data { level: float64 [m] period=0.1 }
    resource motor { initial FREE  FREE -> USED  USED -> FREE }
    resource power { initial ON  extern ON -> OFF  extern OFF -> ON }
    resource door { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT }
    event blackout { guard resource=(power == ON)  effect { power -> OFF } }
    skill go {
        progress=0.5 { level: float64 [m] }
        input { place: Place modifiable  speed: float64 [m/s] in 0.1..2.0 = 1.0 modifiable  loud: bool = false }
        output { stopped_at: Place }
        effect { take: motor -> USED  release: motor -> FREE }
        precondition { free: resource=(motor == FREE)  on: resource=(power == ON)  success take }
        invariant { on: resource=(power == ON) violation=release }
        interrupt { apply=release timeout=2.0 }
        result {
            success ARRIVED: apply=release
            failure STUCK: apply=release post resource=(door == OPEN)
        }
    }
    skill shine { }
}
"""


def make_package(folder: Path) -> None:
    """The package of the robot, with skeletons."""
    source = folder.parent / "lift.skillset"
    source.write_text(SOURCE, encoding="utf-8")
    skillset, robot = load(source), RobotFolder(folder)
    robot.write_once(skeletons(skillset, folder.name))
    copy = skillset_copy(skillset, source, folder, SOURCE)
    robot.write({**generate(skillset, source, folder, robot.managed(skillset)), **copy})


def forget(package: str) -> None:
    """Undo the import of a package."""
    for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
        del sys.modules[name]


class MockedLift:
    """The managers of the lift, mocked, and a client's interface that knows the states."""

    def __init__(self, script: MockScript) -> None:
        self.skillset = parse(SOURCE)
        self.network = InProcessNetwork()
        for node in [*make_mock_managers(self.skillset, script), MockWorld(self.skillset, script)]:
            self.network.attach(node)
        self.bus = self.network.bus("client")
        self.interface = SkillsetInterface(self.bus, self.skillset, client="test")
        self.network.run_until(lambda: self.interface.ready, 5.0)
