"""Sixty mistakes of users of a forklift: each is reported at its place, with the remedy, and several at once.

They were written before the messages were looked at.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from skillwing.bt_missions.checking.mission_check import check_mission
from skillwing.bt_missions.library import find_draft
from skillwing.bt_missions.mission.options import parse_options
from skillwing.bt_missions.mission.problems import FaultyMissionError
from skillwing.dsl import SkillsetError, load, parse
from skillwing.services.client.inputs import parse_inputs
from skillwing.services.errors import InvalidInputError, SkillwingError
from skillwing.services.terminal import cli

FOLDER = Path(__file__).parents[3] / "examples" / "forklift"
SKILLSET_TEXT = (FOLDER / "forklift.skillset").read_text()
FORKLIFT = load(FOLDER / "forklift.skillset")


class Mistake(NamedTuple):
    """A change of a right text. at: text on the line where the mistake is reported; told: pattern of the message."""

    old: str
    new: str
    at: str
    told: str


def changed(text: str, *mistakes: Mistake) -> str:
    for mistake in mistakes:
        assert mistake.old in text, mistake
        text = text.replace(mistake.old, mistake.new, 1)
    return text


def line_of(text: str, mistake: Mistake) -> int:
    return next(number for number, each in enumerate(text.splitlines(), 1) if mistake.at in each)


# --- the language ----------------------------------------------------------------------------------------------------

IN_SKILLSET = [
    Mistake(
        "parked:   resource=(wheels == PARKED)\n            still:",
        "parked:   resource=(wheels == PARKD)\n            still:",
        "PARKD",
        "[dD]id you mean `PARKED`",
    ),
    Mistake("success roll", "success rol", "success rol\n"[:-1] + "", "Did you mean `roll`"),
    Mistake("initial PARKED", "initial PARKDE", "PARKDE", "Did you mean `initial PARKED`"),
    Mistake("target: Pose", "target: Poze", "Poze", "Did you mean `Pose`"),
    Mistake("in 10.0..100.0", "in 100.0..10.0", "100.0..10.0", "Write `10.0..100.0`"),
    Mistake("= 90.0", "= 190.0", "190.0", "Change the default or the range"),
    Mistake("duration: float64 [s]", "duration: float64 [bananas]", "[bananas]", "Take a unit such as `m`"),
    Mistake("success DONE", "success DONE  failure DONE", "failure DONE", "Rename or remove one"),
    Mistake(
        "still: fork -> IDLE",
        "still { fork -> IDLE  pallet -> ON_FORK }",
        "pallet -> ON_FORK }",
        "declare the transition without `extern`",
    ),
    Mistake(
        "empty:    resource=(pallet == NONE)",
        "empty:    resource=(pallet == NONE and pallet == ON_FORK)",
        "pallet == NONE and pallet == ON_FORK",
        "can be NONE or ON_FORK when it is judged",
    ),
    Mistake("skill honk", "skill charge", "skill charge {\n        input { duration"[:14], "Rename or remove one"),
    Mistake("deadline=120.0", "deadlin=120.0", "deadlin=", "Did you mean `deadline`"),
    Mistake("success LIFTED", "sucess LIFTED", "sucess", "Did you mean `success`"),
    Mistake(
        "emergency_stop -> PRESSED }", "emergency_stp -> PRESSED }", "emergency_stp", "Did you mean `emergency_stop`"
    ),
    Mistake("timeout=5.0", "timeout 5.0", "timeout 5.0", "Write `=` here"),
    Mistake("data=(battery > 5.0)", "data=(battery > 5.0 && battery < 101.0)", "&&", "Write `and`"),
    Mistake("Gear = SLOW", "Gear = SLOOW", "SLOOW", "Did you mean `SLOW`"),
    Mistake("period=0.5\n", "period=-0.5\n", "period=-0.5", "number of seconds greater than zero"),
    Mistake("lost { apply=park }", "lost { apply=prk }", "apply=prk", "Did you mean `park`"),
    Mistake("extern NONE -> ON_FORK", "extern NONE -> ON_FROK", "ON_FROK", "Did you mean `ON_FORK`"),
]
CAUGHT_TOGETHER = range(len(IN_SKILLSET) - 1)
"""All but the last one, a misspelt state in the declaration of `pallet`, which two others are about."""


def told_of(text: str) -> list[tuple[int, str]]:
    """Line and text of each error of a skillset."""
    with pytest.raises(SkillsetError) as caught:
        parse(text, "forklift.skillset")
    return [
        (each.span.line, f"{each.message} {each.help or ''}")
        for each in caught.value.diagnostics
        if each.severity == "error"
    ]


@pytest.mark.parametrize("mistake", IN_SKILLSET, ids=lambda mistake: mistake.new[:24])
def test_a_mistake_in_a_skillset_is_told_at_its_place(mistake: Mistake) -> None:
    text = changed(SKILLSET_TEXT, mistake)
    lines = [number for number, each in enumerate(text.splitlines(), 1) if mistake.at in each]
    found = told_of(text)
    assert any(line in lines and re.search(mistake.told, said) for line, said in found), found
    assert len(found) == 1, found


def test_mistakes_in_a_skillset_are_told_all_at_once() -> None:
    mistakes = [IN_SKILLSET[index] for index in CAUGHT_TOGETHER]
    text = changed(SKILLSET_TEXT, *mistakes)
    found = told_of(text)
    for mistake in mistakes:
        assert any(re.search(mistake.told, said) for _, said in found), (mistake, found)


# --- tree files ------------------------------------------------------------------------------------------------------

XML = """<root BTCPP_format="4" main_tree_to_execute="shuttle">
  <BehaviorTree ID="shuttle">
    <Sequence name="shuttle">
      <ResourceIs name="released?" resource="emergency_stop" states="RELEASED"/>
      <drive target="{rack}" gear="FAST" success_on="S_ARRIVED" failure_on="S_BLOCKED"/>
      <pick/>
      <drive target="0,0,0"/>
      <SubTree ID="put down"/>
      <charge until="80"/>
      <DataCompare name="full?" datum="battery" sign="&gt;=" value="50"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="put down"><place/></BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="shuttle">
      <input_port name="rack" type="Pose" default="5,2,0"/>
      <MetadataFields><Metadata needs="emergency_stop: RELEASED"/></MetadataFields>
    </SubTree>
  </TreeNodesModel>
</root>
"""
IN_XML = [
    Mistake("<pick/>", "<pik/>", "<pik/>", "did you mean `pick`"),
    Mistake('<drive target="{rack}"', '<drive targt="{rack}"', "targt", "did you mean `target`"),
    Mistake('gear="FAST"', 'gear="FASTER"', "FASTER", "`SLOW` and `FAST`|[dD]id you mean `FAST`"),
    Mistake('target="0,0,0"', 'target="0,0"', 'target="0,0"', "x,y,heading"),
    Mistake('until="80"', 'until="high"', 'until="high"', "takes a finite number"),
    Mistake('until="80"', 'until="500"', 'until="500"', "between 10 and 100"),
    Mistake('target="{rack}"', 'target="{rak}"', "{rak}", "declare it as a port of the tree"),
    Mistake(
        'resource="emergency_stop"', 'resource="emergency"', 'resource="emergency"', "did you mean `emergency_stop`"
    ),
    Mistake('states="RELEASED"', 'states="RELEASD"', "RELEASD", "did you mean `RELEASED`"),
    Mistake('type="Pose"', 'type="Poze"', "Poze", "did you mean `Pose`"),
    Mistake('default="5,2,0"', 'default="5,two,0"', "two", "takes a finite number"),
    Mistake('<SubTree ID="put down"/>', '<SubTree ID="put dwn"/>', "put dwn", "did you mean `put down`"),
    Mistake('success_on="S_ARRIVED"', 'success_on="S_ARIVED"', "S_ARIVED", "did you mean `S_ARRIVED`"),
    Mistake(
        "emergency_stop: RELEASED",
        "emergency_stop: RELEASE",
        'needs="emergency_stop: RELEASE"',
        "did you mean `RELEASED`",
    ),
    Mistake('datum="battery"', 'datum="batery"', "batery", "did you mean `battery`"),
]
ALL_IN_XML = (0, 1, 2, 3, 4, 7, 9, 10, 11, 12, 13, 14)


def problems_of(file: Path, *words: str) -> list[str]:
    """Problems of a mission, without the folder of its file."""
    try:
        mission = find_draft(str(file))
        found = check_mission(mission, FORKLIFT, mission.read_options(parse_options(words)))
    except FaultyMissionError as error:
        found = list(error.problems)
    return [str(problem).removeprefix(f"{file.parent}/") for problem in found]


@pytest.mark.parametrize("mistake", IN_XML, ids=lambda mistake: mistake.new[:24])
def test_a_mistake_in_a_tree_file_is_told_at_its_place(tmp_path: Path, mistake: Mistake) -> None:
    file = tmp_path / "shuttle.xml"
    file.write_text(changed(XML, mistake))
    found = problems_of(file)
    line = line_of(file.read_text(), mistake)
    assert len(found) == 1, found
    assert found[0].startswith(f"shuttle.xml:{line}:"), found
    assert re.search(mistake.told, found[0]), found


def test_mistakes_in_a_tree_file_are_told_all_at_once(tmp_path: Path) -> None:
    mistakes = [IN_XML[index] for index in ALL_IN_XML]
    file = tmp_path / "shuttle.xml"
    file.write_text(changed(XML, *mistakes))
    found = problems_of(file)
    assert [mistake for mistake in mistakes if not any(re.search(mistake.told, each) for each in found)] == [], found


def test_the_right_tree_file_has_no_problem(tmp_path: Path) -> None:
    file = tmp_path / "shuttle.xml"
    file.write_text(XML)
    assert problems_of(file) == []


# --- Python ----------------------------------------------------------------------------------------------------------

PYTHON = """from msgspec import Struct

from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees
from skillwing.bt_missions.subtrees.composites import in_order


class Pose(Struct, frozen=True):
    x: float
    y: float
    heading: float = 0.0


class Options(MissionOptions):
    rack: Pose = Pose(5.0, 2.0)


class Fetch(Mission):
    name = "fetch"
    summary = "Fetch a pallet."
    needs = {"emergency_stop": ("RELEASED",)}
    Options = Options

    def build(self, context, options):
        root = in_order(
            "fetch",
            ResourceIs("released?", context, "emergency_stop", "RELEASED"),
            SkillAction("go", context, "drive", {"target": options.rack, "gear": "FAST"}),
            SkillAction("pick", context, "pick"),
            SkillAction("charge", context, "charge", {"until": 80.0}),
            DataCompare("full?", context, "battery", ">=", 50.0),
        )
        return MissionTrees(root)


MISSION = Fetch()
"""
IN_PYTHON = [
    Mistake('"drive", {', '"drve", {', '"drve"', "did you mean `drive`"),
    Mistake('"gear": "FAST"', '"geer": "FAST"', '"geer"', "did you mean `gear`"),
    Mistake('"gear": "FAST"', '"gear": "FASTER"', "FASTER", "`SLOW` and `FAST`"),
    Mistake('"target": options.rack, ', "", '"drive", {"gear"', "`target` is missing"),
    Mistake('"until": 80.0', '"until": "80"', '"until": "80"', "takes a finite number"),
    Mistake('"until": 80.0', '"until": 500.0', '"until": 500.0', "between 10 and 100"),
    Mistake('"emergency_stop", "RELEASED")', '"emergency_stop", "RELEASD")', '"RELEASD")', "did you mean `RELEASED`"),
    Mistake('"battery", ">="', '"batery", ">="', '"batery"', "did you mean `battery`"),
    Mistake('("RELEASED",)', '("OFF",)', "class Fetch", "What exists: `RELEASED` and `PRESSED`"),
    Mistake("from msgspec import Struct", "from msgspek import Struct", "msgspek", "fix the import"),
    Mistake(
        "        return MissionTrees(root)",
        "        return MissionTrees(root",
        "return MissionTrees(root",
        "not valid Python",
    ),
    Mistake(
        "        return MissionTrees(root)",
        "        return MissionTrees(rot)",
        "MissionTrees(rot)",
        "'rot' is not defined",
    ),
    Mistake("        return MissionTrees(root)", "        return root", "", "instead of MissionTrees"),
    Mistake("MISSION = Fetch()", "MISION = Fetch()", "", "defines no mission"),
]


@pytest.mark.parametrize("mistake", IN_PYTHON, ids=lambda mistake: mistake.new[:24])
def test_a_mistake_in_python_is_told_at_its_place(tmp_path: Path, mistake: Mistake) -> None:
    file = tmp_path / "fetch.py"
    file.write_text(changed(PYTHON, mistake))
    found = problems_of(file)
    assert len(found) == 1, found
    place = f"fetch.py:{line_of(file.read_text(), mistake)}" if mistake.at else "fetch.py"
    assert found[0].startswith(place), found
    assert re.search(mistake.told, found[0]), found


@pytest.mark.parametrize("drive", [0, 1, 2, 3])
def test_the_right_python_file_has_no_problem_and_several_mistakes_are_told_at_once(tmp_path: Path, drive: int) -> None:
    file = tmp_path / "fetch.py"
    file.write_text(PYTHON)
    assert problems_of(file) == []
    mistakes = [IN_PYTHON[index] for index in (drive, 4, 6, 7, 8)]
    file.write_text(changed(PYTHON, *mistakes))
    found = problems_of(file)
    assert [mistake for mistake in mistakes if not any(re.search(mistake.told, each) for each in found)] == [], found


# --- the command line ------------------------------------------------------------------------------------------------

COMMANDS: list[tuple[Sequence[str], str]] = [
    (("mision", "list"), "did you mean `mission`"),
    (("mission", "rn", "fetch.py"), "did you mean `run`"),
    (("mission", "check", "mappin"), "did you mean `mapping`"),
    (("mission", "check", "nothere.xml"), "There is no file `nothere.xml`"),
    (("mission", "check", "fetch.py", "rck=1,2,0"), "did you mean `rack`"),
    (("mission", "check", "fetch.py", "rack=1"), "`x`, `y` and `heading`"),
    (("mission", "check", "fetch.py", "rack"), "NAME=VALUE"),
    (("mission", "new", "fetch.py"), "There is `fetch.py` already"),
    (("mission", "new", "fetch.yaml"), "fetch.xml"),
    (("check", "nothere.skillset"), "Name one that can"),
    (("up", "--robot", "forklft"), "What exists: `m600`"),
    (("up", "--robot", "./nothere"), "no folder `./nothere`"),
]


@pytest.mark.parametrize(
    ("words", "told"), COMMANDS, ids=lambda each: " ".join(each) if isinstance(each, tuple) else ""
)
def test_a_mistake_on_the_command_line_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: Sequence[str], told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fetch.py").write_text(PYTHON)
    monkeypatch.setattr("sys.argv", ["skillwing", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    said = capsys.readouterr()
    assert ended.value.code == 2, said
    assert told in " ".join(said.err.split()), said
    assert "Traceback" not in said.err


def test_all_inputs_of_a_start_are_judged_at_once() -> None:
    with pytest.raises(InvalidInputError) as caught:
        parse_inputs(FORKLIFT.skill("drive"), ["target=1,2", "geer=FAST", "speed"])
    problems = caught.value.problems
    assert any("x,y,heading" in each for each in problems.values()), problems
    assert any("gear" in each for each in problems.values()), problems
    assert any("NAME=VALUE" in each for each in problems.values()), problems
    assert isinstance(caught.value, SkillwingError)


def test_there_are_sixty() -> None:
    assert len(IN_SKILLSET) + len(IN_XML) + len(IN_PYTHON) + len(COMMANDS) >= 60
