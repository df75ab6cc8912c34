"""`skillwing new-skill --tree`: a tree file becomes a skill of a robot."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest
from command_line import run_command

from skillwing.dsl import load
from skillwing.services.testing import SkillsetInProcess

TEXT = (Path(__file__).parents[2] / "examples" / "forklift" / "forklift.skillset").read_text()


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    package = Path("hall")
    package.mkdir()
    (package / "forklift.skillset").write_text(TEXT)
    assert run_command("generate", "hall/forklift.skillset", "-o", "hall").code == 0
    return package


TOUR = """<root BTCPP_format="4" main_tree_to_execute="tour">
  <BehaviorTree ID="tour"><Sequence><drive target="{first}"/><honk/></Sequence></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="tour">
      <input_port name="first" type="Pose" default="1,2,0"/>
      <input_port name="speed" type="double" default="1.5"/>
    </SubTree>
  </TreeNodesModel>
</root>
"""


def test_a_tree_file_becomes_a_skill_with_its_manager_and_its_test(robot: Path) -> None:
    Path("tour.xml").write_text(TOUR)
    said = run_command("new-skill", "tour", "-s", "hall/forklift.skillset", "--tree", "tour.xml")
    assert said.code == 0, said
    skill = load(robot / "forklift.skillset").skill("tour")
    assert [(each.name, str(each.type.name), each.default) for each in skill.inputs] == [
        ("first", "Pose", None),
        ("speed", "float64", 1.5),
    ]
    sys.path.append(str(Path.cwd()))
    managers = importlib.import_module("hall.skills.tour")
    bench = SkillsetInProcess(load(robot / "forklift.skillset"), [managers.TourManager], data={"battery": 80.0})
    bench.start_skill("tour", first={"x": 1.0, "y": 2.0, "heading": 0.0}).assert_ended("S_DONE", within=10.0)
    assert "body_problems" in (robot / "tests" / "test_tour.py").read_text()


COMPOSITION = """def tour(robot: forklift, first: Pose) -> (success SEEN | failure LOST) {
    match robot.drive(first) {
        | success ARRIVED => robot.honk()
        | failure BLOCKED => failure LOST
    }
}
"""


def test_a_composition_becomes_a_skill_with_its_results(robot: Path) -> None:
    Path("tour.rlc").write_text(COMPOSITION)
    said = run_command("new-skill", "tour", "-s", "hall/forklift.skillset", "--tree", "tour.rlc")
    assert said.code == 0, said
    assert "runs hall/skills/tour.rlc" in said.out
    skill = load(robot / "forklift.skillset").skill("tour")
    assert [(each.name, str(each.type.name)) for each in skill.inputs] == [("first", "Pose")]
    assert [(each.name, each.success) for each in skill.results] == [("SEEN", True), ("LOST", False)]
    assert (robot / "skills" / "tour.rlc").read_text() == COMPOSITION
    assert 'with_name("tour.rlc")' in (robot / "skills" / "tour.py").read_text()


def test_a_mission_check_reads_the_trees_of_the_skills(robot: Path) -> None:
    Path("tour.rlc").write_text(COMPOSITION)
    Path("day.xml").write_text(
        '<root BTCPP_format="4"><BehaviorTree ID="day"><tour first="1,2,0"/></BehaviorTree></root>'
    )
    run_command("new-skill", "tour", "-s", "hall/forklift.skillset", "--tree", "tour.rlc")
    check = ("mission", "check", "day.xml", "--skillset", "hall/forklift.skillset")
    assert run_command(*check).code == 0
    (robot / "skills" / "tour.rlc").write_text(COMPOSITION.replace("honk()", "tour(first)"))
    said = run_command(*check)
    assert said.code == 1
    assert "skills/tour.rlc:3:30: Leaf `tour`: the tree of `tour` starts `tour` itself" in said.out


def test_a_composition_with_mistakes_changes_nothing(robot: Path) -> None:
    Path("tour.rlc").write_text(COMPOSITION.replace("honk()", "hnk()").replace("BLOCKED", "BLOKED"))
    said = run_command("new-skill", "tour", "-s", "hall/forklift.skillset", "--tree", "tour.rlc")
    assert said.code == 2
    assert "tour.rlc:3:36: There is no skill `hnk`; did you mean `honk`?" in said.error
    assert "tour.rlc:4:19: `drive` has no result `BLOKED`; did you mean `BLOCKED`?" in said.error
    assert " 4 |         | failure BLOKED => failure LOST" in said.error
    assert (robot / "forklift.skillset").read_text() == TEXT


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<honk/>", "<hnk/>", "tour.xml:2: There is no node `hnk`; did you mean `honk`?"),
        ("<honk/>", '<tour first="1,2,0"/>', "starts `tour` itself"),
        ('type="Pose"', 'type="Place"', "is of type `Place`, which forklift does not have"),
    ],
)
def test_a_tree_that_does_not_fit_changes_nothing(robot: Path, old: str, new: str, told: str) -> None:
    Path("tour.xml").write_text(TOUR.replace(old, new))
    said = run_command("new-skill", "tour", "-s", "hall/forklift.skillset", "--tree", "tour.xml")
    assert said.code == 2
    assert told in said.error
    assert (robot / "forklift.skillset").read_text() == TEXT
    assert not (robot / "skills" / "tour.py").exists()
