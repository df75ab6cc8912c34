"""A whole skillset in one process whose resource manager keeps its steps: killed, restarted, and replayed."""

from __future__ import annotations

from pathlib import Path

import pytest
from recorded_crane import SOURCE

from skillwing.dsl import load
from skillwing.services.bus import Bus, Node
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.core import invariants
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import make_resource_manager
from skillwing.services.mocking import make_mock_skill
from skillwing.services.names import JOURNAL_FILE, STEPS_FOLDER
from skillwing.services.protocol import DataSample, Ending, FireExtern, Keys, encode
from skillwing.services.replay.replaying import replay_folder


class Robot:
    """Managers and mocks of the crane; its resource manager is made as a process makes it."""

    def __init__(self, run_dir: Path) -> None:
        self._file = run_dir / "crane.skillset"
        self._file.write_text(SOURCE)
        journal = str(run_dir / JOURNAL_FILE)
        self._options = {"skillset": str(self._file), "robot": "r1", "journal": journal, "contended": False}
        self.network = InProcessNetwork()
        model = load(self._file)
        self.keys = Keys(model.name)
        for node in (DataManagerNode(model), *(make_mock_skill(model, skill.name, None) for skill in model.skills)):
            self.network.attach(node)
        self.manager: tuple[Node, Bus] = self.begin_manager()
        self.bus = self.network.bus("client/test")
        self.interface = SkillsetInterface(self.bus, model, client="test")
        self._data = {name: self.bus.advertise(self.keys.data(name)) for name in ("wind", "limit")}

    def begin_manager(self) -> tuple[Node, Bus]:
        node = make_resource_manager(self._options)
        self.manager = node, self.network.attach(node)
        return self.manager

    def measure(self, **values: float) -> None:
        for name, value in values.items():
            self._data[name].put(encode(DataSample(name=name, value=value, t=self.network.now())))
        self.run(0.1)

    def trigger(self, resource: str, target: str) -> None:
        request = FireExtern(resource=resource, target=target, source="grid")
        self.bus.ask(self.keys.resource_extern, encode(request), lambda _: None)
        self.run(0.1)

    def run(self, seconds: float) -> None:
        self.network.run_until(lambda: False, seconds)


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """A run in which a lift lost its power after its judge had been killed and had come back."""
    robot = Robot(tmp_path)
    robot.measure(wind=3.0, limit=2.0)
    goal = robot.interface.start("lift", {})
    robot.run(0.3)
    robot.manager[1].close()
    robot.begin_manager()
    robot.measure(wind=4.0)
    robot.trigger("hook", "TAKEN")
    robot.trigger("power", "OFF")
    robot.run(1.0)
    assert goal.terminal is not None
    assert goal.terminal.ending is Ending.INVARIANT_VIOLATED
    robot.manager[0].detach()
    return tmp_path


def test_a_life_with_a_death_in_it_is_replayed(run_dir: Path) -> None:
    replayed = replay_folder(run_dir / STEPS_FOLDER)
    assert replayed.divergence is None
    assert replayed.files == 2
    assert replayed.steps >= 8, "two data, attach, begin, resume, a datum, two transitions"


def test_a_core_that_judges_otherwise_is_found_out(run_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(invariants, "first_violation", lambda *_: None)
    found = replay_folder(run_dir / STEPS_FOLDER).divergence
    assert found is not None
    assert found.file.name == "2.msgpack"
    assert isinstance(found.event, FireExtern)
    assert found.event.target == "OFF"
    assert [each["type"] for each in found.then["publications"] if "type" in each] == ["violated"]
    assert [each["type"] for each in found.now["publications"] if "type" in each] == []
