"""docs/own_mission.md, step by step."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from flights import ROOT, Flight
from typer.testing import CliRunner

from skillwing.bt_missions.commands import mission as mission_command
from skillwing.bt_missions.running.library import find_mission

PAGE = (ROOT / "docs/own_mission.md").read_text(encoding="utf-8")
PATROL, WRONG, GRANTED, PAUSABLE = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
FIRST, SECOND = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
LINE = re.compile(r'^ *<goto_straight name="out".*\n', re.MULTILINE)
GUARDED = re.compile(r'<ReactiveSequence name="patrol">\s*<ResourceIs [^>]*>(.*?)</ReactiveSequence>', re.DOTALL)
WAY = re.compile(r'<goto_straight name="out".*?<return_home[^>]*>', re.DOTALL)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def typed(*words: str) -> str:
    return CliRunner().invoke(mission_command, list(words), catch_exceptions=False).output


def change(line: str) -> None:
    file = Path("patrol.xml")
    text, changes = LINE.subn(line.replace("\\", "\\\\"), file.read_text())
    assert changes == 1
    file.write_text(text)


def test_it_begins_with_one_that_works() -> None:
    typed("new", "patrol.xml")
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"
    flight = Flight(mission=find_mission("patrol.xml"), target=(5.0, 0.0, 4.0))
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.started == ["takeoff", "goto_straight", "hover", "return_home", "land"]


def test_it_is_changed_into_a_patrol() -> None:
    typed("new", "patrol.xml")
    change(PATROL)
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"
    flight = Flight(mission=find_mission("patrol.xml"))
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.ends("goto_straight") == ["S_ARRIVED"] * 6
    assert flight.on_ground


def test_a_flight_that_fails_ends_on_the_ground() -> None:
    typed("new", "patrol.xml")
    flight = Flight(mission=find_mission("patrol.xml"), poles=((5.0, 0.0),))
    assert flight.fly().phase == "FAILED"
    assert flight.ends("goto_straight") == ["S_BLOCKED"]
    assert flight.on_ground
    assert flight.idle


def test_mistakes_are_listed_as_the_page_says() -> None:
    typed("new", "patrol.xml")
    change(WRONG)
    assert FIRST in typed("check", "patrol.xml")
    file = Path("patrol.xml")
    file.write_text(file.read_text().replace("goto_strait", "goto_straight"))
    assert SECOND in typed("check", "patrol.xml")


def test_it_stands_still_with_two_tags() -> None:
    typed("new", "patrol.xml")
    file = Path("patrol.xml")
    text = file.read_text()
    text, granted = GUARDED.subn(lambda found: found[1].join(GRANTED.split("...")), text)
    text, pausable = WAY.subn(lambda found: found[0].join(PAUSABLE.split("...")), text)
    assert granted == pausable == 1
    file.write_text(text)
    assert typed("check", "patrol.xml") == "patrol: fits m600\n"

    flight = Flight(mission=find_mission("patrol.xml"))
    flight.network.run_for(8.0)
    assert flight.node.pause() is None
    flight.network.run_for(5.0)
    assert flight.node.status.phase == "PAUSED"
    flight.drone.set("SDK_authority", "UNAVAILABLE")
    flight.network.run_for(5.0)
    assert flight.node.status.phase == "HELD"
    flight.drone.set("SDK_authority", "AVAILABLE")
    assert flight.node.resume() is None
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.on_ground


def test_the_same_in_python_flies_the_same() -> None:
    typed("new", "patrol.py")
    assert typed("check", "patrol.py") == "patrol: fits m600\n"
    flight = Flight(mission=find_mission("patrol.py"), target=(5.0, 0.0, 4.0))
    assert flight.fly().phase == "SUCCEEDED"
    assert flight.started == ["takeoff", "goto_straight", "hover", "return_home", "land"]
    typed("export", "patrol.py", "-o", "again.xml")
    assert typed("check", "again.xml") == "patrol: fits m600\n"


def test_a_name_is_not_taken_twice() -> None:
    typed("new", "patrol.py")
    with pytest.raises(Exception, match="Choose another name"):
        typed("new", "patrol.py")
