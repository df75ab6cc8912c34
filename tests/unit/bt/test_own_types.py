"""Types of a user's own robot as options and inputs of missions, in Python files and in tree files."""

from __future__ import annotations

import enum
import os
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Literal

import msgspec
import pytest

from skillwing.bt_missions.checking.mission_check import check_mission, offline_context
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.library import find_draft
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.mission.options import default_values, option_text, parse_options, read_values
from skillwing.bt_missions.xml.port_types import LANGUAGE_NAMES
from skillwing.dsl import parse
from skillwing.services.errors import InvalidOptionError

FORKLIFT = parse(
    """
    skillset forklift {
        enum Side { LEFT RIGHT }
        type Pose { x: float64 [m]  y: float64 [m]  heading: float64 [rad] }
        type Rack { pose: Pose  side: Side }
        resource axes { initial IDLE  IDLE -> USED  USED -> IDLE }
        skill drive {
            input { target: Pose  side: Side = LEFT  via: Pose[] }
            effect { take: axes -> USED  release: axes -> IDLE }
            precondition { free: resource=(axes == IDLE)  success take }
            result { ARRIVED: apply=release }
        }
    }
    """,
    "forklift.skillset",
)
WORKS = offline_context(FORKLIFT)


class Pose(msgspec.Struct, frozen=True):
    x: float
    y: float
    heading: float = 0.0


class Side(enum.StrEnum):
    LEFT = "LEFT"
    RIGHT = "RIGHT"


class Rack(msgspec.Struct, frozen=True):
    pose: Pose
    side: Side = Side.LEFT


class Options(MissionOptions):
    shelf: Pose = Pose(1.0, 2.0)
    side: Side = Side.LEFT
    mode: Literal["slow", "fast"] = "slow"
    stops: tuple[Pose, ...] = ()
    rack: Rack | None = None


class Fetch(Mission):
    name = "fetch"
    summary = "Fetch a pallet."
    Options = Options

    def __init__(self, **inputs: Any) -> None:
        self._inputs = {"via": [], **inputs}

    def build(self, context: Any, options: Any) -> MissionTrees:
        inputs = {"target": options.shelf, **self._inputs}
        return MissionTrees(
            SkillAction("go", context, "drive", inputs), SkillAction("back", context, "drive", inputs), Progress
        )


# --- inputs


@pytest.mark.parametrize("target", [Pose(1.0, 2.0), {"x": 1.0, "y": 2.0, "heading": 0.0}, lambda: Pose(1.0, 2.0)])
def test_an_input_may_be_a_structure_of_the_generated_interface(target: object) -> None:
    assert check_mission(Fetch(target=target, via=[Pose(0.0, 0.0)], side=Side.LEFT), FORKLIFT, Options()) == []


def test_a_structure_that_does_not_fit_is_reported() -> None:
    found = [each.text for each in check_mission(Fetch(target=Rack(Pose(1.0, 2.0))), FORKLIFT, Options())]
    assert any("target.x" in text for text in found), found
    assert any("There is no field `target.pose`" in text for text in found), found


def test_a_value_without_a_plain_form_is_a_problem_of_its_leaf() -> None:
    found = [each.text for each in check_mission(Fetch(target=object()), FORKLIFT, Options())]
    assert any(text.startswith("Leaf `go`: drive: `target` is") for text in found), found


# --- options of missions in Python


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (["shelf=1,2,0"], Options(shelf=Pose(1.0, 2.0))),
        (['shelf={"x": 1, "y": 2}'], Options(shelf=Pose(1.0, 2.0))),
        (["stops=1,2,0; 3,4,1"], Options(stops=(Pose(1.0, 2.0), Pose(3.0, 4.0, 1.0)))),
        (["stops=1,2,0"], Options(stops=(Pose(1.0, 2.0),))),
        (['rack={"pose": {"x": 1, "y": 2}, "side": "RIGHT"}'], Options(rack=Rack(Pose(1.0, 2.0), Side.RIGHT))),
        (["rack=null", "side=RIGHT", "mode=fast"], Options(side=Side.RIGHT, mode="fast")),
    ],
)
def test_options_of_own_types_are_read(words: list[str], options: Options) -> None:
    assert read_values(parse_options(words), Options) == options


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        (
            "shelf=1,2",
            "`shelf` is `1,2`; it takes `x`, `y` and `heading` with commas between their values, or JSON, "
            "as in `shelf=1,2,0`.",
        ),
        ("shelf=1,far,0", "`shelf` is `1,far,0`; it takes `x`, `y` and `heading` with"),
        ("shelf=1,nan,0", "`shelf` is `1,nan,0`; it takes `x`, `y` and `heading` with"),
        ("side=UP", "`side` is `UP`; it takes one of `LEFT` and `RIGHT`, as in `side=LEFT`."),
        ("mode=idle", "`mode` is `idle`; it takes one of `fast` and `slow`, as in `mode=slow`."),
        ("stops=1", "`stops` is `1`; it takes `x`, `y` and `heading` with commas between their values, or JSON, and "),
    ],
)
def test_a_wrong_value_is_answered_with_what_the_type_takes(word: str, sentence: str) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        read_values(parse_options([word]), Options)
    assert str(caught.value).startswith(sentence)


def test_defaults_of_own_types_are_shown_as_they_are_typed() -> None:
    shown = {name: option_text(value) for name, value in default_values(Options)}
    assert shown == {"shelf": "1,2,0", "side": "LEFT", "mode": "slow", "stops": "", "rack": "null"}
    nested = msgspec.to_builtins(Rack(Pose(1.0, 2.0)))
    assert read_values(parse_options([f"rack={option_text(nested)}"]), Options).rack == Rack(Pose(1.0, 2.0))


# --- options of tree files

TREE = """
<root BTCPP_format="4" main_tree_to_execute="fetch">
  <BehaviorTree ID="fetch"><drive target="{shelf}" side="{side}" via="{via}"/></BehaviorTree>
  <BehaviorTree ID="rescue"><AlwaysSuccess/></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="fetch">
      <input_port name="shelf" type="TYPE" default="1,2,0"/>
      <input_port name="side" type="Side" default="LEFT"/>
      <input_port name="via" type="Pose[]" default="1,2,0; 3,4,0"/>
    </SubTree>
  </TreeNodesModel>
</root>
"""


def fetched(folder: Path, *words: str, kind: str = "Pose") -> tuple[dict[str, Any], list[str]]:
    """Inputs of the leaf, and the problems."""
    file = folder / "fetch.xml"
    file.write_text(TREE.replace("TYPE", kind).strip())
    mission = find_draft(str(file))
    options = mission.read_options(parse_options(words))
    found = [problem.text for problem in check_mission(mission, FORKLIFT, options)]
    leaf = next(mission.draft(WORKS, options)[0].root.iterate())
    return (leaf.inputs if isinstance(leaf, SkillAction) else {}), found


def test_a_tree_file_has_options_of_the_types_of_the_skillset(tmp_path: Path) -> None:
    pose = {"x": 1.0, "y": 2.0, "heading": 0.0}
    inputs, found = fetched(tmp_path)
    assert found == []
    assert inputs == {"target": pose, "side": "LEFT", "via": [pose, {"x": 3.0, "y": 4.0, "heading": 0.0}]}


@pytest.mark.parametrize("word", ["shelf=5,6,7", 'shelf={"x": 5, "y": 6, "heading": 7}', "shelf=[5,6,7]"])
def test_options_of_a_tree_file_are_given_as_values_or_as_json(tmp_path: Path, word: str) -> None:
    inputs, found = fetched(tmp_path, word, "side=RIGHT", "via=8,9,0")
    assert found == []
    assert inputs["target"] == {"x": 5.0, "y": 6.0, "heading": 7.0}
    assert (inputs["side"], inputs["via"]) == ("RIGHT", [{"x": 8.0, "y": 9.0, "heading": 0.0}])


@pytest.mark.parametrize(
    ("words", "kind", "sentence"),
    [
        ([], "Pos", "Option `shelf` is of type `Pos`; did you mean `Pose`?"),
        ([], "Angle", "Option `shelf` is of type `Angle`; it may be `double`, `float`, "),
        (["shelf=1,2"], "Pose", "Option `shelf` is `1,2`; it takes 3 values separated by commas, x,y,heading."),
        (["side=UP"], "Pose", "Option `side` is 'UP'; it takes one of `LEFT` and `RIGHT`."),
    ],
)
def test_a_value_or_a_type_that_does_not_fit_is_a_problem_of_the_file(
    tmp_path: Path, words: list[str], kind: str, sentence: str
) -> None:
    _, found = fetched(tmp_path, *words, kind=kind)
    assert len(found) == 1, found
    assert found[0].startswith(sentence)


@pytest.mark.parametrize("kind", LANGUAGE_NAMES)
def test_an_option_has_any_scalar_type_of_a_tree_skill(tmp_path: Path, kind: str) -> None:
    first = '<input_port name="shelf" type="TYPE" default="1,2,0"/>'
    more = f'<input_port name="more" type="{kind}" default="{"true" if kind == "bool" else 7}"/>'
    file = tmp_path / "fetch.xml"
    file.write_text(TREE.replace(first, f"{first}{more}").replace("TYPE", "Pose").strip())
    mission = find_draft(str(file))
    assert check_mission(mission, FORKLIFT, mission.read_options({})) == []
    with nullcontext() if kind == "string" else pytest.raises(InvalidOptionError):
        mission.read_options({"more": "much"})


# --- packages beside a mission


@pytest.mark.parametrize("place", ["", "missions/"])
def test_a_mission_file_imports_the_package_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setenv("PYTHONPATH", "")
    package = f"forklift_{len(place)}"
    folder = tmp_path / package
    (folder / "missions").mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "sizes.py").write_text("REACH = 3.0\n")
    file = (folder / place if place else tmp_path) / "reach.py"
    file.write_text(
        f"from {package}.sizes import REACH\n"
        "from skillwing.bt_missions.mission.mission import Mission\n"
        "class Reach(Mission):\n"
        '    name = f"reach {REACH:g}"\n'
        '    summary = "Reach."\n'
        "    def build(self, context, options): ...\n"
        "MISSION = Reach()\n"
    )
    assert find_draft(str(file)).name == "reach 3"
    assert os.environ["PYTHONPATH"] == str(tmp_path), "processes that the mission starts find it, too"
