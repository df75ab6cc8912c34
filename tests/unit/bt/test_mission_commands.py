"""Commands of `skillwing mission` that need no system."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from skillwing.bt_missions import library
from skillwing.bt_missions.cli.mission import mission
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import MissionOptions
from skillwing.bt_missions.mission.options import InvalidOptionsError, option_text, parse_options
from skillwing.bt_missions.missions.mapping import MISSION, MappingMissionOptions
from skillwing.bt_missions.xml.writer import NotWritableError
from skillwing.dsl import UnknownNameError, parse
from skillwing.services.errors import InvalidOptionError, SkillwingError
from skillwing.services.terminal.error_facts import error_facts
from skillwing.services.terminal.exit_codes import FAILED, exit_code_of

TOY = "skillset toy { skill lift { result { DONE } } }"
FORKLIFT = Path(__file__).parents[3] / "examples" / "forklift" / "forklift.skillset"


def test_options_are_read_from_words() -> None:
    words = ["route=30,0,4; 30,20,4;", "speed=1.5", "area=-10,-10,40,30"]
    assert MISSION.read_options(parse_options(words)) == MappingMissionOptions(
        route=((30.0, 0.0, 4.0), (30.0, 20.0, 4.0)), speed=1.5, area=(-10.0, -10.0, 40.0, 30.0)
    )


def test_options_are_read_from_json() -> None:
    assert parse_options(["route=[[1, 2, 3]]"]) == {"route": [[1, 2, 3]]}


@pytest.mark.parametrize("words", [["speed"], ["=3"], ["speed=1", "speed=2"], ["route=[[1,"]])
def test_words_that_are_no_options_are_refused_with_a_sentence(words: list[str]) -> None:
    with pytest.raises(InvalidOptionError, match=r"\.$"):
        parse_options(words)


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("speed=fast", "`speed` is `fast`; it takes a number from 0.1 to 5, as in `speed=2`."),
        ("speed=nan", "`speed` is `nan`; it takes a number from 0.1 to 5, as in `speed=2`."),
        ("pilot_patience=-1", "`pilot_patience` is `-1`; it takes a number of at least 0, as in `pilot_patience=120`."),
        ("time_limit=0", "`time_limit` is `0`; it takes a number above 0, as in `time_limit=900`."),
        ("height=tall", "`height` is `tall`; it takes a number from 1 to 50 or `null`."),
        ("area=1,2", "`area` is `1,2`; it takes four numbers with commas between them or `null`, as in `area=-11,"),
        ("route=1,2", "`route` is `1,2`; it takes three numbers with commas between them, and semicolons between"),
        ("route=99,0,4", "Waypoint 1 of `route` (99, 0) lies outside `area`. Move it inside, or give a larger `area`."),
    ],
)
def test_a_wrong_value_is_answered_with_what_the_option_takes(word: str, sentence: str) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        MISSION.read_options(parse_options([word]))
    assert str(caught.value).startswith(sentence)
    assert caught.value.option == word.partition("=")[0]


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["speed=fast", "time_limit=0", "hight=3"], ["hight", "speed", "time_limit"]),
        (["speed=fast", "route=99,0,4"], ["speed"]),
        (["speed", "height=1", "height=2", "route=[[1,"], ["speed", "height", "route"]),
    ],
)
def test_all_wrong_options_are_reported_at_once(words: list[str], names: list[str]) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        MISSION.read_options(parse_options(words))
    facts = error_facts(caught.value, str(caught.value), 2)["error"]
    assert list(facts.get("problems", [caught.value.option])) == names
    assert len(str(caught.value).splitlines()) == len(names)


class Rounds(MissionOptions, frozen=True, kw_only=True):
    amount: int
    plans: tuple[tuple[float, float], ...]


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ([], ["amount", "plans"]),
        (["amout=3"], ["amout", "plans"]),
        (["amout=3", "plans=1"], ["amout", "plans"]),
        (["amount=no", "plans=1,2", "nozzle=X"], ["nozzle", "amount"]),
    ],
)
def test_a_misspelt_option_is_not_missing_as_well(words: list[str], names: list[str]) -> None:
    rounds = type(MISSION)()
    rounds.Options = Rounds
    with pytest.raises(InvalidOptionsError) as caught:
        rounds.read_options(parse_options(words))
    assert list(caught.value.problems) == names


@given(
    st.lists(st.tuples(*[st.integers(-100, 300).map(lambda tenths: tenths / 10.0)] * 3), min_size=1, max_size=4),
    st.floats(0.1, 5.0),
    st.none() | st.floats(1.0, 50.0),
)
def test_options_are_read_as_they_are_shown(
    route: list[tuple[float, float, float]], speed: float, height: float | None
) -> None:
    """A default printed by `mission list` can be typed as a value."""
    options = MISSION.read_options({"route": route, "speed": speed, "height": height})
    shown = {name: option_text(value) for name, value in msgspec.to_builtins(options).items()}
    words = [f"{name}={text}" for name, text in shown.items() if text != "null"]
    again = MISSION.read_options(parse_options(words))
    assert {name: option_text(value) for name, value in msgspec.to_builtins(again).items()} == shown


def test_an_export_for_a_robot_that_the_mission_does_not_fit_says_so_in_one_sentence() -> None:
    result = CliRunner().invoke(mission, ["export", "mapping", "--skillset", str(FORKLIFT)])
    assert isinstance(result.exception, InvalidOptionError)
    assert str(result.exception).startswith("Mission `mapping` does not fit `forklift`. `skillwing mission check`")
    assert result.stdout == ""


def test_a_new_mission_names_its_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SKILLWING_ROBOT", raising=False)
    result = CliRunner().invoke(mission, ["new", "first.xml"])
    assert result.stdout.startswith("Wrote first.xml for m600, as no robot runs and none is named. Next: ")
    result = CliRunner().invoke(mission, ["new", "second.xml", "--skillset", str(FORKLIFT)])
    assert result.stdout.startswith("Wrote second.xml for forklift. Next: ")


@pytest.mark.parametrize(("option", "robot"), [("--robot", "m600"), ("--skillset", "my forklift.skillset")])
def test_a_new_mission_is_checked_against_the_robot_that_it_was_written_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, option: str, robot: str
) -> None:
    """The command that `new` prints is run as it stands; without a robot, the verdict names another one."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    Path("my forklift.skillset").write_text(FORKLIFT.read_text())
    written = CliRunner().invoke(mission, ["new", "first.xml", option, robot])
    (command,) = re.findall("Next: `(.*?)`", written.output)
    program, group, *words = shlex.split(command)
    assert (program, group, words[-2:]) == ("skillwing", "mission", [option, robot])
    checked = CliRunner().invoke(mission, words)
    assert re.fullmatch("first: fits (forklift|m600)\n", checked.output)
    if option == "--skillset":
        other = CliRunner().invoke(mission, ["check", "first.xml"])
        assert re.search(r"^first: \d+ problems with m600$", other.output, re.MULTILINE)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "patrol.txt",
            "`patrol.txt` ends neither with .xml nor with .py. Name a file that does, or an installed mission:",
        ),
        ("./patrol", "`./patrol` ends neither with .xml nor with .py."),
        ("patrol", "`patrol` ends neither with .xml nor with .py."),
        (".", "`.` is a directory. Name the file of a mission."),
        (
            "nope",
            "There is no mission `nope`. What exists: `inspection` and `mapping`. A file may be named, too",
        ),
    ],
)
def test_a_name_that_is_no_mission_is_answered_as_it_was_meant(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("patrol").touch()
    with pytest.raises((InvalidOptionError, UnknownNameError)) as caught:
        library.find_draft(name)
    assert str(caught.value).startswith(sentence)


def test_missions_of_other_robots_are_not_suggested(tmp_path: Path) -> None:
    file = tmp_path / "toy.skillset"
    file.write_text(TOY)
    caught = CliRunner().invoke(mission, ["check", "nope", "--skillset", str(file)]).exception
    text = "What exists: none. Other installed missions do not fit toy: `inspection` and `mapping`. A file may be named"
    assert text in str(caught)


def test_a_mission_of_another_robot_is_refused_with_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def connected(*_: object, **__: object) -> Iterator[object]:
        target = SimpleNamespace(rescue_goal=None, shared=False)
        yield SimpleNamespace(skillset=parse(TOY, "toy.skillset"), alive=set, target=target)

    monkeypatch.setattr("skillwing.bt_missions.cli.mission_robots.connect", connected)
    caught = CliRunner().invoke(mission, ["run", "mapping"]).exception
    assert isinstance(caught, InvalidOptionError)
    assert str(caught).startswith("Mission `mapping` is for another robot: `toy` has no resource `SDK_authority`, ")
    assert str(caught).endswith(". `skillwing mission list` shows the missions that fit.")


PATROL = """
from skillwing.bt_missions.missions.mapping import MappingMission, MappingMissionOptions

class Options(MappingMissionOptions, frozen=True, kw_only=True):
    rounds: int

class Patrol(MappingMission):
    name = "patrol"
    Options = Options

MISSION = Patrol()
"""


def test_the_list_has_missions_beside_one_that_cannot_be_loaded_and_options_without_a_default(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "patrol_to_list.py").write_text(PATROL)
    entries = [EntryPoint(name, f"{name}_to_list:MISSION", library.ENTRY_POINTS) for name in ("broken", "patrol")]
    monkeypatch.setattr(library, "entry_points", lambda group: entries)
    listed = CliRunner().invoke(mission, ["list"])
    assert re.search(r"^rounds +required *$", listed.output, re.MULTILINE)
    assert isinstance(listed.exception, SkillwingError)
    assert str(listed.exception).startswith("`broken` is installed as `broken_to_list:MISSION`, but there is no module")
    assert exit_code_of(listed.exception) == FAILED
    (entry,) = json.loads(CliRunner().invoke(mission, ["list", "--json"]).stdout)
    assert entry["mission"] == "patrol" and "rounds" not in entry["options"]


def test_the_list_of_missions_names_each_option_with_its_default() -> None:
    result = CliRunner().invoke(mission, ["list", "--json"])
    assert result.exit_code == 0
    (entry,) = [each for each in json.loads(result.output) if each["mission"] == "mapping"]
    assert entry["options"]["speed"] == 2.0
    assert "mapping" in CliRunner().invoke(mission, ["list"]).output


YARD = Path(__file__).parents[3] / "examples" / "yard"
ON_SEVERAL = ("--robot", "left=m600", "--robot", "right=m600", "--robot", f"yard={YARD}")


def test_a_mission_on_several_robots_is_exported_and_read_again(tmp_path: Path) -> None:
    written = tmp_path / "survey.xml"
    result = CliRunner().invoke(
        mission, ["export", str(YARD / "survey.xml"), "speed=1.5", *ON_SEVERAL, "-o", str(written)]
    )
    assert result.exit_code == 0, result.output
    again = find_mission(str(written))
    original = find_mission(str(YARD / "survey.xml"))
    assert (again.robots, again.needs, again.summary) == (original.robots, original.needs, original.summary)
    checked = CliRunner().invoke(mission, ["check", str(written), *ON_SEVERAL])
    assert checked.output == "survey: fits left (m600), right (m600), yard (yard)\n"
    twice = CliRunner().invoke(mission, ["export", str(written), *ON_SEVERAL])
    assert twice.output == written.read_text(encoding="utf-8")
    leaves = list(ElementTree.parse(written).iter("goto_straight"))
    assert {leaf.get("robot") for leaf in leaves} == {"left", "right"}
    assert {leaf.get("speed") for leaf in leaves} == {"1.5"}
    assert {f"rescue_{robot}" for robot in ("left", "right")} <= {
        str(tree.get("ID")) for tree in ElementTree.parse(written).iter("BehaviorTree")
    }


def test_what_a_file_of_several_robots_cannot_hold_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "chase.py"
    file.write_text(CHASE, encoding="utf-8")
    result = CliRunner().invoke(mission, ["export", str(file), *ON_SEVERAL[:4]])
    assert isinstance(result.exception, NotWritableError)
    assert str(result.exception) == "`follow` reads data of `left`, which a tag of another robot cannot."


CHASE = """
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionTrees


class Chase(Mission):
    name = "chase"
    summary = "One drone flies to where the other one is."
    robots = ("left", "right")

    def build(self, context, options):
        where = LatestReading(context, "position", robot="left")
        follow = SkillAction("follow", context, "goto_straight", {"target": where}, robot="right")
        return MissionTrees(follow, rescues={
            robot: SkillAction("land", context, "land", robot=robot) for robot in self.robots
        })


MISSION = Chase()
"""
