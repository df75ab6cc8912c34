"""docs/own_mission.md, step by step."""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from flights import M600, ROOT, Flight
from py_trees.common import Status
from typer.testing import CliRunner

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.preflight import tree_problems
from skillwing.bt_missions.cli.mission import mission as mission_command
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.subtrees.composites import in_order
from skillwing.bt_missions.xml import installed_nodes
from skillwing.services.protocol import DataReading

PAGE = (ROOT / "docs/own_mission.md").read_text(encoding="utf-8")
PATROL, WRONG, HOP, VALUES, HOME, BOTH = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
PYTHON, NODE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
(TOML,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
MISTAKES, IN_THE_AIR, MISFIT = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
LINE = re.compile(r'^ *<goto_straight name="out".*\n', re.MULTILINE)
WAY_HOME = re.compile(r"^ *<return_home .*\n", re.MULTILINE)
TREE = re.compile(r' *<BehaviorTree ID="patrol">.*?</BehaviorTree>\n', re.DOTALL)
FLOWN = ["takeoff", "zed_depthmap", "goto_straight", "hover", "return_home", "land"]
NEAR = (5.0, 0.0, 4.0)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def typed(*words: str) -> str:
    return CliRunner().invoke(mission_command, list(words), catch_exceptions=False).output


def change(what: re.Pattern[str], text: str) -> None:
    file = Path("patrol.xml")
    changed, changes = what.subn(lambda _: text, file.read_text())
    assert changes == 1
    file.write_text(changed)


def patrol(**more: object) -> Flight:
    return Flight(mission=find_mission("patrol.xml"), **more)


@pytest.mark.parametrize("name", ["patrol.xml", "patrol.py"])
def test_it_begins_with_one_that_works(name: str) -> None:
    typed("new", name)
    assert typed("check", name) == "patrol: fits m600\n"
    flight = Flight(mission=find_mission(name), target=NEAR)
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.started == FLOWN
    assert flight.ends("zed_depthmap") == ["IT"]


def test_the_same_in_python_is_the_same_tree() -> None:
    typed("new", "patrol.py")
    typed("new", "patrol.xml")
    again = typed("export", "patrol.py")
    assert again == typed("export", "patrol.xml")
    Path("again.xml").write_text(again)
    assert typed("check", "again.xml") == "patrol: fits m600\n"


def test_it_is_changed_into_a_patrol() -> None:
    typed("new", "patrol.xml")
    change(LINE, PATROL)
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"
    flight = patrol(target=NEAR)
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.ends("goto_straight") == ["S_ARRIVED"] * 6
    assert flight.on_ground


@pytest.mark.parametrize(("poles", "stopped_at"), [((), 5.0), (((3.0, 0.0),), 1.0)], ids=["free", "blocked"])
def test_it_uses_values_of_the_flight(poles: tuple[tuple[float, float], ...], stopped_at: float) -> None:
    typed("new", "patrol.xml")
    change(LINE, VALUES)
    change(WAY_HOME, HOME)
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"
    flight = patrol(target=NEAR, poles=poles)
    assert flight.fly().phase == "SUCCEEDED"
    ends = [goal.terminal for goal in flight.goals.values() if goal.skill == "goto_straight" and goal.terminal]
    stops = [end.output["stopped_at"]["x"] for end in ends if end.output]
    assert stops == pytest.approx([stopped_at, 0.0, stopped_at])
    assert flight.ends("return_home") == ["S_ARRIVED"]
    assert flight.on_ground


def test_values_of_the_flight_in_python_fit() -> None:
    found: dict[str, Any] = {
        "context": offline_context(M600),
        "options": SimpleNamespace(target={"x": 5.0, "y": 0.0, "z": 4.0}),
    }
    exec(PYTHON, found)
    assert tree_problems([in_order("all", found["out"], found["again"], found["home"])], M600) == []


def test_a_tag_of_ones_own_decides_by_the_battery(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("my_package.nodes")
    monkeypatch.setitem(sys.modules, "my_package", ModuleType("my_package"))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(NODE, module.__dict__)
    ((name, value),) = tomllib.loads(TOML)["project"]["entry-points"][installed_nodes.ENTRY_POINTS].items()
    entry = EntryPoint(name, value, installed_nodes.ENTRY_POINTS)
    monkeypatch.setattr(installed_nodes, "entry_points", lambda group, **_: [entry])
    typed("new", "patrol.xml")
    change(WAY_HOME, '<EnoughFor name="enough?" metres="{height}"/>\n')
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"
    assert '<EnoughFor name="enough?" metres="4" />' in typed("export", "patrol.xml")
    flight = patrol(target=NEAR)
    assert flight.fly().phase == "FAILED", "the toy drone does not measure its charge"
    assert flight.on_ground
    context = offline_context(M600)
    leaf = module.__dict__["EnoughFor"]("enough?", context, 1000.0)
    for charge, status in ((50.0, Status.SUCCESS), (20.0, Status.FAILURE)):
        reading = DataReading(name="battery", value=charge, t=0.0, age=0.0, stale=False)
        monkeypatch.setattr(context.interface, "reading", lambda datum, reading=reading: reading)
        leaf.tick_once()
        assert leaf.status is status


def test_an_obstacle_ends_the_flight_on_the_ground() -> None:
    typed("new", "patrol.xml")
    flight = patrol(poles=((5.0, 0.0),))
    assert flight.fly().phase == "FAILED"
    assert flight.ends("goto_straight") == ["S_BLOCKED"]
    assert flight.on_ground
    assert flight.idle


@pytest.mark.parametrize(("resource", "state"), [("battery_status", "CRITICAL"), ("zed_status", "FAILED")])
def test_a_flight_that_fails_on_the_way_lands_where_it_is(resource: str, state: str) -> None:
    typed("new", "patrol.xml")
    flight = patrol()
    flight.at(8.0, lambda: flight.drone.set(resource, state))
    assert flight.fly().phase == "FAILED"
    assert flight.started[-2:] == ["goto_straight", "land"]
    assert flight.on_ground
    assert flight.idle


@pytest.mark.parametrize(("what", "text", "told"), [(LINE, WRONG, MISTAKES), (TREE, HOP, IN_THE_AIR)])
def test_mistakes_are_listed_as_the_page_says(what: re.Pattern[str], text: str, told: str) -> None:
    typed("new", "patrol.xml")
    change(what, text)
    assert told in typed("check", "patrol.xml")


def test_a_value_of_another_type_is_found_as_the_page_says() -> None:
    typed("new", "patrol.xml")
    change(LINE, VALUES)
    change(WAY_HOME, HOME.replace("{data.position.z}", "{where}"))
    assert typed("check", "patrol.xml") == f"{MISFIT}patrol: 1 problem with m600\n"


def test_it_stands_still() -> None:
    typed("new", "patrol.xml")
    flight = patrol()
    flight.network.run_for(8.0)
    assert flight.node.pause() is None
    flight.network.run_for(3.0)
    assert flight.node.status.phase == "PAUSED"
    flight.drone.set("SDK_authority", "UNAVAILABLE")
    flight.network.run_for(3.0)
    assert flight.node.status.phase == "HELD"
    flight.drone.set("SDK_authority", "AVAILABLE")
    assert flight.node.resume() is None
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.ends("zed_depthmap") == ["IT"], "it looked ahead all the time"
    assert flight.on_ground


def test_a_name_is_not_taken_twice() -> None:
    typed("new", "patrol.py")
    with pytest.raises(Exception, match="Choose another name"):
        typed("new", "patrol.py")


def test_a_mission_on_two_drones_fits_them() -> None:
    Path("both.xml").write_text(BOTH)
    said = typed("check", "both.xml", "--robot", "left=m600", "--robot", "right=m600")
    assert said == "both: fits left (m600), right (m600)\n"
