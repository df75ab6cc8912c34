"""Drafted missions of any robot fit it, and succeed on its mocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from skillwing.bt_missions.checking.mission_check import check_mission
from skillwing.bt_missions.cli.draft import write_draft
from skillwing.bt_missions.cli.robot_choice import ChosenRobot
from skillwing.bt_missions.drafting.steps import draft_steps
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load, parse
from skillwing.dsl.model import Skillset
from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.errors import InvalidOptionError
from skillwing.services.mocking import MockScript, MockWorld, make_mock_managers
from skillwing.services.mocking.script import Reaction, When
from skillwing.services.protocol import MissionPhase
from skillwing.services.rescue_goal import RescueGoal

ROOT = Path(__file__).parents[3]
# Of the yard nothing can start before its watch has seen that the places are empty.
EXAMPLES = {path.stem: load(path) for path in sorted((ROOT / "examples").rglob("*.skillset")) if path.stem != "yard"}
CRANE = parse(
    """
    skillset crane {
        enum Side { LEFT RIGHT }
        type Position { x: float64 [m]  y: float64 [m] }
        resource load { initial LOWERED  extern LOWERED -> RAISED  extern RAISED -> LOWERED }
        resource key { initial OUT  extern OUT -> IN  extern IN -> OUT }
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        skill swing {
            input { to: Position  side: Side  speed: float64 [m/s] in 0.5..2.0 }
            effect { take: arm -> USED  release: arm -> FREE }
            precondition { high: resource=(load == RAISED)  free: resource=(arm == FREE)  success take }
            result { success DONE: apply=release }
        }
        skill watch { result { failure GONE } }
        skill lift { precondition { low: resource=(load == LOWERED and key == IN) } result { success UP } }
        skill lower { result { success DOWN } }
    }
    """,
    "crane.skillset",
)
LOWERED = RescueGoal(
    resource="load",
    state="LOWERED",
    away={"RAISED": "under load"},
    skill="lower",
    left_by=("lift",),
    reached="without load",
    action="lowering",
)
M600 = ROBOT.load_skillset()
ROBOTS = [(each, None) for each in EXAMPLES.values()] + [(CRANE, LOWERED), (M600, ROBOT.rescue_goal)]


def test_steps_follow_preconditions_and_end_at_the_rescue_goal() -> None:
    steps = draft_steps(CRANE, LOWERED)
    assert [skill.name for skill in steps.skills] == ["lift", "swing", "lower"]
    assert steps.needs == {"key": "IN"}


def test_a_need_of_a_later_step_that_would_stop_an_earlier_one_counts_for_neither() -> None:
    tractor = parse(
        """
        skillset tractor {
            resource engine { initial OFF  extern OFF -> ON  extern ON -> OFF }
            skill refill { precondition { still: resource=(engine == OFF) } result { success FULL } }
            skill drive { precondition { on: resource=(engine == ON) } result { success DONE } }
        }
        """,
        "tractor.skillset",
    )
    steps = draft_steps(tractor, None)
    assert ([skill.name for skill in steps.skills], steps.needs) == (["refill"], {})


@pytest.mark.parametrize(("skillset", "goal"), ROBOTS, ids=lambda each: each.name if isinstance(each, Skillset) else "")
@pytest.mark.parametrize("suffix", [".xml", ".py"])
def test_a_draft_fits_its_robot(tmp_path: Path, skillset: Skillset, goal: RescueGoal | None, suffix: str) -> None:
    file = tmp_path / f"first{suffix}"
    write_draft(file, ChosenRobot(skillset, goal))
    mission = find_mission(str(file))
    assert mission.name == "first"
    assert [str(each) for each in check_mission(mission, skillset, mission.read_options({}), goal)] == []
    assert draft_steps(skillset, goal).skills, "there is something to do"


@pytest.mark.parametrize("suffix", [".xml", ".py"])
def test_a_draft_succeeds_on_mocks(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"first{suffix}"
    write_draft(file, ChosenRobot(CRANE, LOWERED))
    mission = find_mission(str(file))
    network = InProcessNetwork()
    script = MockScript(
        resources={"key": "IN"},
        reactions=tuple(_reaction(skill, state) for skill, state in (("lift", "RAISED"), ("lower", "LOWERED"))),
    )
    for node in (*make_mock_managers(CRANE, script), MockWorld(CRANE, script)):
        network.attach(node)
    node = MissionNode(mission, CRANE, mission.read_options({}), rescue_goal=LOWERED)
    network.attach(node)
    assert network.run_until(lambda: node.over, 60.0)
    assert node.status.phase is MissionPhase.SUCCEEDED, node.status.text


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"skill": "swing"}, "`swing` cannot be a rescue, because it needs its inputs `to`, `side` and `speed`."),
        ({"skill": "plaice"}, "There is no skill `plaice`"),
    ],
)
def test_a_wrong_rescue_goal_is_told_and_nothing_is_written(
    tmp_path: Path, changed: dict[str, Any], problem: str
) -> None:
    file = tmp_path / "first.xml"
    with pytest.raises(InvalidOptionError) as caught:
        write_draft(file, ChosenRobot(CRANE, msgspec.structs.replace(LOWERED, **changed)))
    assert str(caught.value).startswith(f"The rescue goal of `crane` does not fit its skillset: {problem}")
    assert not file.exists()


@pytest.mark.parametrize("name", ["a&b.xml", 'a"b.py', "2nd.xml", "rescue.xml", ".xml.py"])
def test_a_file_name_that_cannot_name_a_mission_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidOptionError, match="cannot name a mission"):
        write_draft(tmp_path / name, ChosenRobot(CRANE, LOWERED))
    assert list(tmp_path.iterdir()) == []


def _reaction(skill: str, state: str) -> Reaction:
    return Reaction(when=When(starts=skill), trigger={"load": state})
