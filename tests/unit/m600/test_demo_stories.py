"""Plans of the demo and its failures."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from skillwing.bt_missions.library import find_mission
from skillwing.dsl.model import UnknownNameError
from skillwing.evaluation.demo.story import CAMERA_FAILS_AT, Story, make_story
from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.link.radio import CRITICAL, POOR, Radio, occlusion_zones
from skillwing.sim_mujoco.scenario.format import RadioOptions
from skillwing.sim_mujoco.world.kinds import make_site


def story(mission: str, *, fault: bool = True, fault_at: float | None = None, scenario: Path | None = None) -> Story:
    return make_story(mission, 1, fault=fault, fault_at=fault_at, scenario=scenario)


@pytest.mark.parametrize(("fault_at", "at"), [(None, CAMERA_FAILS_AT), (60.0, 60.0), (0.0, 0.0)])
def test_the_camera_fails_on_command(fault_at: float | None, at: float) -> None:
    assert [fault["at"] for fault in story("mapping", fault_at=fault_at).robot["faults"]] == [at]


@pytest.mark.parametrize("mission", ["mapping", "inspection"])
def test_without_a_fault_nothing_fails_and_the_mission_takes_its_options(mission: str) -> None:
    told = story(mission, fault=False)
    assert told.happens == "no fault"
    assert not told.robot.get("faults")
    assert not told.robot.get("link")
    find_mission(mission).read_options(told.options)


def test_the_link_gets_worse_round_the_building_and_recovers_on_the_way_home() -> None:
    told = story("inspection")
    assert told.robot["link"] == {"shadow": True}
    target = make_site(1, told.world).target
    assert target is not None
    radio = Radio(RadioOptions(zones=occlusion_zones(target)))
    (x, y, _), radius, height = told.options["center"], told.options["radius"], told.options["height"]
    west, south, east = ((x - radius, y, height), (x, y - radius, height), (x + radius, y, height))
    carried = [radio.at(30.0, place).bandwidth for place in (west, south, east)]
    assert carried == [pytest.approx(4e6, rel=0.1), pytest.approx(POOR * 1e6), pytest.approx(CRITICAL * 1e6)]


def test_a_link_may_fail_at_a_time_instead_of_a_place() -> None:
    radio = Radio(msgspec.convert(story("inspection", fault_at=40.0).robot["link"], RadioOptions))
    before, after = (radio.at(t, (0.0, 0.0, 10.0)).bandwidth for t in (39.9, 40.0))
    assert before > 1e6 > CRITICAL * 1e6 == after


def test_a_scenario_takes_the_place_of_the_fault(tmp_path: Path) -> None:
    file = tmp_path / "calm.toml"
    file.write_text("wind = [1.0, 0.0, 0.0]\n")
    told = story("inspection", scenario=file)
    assert (told.happens, told.robot["scenario"]) == ("scenario calm.toml", str(file))
    assert "link" not in told.robot
    file.write_text("wnd = 1\n")
    with pytest.raises(InvalidOptionError, match=r"docs/sensors\.md"):
        story("inspection", scenario=file)


@pytest.mark.parametrize(
    ("fault", "fault_at", "scenario", "sentence"),
    [
        (False, 40.0, None, "Leave out --fault-at or --no-fault"),
        (True, 40.0, Path("storm.toml"), "Leave out --no-fault and --fault-at, or the scenario"),
        (False, None, Path("storm.toml"), "Leave out --no-fault and --fault-at, or the scenario"),
    ],
)
def test_options_that_contradict_are_refused(
    fault: bool, fault_at: float | None, scenario: Path | None, sentence: str
) -> None:
    with pytest.raises(InvalidOptionError, match=sentence):
        story("mapping", fault=fault, fault_at=fault_at, scenario=scenario)


def test_what_the_demo_does_not_know_is_named() -> None:
    with pytest.raises(UnknownNameError, match="did you mean `mapping`"):
        story("maping")
