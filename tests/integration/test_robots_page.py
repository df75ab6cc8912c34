"""The functional layer of docs/robots.md: its bridge, its table and its manager are run as they are printed."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from skillwing.dsl.commands.generate import generate
from skillwing.services.robot import Robot, find_robot
from skillwing.services.testing import FakeLayer, SkillsetInProcess

ROOT = Path(__file__).parents[2]


@pytest.fixture
def rover(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Robot]:
    """The generated package of the rover, with the page's three files in their places."""
    page = (ROOT / "docs" / "robots.md").read_text("utf-8")
    bridge, table, turn = re.findall(r"```py\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    generate(ROOT / "examples" / "rover" / "rover.skillset", Path("rover"))
    for name, source in {"bridge.py": bridge, "robot.py": table, "skills/turn.py": turn}.items():
        (tmp_path / "rover" / name).write_text(source, encoding="utf-8")
    yield find_robot(str(tmp_path / "rover"))
    for name in [name for name in sys.modules if name.split(".")[0] == "rover"]:
        del sys.modules[name]


def test_the_page_tells_how_a_layer_is_made_known(rover: Robot) -> None:
    (bridge,) = rover.functional_layer({})
    module, _, factory = bridge.factory.partition(":")
    node = getattr(importlib.import_module(module), factory)(bridge.options)
    manager = importlib.import_module("rover.skills.turn").TurnManager
    layer = FakeLayer()
    with SkillsetInProcess(rover.skillset, [manager], layer=layer, nodes=[node]) as system:
        system.run(2.0)
        assert system.reading("battery").value == 87.0
        assert not system.reading("battery").stale

        aligned = system.start_skill("turn", heading=1.0, rate=0.5)
        system.run(1.0)
        assert aligned.state == "RUNNING"
        system.run(1.5)
        assert aligned.terminal is not None and aligned.terminal.label == "S_ALIGNED"

        stopped = system.start_skill("turn", heading=3.0, rate=0.1)
        layer.publish("fl/stop_button", b"1")
        system.run(1.0)
        assert stopped.terminal is not None and stopped.terminal.invariant == "released"
        assert system.states["wheels"] == "PARKED"
