"""Compositions of `.rlc` files: their trees, their mistakes, and their runs on the real managers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from skillwing.bt_missions.checking.mission_check import check_mission
from skillwing.bt_missions.tree_skill.called import called_skill_problems
from skillwing.bt_missions.tree_skill.checks import body_problems, read_body
from skillwing.bt_missions.tree_skill.hooks import TreeHooks
from skillwing.bt_missions.xml.document import Element, TreeFileError
from skillwing.bt_missions.xml.mission import load_mission
from skillwing.bt_missions.xml.tree_file import TreeFile
from skillwing.dsl import load, parse
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import State
from skillwing.services.testing import SkillsetInProcess

TEXT = """
skillset forklift {
    enum Gear { SLOW FAST }
    type Pose { x: float64 [m]  y: float64 [m] }
    resource wheels { initial PARKED  PARKED -> DRIVING  DRIVING -> PARKED }
    resource fork { initial IDLE  IDLE -> MOVING  MOVING -> IDLE }
    skill drive {
        input { target: Pose  gear: Gear = SLOW }
        output { stopped_at: Pose }
        effect { roll: wheels -> DRIVING  park: wheels -> PARKED }
        precondition { parked: resource=(wheels == PARKED)  success roll }
        interrupt { apply=park }
        lost { apply=park }
        result { success ARRIVED: apply=park  failure BLOCKED: apply=park  failure LOST_WAY: apply=park }
    }
    skill pick {
        effect { move: fork -> MOVING  still: fork -> IDLE }
        precondition { free: resource=(fork == IDLE)  success move }
        interrupt { apply=still }
        lost { apply=still }
        result { success LIFTED: apply=still  failure MISSED: apply=still }
    }
    skill shunt {
        effect { roll: wheels -> DRIVING  park: wheels -> PARKED }
        precondition { parked: resource=(wheels == PARKED)  success roll }
        interrupt { apply=park }
        result { success DONE: apply=park }
    }
    skill honk {
        input { duration: float64 [s] in 0.1..5.0 = 1.0  text: string = "" }
        result { success DONE }
    }
    skill fetch {
        input { rack: Pose }
        result { success FETCHED  failure LEFT }
    }
    skill tour {
        input { rack: Pose }
        result { success FETCHED  failure LEFT }
    }
}
"""
ROOT = Path(__file__).parents[3]
FORKLIFT = parse(TEXT, "forklift.skillset")
RACK = {"x": 5.0, "y": 2.0}
HEAD = "def fetch(robot: forklift, rack: Pose) -> (success FETCHED | failure LEFT) {"


class Pose(msgspec.Struct, frozen=True):
    x: float
    y: float


class DriveInputs(msgspec.Struct, frozen=True):
    target: Pose
    gear: str = "SLOW"


class StoppedAt(msgspec.Struct, frozen=True):
    stopped_at: Pose


class FetchInputs(msgspec.Struct, frozen=True):
    rack: Pose


def composition(folder: Path, body: str, before: str = "") -> Path:
    file = folder / "fetch.rlc"
    file.write_text(f"{before}{HEAD}\n    {body}\n}}\n")
    return file


def read(folder: Path, body: str, before: str = "") -> TreeFile:
    return read_body(composition(folder, body, before), FORKLIFT)


def shape(element: Element) -> str:
    """A tree as text: the tag, and the children in brackets."""
    below = ", ".join(map(shape, element.children))
    return f"{element.tag}[{below}]" if below else element.tag


def found(folder: Path, body: str, before: str = "") -> list[str]:
    """The problems as `LINE:COLUMN TEXT`, without the excerpt."""
    source = read(folder, body, before)
    problems = body_problems(source, FORKLIFT, "fetch", folder)
    for each in problems:
        assert "^" in each.text, "each has an excerpt"
    return [f"{each.line}:{each.column} {each.text.partition(chr(10))[0]}" for each in problems]


# --- trees


@pytest.mark.parametrize(
    ("body", "tree"),
    [
        ("robot.drive(rack)", "drive"),
        ("forklift.drive(rack)", "drive"),
        ("robot.drive(rack) >> robot.pick() >> robot.honk()", "Sequence[drive, pick, honk]"),
        ("robot.drive(rack) || robot.pick()", "Parallel[drive, pick]"),
        ("robot.drive(rack) >> robot.honk() || robot.pick()", "Parallel[Sequence[drive, honk], pick]"),
        ("robot.drive(rack) >> (robot.honk() || robot.pick())", "Sequence[drive, Parallel[honk, pick]]"),
        ("race(robot.drive(rack), robot.pick())", "Parallel[drive, pick]"),
        ("race(robot.drive(rack) >> robot.honk(), robot.pick())", "Parallel[Sequence[drive, honk], pick]"),
        (
            "match robot.pick() { | success LIFTED => robot.honk() | _ => failure }",
            "OnEnding[OnEnding[pick, honk], AlwaysFailure]",
        ),
    ],
)
def test_operators_nest_and_bind_as_documented(tmp_path: Path, body: str, tree: str) -> None:
    source = read(tmp_path, body)
    assert not source.problems
    assert shape(source.trees["fetch"]) == tree
    assert found(tmp_path, body) == []


def test_the_last_composition_is_the_skill_and_calls_the_others(tmp_path: Path) -> None:
    leave = "def leave(robot: forklift, to: Pose) { robot.drive(target=to, gear=FAST) }"
    before = f'include "forklift.rl"\n// moves away\n{leave}\n'
    source = read(tmp_path, 'leave(robot, rack) >> leave(robot, "0,0")', before)
    assert source.main == "fetch"
    assert [(port.name, port.kind) for port in source.main_model.ports] == [("rack", "Pose")]
    assert source.main_model.metadata == {"success": "FETCHED", "failure": "LEFT"}
    assert source.trees["leave"].attributes == {"name": "drive", "target": "{to}", "gear": "FAST"}
    assert [child.attributes["to"] for child in source.trees["fetch"].children] == ["{rack}", "0,0"]
    assert body_problems(source, FORKLIFT, "fetch", tmp_path) == []


def test_a_branch_can_use_the_output_of_its_skill(tmp_path: Path) -> None:
    body = "match robot.drive(rack) { | failure BLOCKED where => robot.drive(where) | _ => success FETCHED }"
    assert found(tmp_path, body) == []
    leaf = read(tmp_path, body).trees["fetch"].children[0].children[0]
    assert leaf.attributes["stopped_at"] == "{where}"


def test_the_example_of_the_documentation_fits_the_forklift(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "robots.md").read_text()
    file = tmp_path / "fetch.rlc"
    file.write_text(next(block for block in page.split("```") if block.startswith("text\ndef ")).removeprefix("text"))
    skillset = load(ROOT / "examples" / "forklift" / "forklift.skillset")
    source = read_body(file, skillset)
    assert [port.name for port in source.main_model.ports] == ["rack", "exit"]
    assert body_problems(source, skillset, "fetch", tmp_path) == []


# --- mistakes

MISTAKES = [
    ("robot.drve(rack)", "2:11 There is no skill `drve`; did you mean `drive`?"),
    ("robt.drive(rack)", "2:5 There is no robot `robt` here; did you mean `robot`?"),
    ("robot.drive(targt=rack)", "2:17 `drive` has no input `targt`; did you mean `target`?"),
    ("robot.drive()", "2:11 `drive` lacks its input `target`: a structure"),
    ("robot.drive(rack, FAST, 1)", "2:29 `drive` has 2 inputs. Remove this argument."),
    ("robot.drive(rack, target=rack)", "2:23 `drive` gets `target` twice. Remove one of them."),
    ("robot.drive(rak)", "2:17 Nothing is called `rak` here; did you mean `rack`?"),
    ("robot.honk(rack)", "2:16 `rack` is a structure"),
    ('robot.honk("long")', "2:16 `duration` is `long`; it takes"),
    ("robot.honk(9.0)", "2:16 `duration` is 9 s; it has to lie between 0.1 and 5 s."),
    ("robot.honk(text=2)", '2:21 `text` is `2`; it takes a text. Write `"2"`.'),
    ("robot.drive(rack, FST)", "2:23 Nothing is called `FST` here; did you mean `FAST`?"),
    ("robot.drive(robot)", "2:17 `robot` is the robot, which is no value."),
    ("drive(rack)", "2:5 `drive` is a skill. Write `forklift.drive(...)`."),
    ("fetc(robot, rack)", "2:5 There is no composition `fetc`; did you mean `fetch`?"),
    ("robot.drive(rack) || robot.drive(rack)", "2:23 Under `||` skill `drive` would run twice"),
    ("race(robot.drive(rack), robot.drive(rack))", "2:5 Under `race` skill `drive` would run twice"),
    ("robot.drive(rack) >> robot.pick() || robot.shunt()", "2:39 Under `||` both `drive` and `shunt` take wheels"),
    ("race(robot.pick())", "2:5 A race has two branches at least."),
    ("robot.fetch(rack)", "2:5 Leaf `fetch`: the tree of `fetch` starts `fetch` itself"),
    ("fetch(robot, rack)", "2:5 Tree `fetch` contains itself and would never end."),
    (
        "match robot.pick() { | success LIFTD => success | _ => failure }",
        "2:36 `pick` has no result `LIFTD`; did you mean `LIFTED`?",
    ),
    ("match robot.pick() { | failure LIFTED => success | _ => failure }", "2:28 `LIFTED` of `pick` is a success."),
    (
        "match robot.drive(rack) { | success ARRIVED => success }",
        "2:5 This `match` has no branch for `failure BLOCKED` and `failure LOST_WAY`.",
    ),
    ("match robot.pick() { | _ => failure | success LIFTED => success }", "2:43 This branch is never reached."),
    (
        "match robot.pick() { | success LIFTED => success | success LIFTED => failure | _ => failure }",
        "2:64 `LIFTED` has two branches.",
    ),
    (
        "match robot.pick() { | success LIFTED => success FETCHD | _ => failure }",
        "2:54 `fetch` has no success `FETCHD`; did you mean `FETCHED`?",
    ),
    ("match robot.pick() { | success LIFTED where => success | _ => failure }", "2:43 `pick` has no outputs."),
    ("robot.drive(rack) > robot.pick()", "2:23 `>` stands where `>>` belongs. Write `>>`."),
    ("mach robot.pick() { | _ => failure }", "2:5 `mach` is no word of the language. Did you mean `match`?"),
    ("match robot.pick() { | _ -> failure }", "2:30 `->` stands where `=>` belongs."),
]


def test_a_parameter_with_an_unknown_type_is_one_mistake(tmp_path: Path) -> None:
    before = "def leave(to: Poze) { forklift.drive(to) >> forklift.honk() }\n"
    assert found(tmp_path, "leave(rack)", before) == ["1:15 There is no type `Poze`; did you mean `Pose`?"]


def test_a_parameter_cannot_have_the_name_of_an_attribute(tmp_path: Path) -> None:
    before = "def leave(name: Pose) { forklift.drive(name) }\n"
    assert found(tmp_path, "leave(rack)", before) == ["1:11 A parameter cannot be called `name`. Choose another name."]


def test_a_file_without_a_composition_is_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "fetch.rlc").write_text("// nothing yet")
    (problem,) = read_body(tmp_path / "fetch.rlc", FORKLIFT).problems
    assert problem.text.startswith("There is no composition. Write `def NAME() { ... }`.")


@pytest.mark.parametrize(("body", "told"), MISTAKES)
def test_a_mistake_is_told_once_at_its_place(tmp_path: Path, body: str, told: str) -> None:
    (problem,) = found(tmp_path, body)
    assert problem.startswith(told)


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    body = "robot.drve(rack) >> robot.honk(9.0) > robot.pick(1) || match robot.pick() { | success LIFTD => success }"
    before = "def a(robot: forklift, to: Poze) { robot.honk() }\ndef a() { forklift.hnk() }\n"
    assert [problem.partition(" ")[0] for problem in found(tmp_path, body, before)] == [
        *("1:28", "2:5", "4:11", "4:36", "4:41", "4:54", "4:57", "4:60", "4:91"),
    ]


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (
            "robt.drive(rack) | robot.honk(9.0)",
            ["5 There is no robot `robt`", "22 `|` has no place here in the composition.", "35 `duration` is"],
        ),
        (
            "(robt.drive(rack) | robot.honk(9.0)) >> robot.pik()",
            ["6 There is no robot", "23 `|` has no place here", "36 `duration` is 9 s", "51 There is no skill `pik`"],
        ),
        (
            "race(robt.drive(rack), robot.honk(9.0) | robot.pik())",
            [
                "10 There is no robot",
                "39 `duration` is 9 s",
                "44 `|` stands where `,` belongs",
                "52 There is no skill `pik`",
            ],
        ),
        (
            "robt.drive(rack), robot.honk(9.0)",
            ["5 There is no robot", "21 `,` has no place here in the composition", "34 `duration` is 9 s"],
        ),
    ],
)
def test_a_misplaced_sign_hides_no_other_mistake(tmp_path: Path, body: str, told: list[str]) -> None:
    problems = found(tmp_path, body)
    assert len(problems) == len(told), problems
    for problem, start in zip(problems, told, strict=True):
        assert problem.startswith(f"2:{start}")


def test_problems_of_one_line_are_told_from_left_to_right(tmp_path: Path) -> None:
    body = "robot.drive(rak) >> robot.honk(9.0) | robt.pick() || robot.shunt(1) >> robot.pik()"
    columns = [int(problem.partition(" ")[0].partition(":")[2]) for problem in found(tmp_path, body)]
    assert columns == sorted(columns)
    assert len(columns) == 6
    error = TreeFileError(Path("fetch.rlc"), read(tmp_path, body).problems)
    places = [int((problem.place or "").split(":")[2]) for problem in error.problems]
    assert places == sorted(places)
    assert len(places) == 6


def test_a_skill_that_runs_twice_is_one_mistake(tmp_path: Path) -> None:
    (problem,) = found(tmp_path, "robot.drive(rack) || robot.drive(rack) >> robot.shunt()")
    assert problem.startswith("2:23 Under `||` skill `drive` would run twice at the same time")


def test_a_problem_has_the_marked_line_of_its_file(tmp_path: Path) -> None:
    (problem,) = read(tmp_path, "robot.drve(rack)").problems
    assert str(problem.in_file(Path("fetch.rlc"))).splitlines() == [
        "fetch.rlc:2:11: There is no skill `drve`; did you mean `drive`?",
        "   |",
        " 2 |     robot.drve(rack)",
        "   |           ^^^^",
    ]


# --- runs


@pytest.fixture
def robot(tmp_path: Path) -> Callable[..., SkillsetInProcess]:
    (tmp_path / "forklift.skillset").write_text(TEXT)

    def make(
        body: str, before: str = "", *others: type[SkillHooks[Any, Any, Any]], **runs: MockRun
    ) -> SkillsetInProcess:
        class FetchManager(TreeHooks):
            skill = "fetch"
            Inputs = FetchInputs
            skillset_file = tmp_path / "forklift.skillset"
            tree_file = composition(tmp_path, body, before)

        script = MockScript(skills={name: (run,) for name, run in runs.items()})
        return SkillsetInProcess(FORKLIFT, [FetchManager, *others], script=script)

    return make


Make = Callable[..., SkillsetInProcess]


def test_a_sequence_starts_a_step_when_the_one_before_has_succeeded(robot: Make) -> None:
    bench = robot("robot.drive(rack) >> robot.pick()", drive=MockRun(delay=2.0), pick=MockRun(delay=2.0))
    goal = bench.start_skill("fetch", rack=RACK)
    bench.run(1.0)
    bench.assert_states(wheels="DRIVING", fork="IDLE")
    bench.run(2.0)
    bench.assert_states(wheels="PARKED", fork="MOVING")
    goal.assert_ended("S_FETCHED", within=10.0)


def test_a_failure_ends_a_sequence(robot: Make) -> None:
    bench = robot("robot.pick() >> robot.drive(rack)", pick=MockRun(result="MISSED"))
    bench.start_skill("fetch", rack=RACK).assert_ended("S_LEFT", within=10.0)
    assert "drive" not in bench.story()


def test_a_parallel_succeeds_with_its_last_branch_and_fails_with_the_first(robot: Make) -> None:
    bench = robot("robot.drive(rack) || robot.pick()", drive=MockRun(delay=5.0), pick=MockRun(delay=1.0))
    goal = bench.start_skill("fetch", rack=RACK)
    bench.run(0.5)
    bench.assert_states(wheels="DRIVING", fork="MOVING")
    bench.run(2.0)
    assert goal.state is State.RUNNING
    goal.assert_ended("S_FETCHED", within=10.0)


def test_a_failed_branch_interrupts_the_others_of_a_parallel(robot: Make) -> None:
    slow, fails = MockRun(delay=60.0, stop_delay=1.0), MockRun(delay=1.0, result="MISSED")
    bench = robot("robot.drive(rack) || robot.pick()", drive=slow, pick=fails)
    bench.start_skill("fetch", rack=RACK).assert_ended("S_LEFT", within=5.0)
    bench.assert_states(wheels="PARKED", fork="IDLE")


@pytest.mark.parametrize(("result", "ending"), [("LIFTED", "S_FETCHED"), ("MISSED", "S_LEFT")])
def test_the_first_branch_to_end_decides_a_race(robot: Make, result: str, ending: str) -> None:
    first = MockRun(delay=1.0, result=result)
    bench = robot("race(robot.drive(rack), robot.pick())", drive=MockRun(delay=60.0), pick=first)
    bench.start_skill("fetch", rack=RACK).assert_ended(ending, within=5.0)
    bench.assert_states(wheels="PARKED", fork="IDLE")


MATCH = """match robot.drive(rack) {
        | success ARRIVED => robot.pick()
        | failure BLOCKED => success FETCHED
        | _ => failure
    }"""


@pytest.mark.parametrize(
    ("result", "ending", "picked"),
    [("ARRIVED", "S_FETCHED", True), ("BLOCKED", "S_FETCHED", False), ("LOST_WAY", "S_LEFT", False)],
)
def test_a_match_goes_on_by_the_result(robot: Make, result: str, ending: str, picked: bool) -> None:
    bench = robot(MATCH, drive=MockRun(result=result))
    bench.start_skill("fetch", rack=RACK).assert_ended(ending, within=10.0)
    assert ("pick" in bench.story()) is picked


def test_values_reach_the_skills_of_a_called_composition(robot: Make, tmp_path: Path) -> None:
    targets: list[Pose] = []

    class DriveManager(SkillHooks[DriveInputs, StoppedAt, None]):
        skill = "drive"
        Inputs, Outputs = DriveInputs, StoppedAt

        def on_dispatch(self, goal: Goal[DriveInputs]) -> None:
            targets.append(goal.inputs.target)
            self.terminated(goal.id, "BLOCKED", StoppedAt(Pose(3.0, 4.0)))

    again = "match robot.drive(rack) { | failure BLOCKED where => leave(where) | _ => failure }"
    before = "def leave(to: Pose) { forklift.pick() >> forklift.drive(to) }\n"
    bench = robot(again, before, DriveManager)
    bench.start_skill("fetch", rack=RACK).assert_ended("S_LEFT", within=10.0)
    assert targets == [Pose(5.0, 2.0), Pose(3.0, 4.0)]


def test_a_failed_branch_of_a_match_is_its_end(robot: Make) -> None:
    bench = robot(MATCH, pick=MockRun(result="MISSED"))
    bench.start_skill("fetch", rack=RACK).assert_ended("S_LEFT", within=10.0)


@pytest.mark.parametrize(
    "body",
    [
        "robot.drive(rack) >> robot.pick()",
        "robot.drive(rack) || robot.pick()",
        "race(robot.drive(rack), robot.pick())",
        MATCH,
    ],
)
def test_an_interrupt_waits_until_the_skills_have_stopped(robot: Make, body: str) -> None:
    slow = MockRun(delay=60.0, stop_delay=2.0)
    bench = robot(body, drive=slow, pick=slow)
    goal = bench.start_skill("fetch", rack=RACK)
    bench.run(1.0)
    goal.interrupt()
    bench.run(1.0)
    assert goal.state is State.INTERRUPTING
    bench.assert_states(wheels="DRIVING")
    goal.assert_ended("IT", within=3.0)
    bench.assert_states(wheels="PARKED", fork="IDLE")


# --- the start of a manager


def test_a_manager_refuses_a_wrong_composition(robot: Make) -> None:
    with pytest.raises(TreeFileError) as caught:
        robot("robot.drve(rack) >> robot.pck()")
    assert "fetch.rlc:2:11: There is no skill `drve`; did you mean `drive`?" in str(caught.value)
    assert "fetch.rlc:2:31: There is no skill `pck`; did you mean `pick`?" in str(caught.value)


def test_a_manager_refuses_a_resource_that_is_taken_twice(robot: Make) -> None:
    with pytest.raises(TreeFileError, match="both `drive` and `shunt` take wheels"):
        robot("robot.drive(rack) || robot.shunt()")


def test_a_manager_refuses_a_ring_with_the_tree_of_another_skill(robot: Make, tmp_path: Path) -> None:
    (tmp_path / "tour.rlc").write_text("def tour(rack: Pose) { forklift.fetch(rack) }")
    with pytest.raises(TreeFileError) as caught:
        robot("robot.pick() >> robot.tour(rack)")
    text = "2:21: These skills would start each other for ever: `fetch` -> `tour` -> `fetch`. Change a tree."
    assert text in str(caught.value)


def test_resources_that_the_tree_of_a_called_skill_takes_count_as_well(tmp_path: Path) -> None:
    (tmp_path / "tour.rlc").write_text("def tour(rack: Pose) { forklift.drive(rack) }")
    assert found(tmp_path, "robot.tour(rack) >> robot.drive(rack) || robot.pick()") == []
    assert found(tmp_path, "robot.pick() >> robot.tour(rack) || robot.shunt()") == [
        "2:38 Under `||` both `drive` of `tour` and `shunt` take wheels, at the same time."
    ]


def test_a_resource_of_the_skill_itself_cannot_be_taken_by_a_called_tree(tmp_path: Path) -> None:
    (tmp_path / "tour.rlc").write_text("def tour(rack: Pose) { forklift.shunt() }")
    (tmp_path / "drive.rlc").write_text('def drive() {\n    forklift.tour("0,0")\n}')
    (problem,) = body_problems(read_body(tmp_path / "drive.rlc", FORKLIFT), FORKLIFT, "drive", tmp_path)
    text = "Leaf `tour` starts `shunt`: `parked` of `shunt` never holds while `drive` runs: `wheels` is DRIVING."
    assert (problem.line, problem.column) == (2, 5)
    assert problem.text.startswith(text)


def test_a_broken_tree_of_another_skill_is_its_own_manager_s_business(robot: Make, tmp_path: Path) -> None:
    (tmp_path / "tour.xml").write_text("<root")
    robot("robot.pick()").start_skill("fetch", rack=RACK).assert_ended("S_FETCHED", within=5.0)


# --- the check of a mission

MISSION = """<root BTCPP_format="4" main_tree_to_execute="day">
  <BehaviorTree ID="day"><Sequence><fetch rack="1,2"/><honk/></Sequence></BehaviorTree>
</root>
"""


def mission_problems(folder: Path) -> list[str]:
    (folder / "day.xml").write_text(MISSION)
    mission = load_mission(folder / "day.xml")
    options = mission.read_options({})
    assert check_mission(mission, FORKLIFT, options) == []
    problems = called_skill_problems(mission, FORKLIFT, options, folder)
    return [str(problem).partition("\n")[0].removeprefix(f"{folder}/") for problem in problems]


def test_a_mission_check_reports_mistakes_of_the_trees_of_its_skills(tmp_path: Path) -> None:
    composition(tmp_path, "robot.drive(rack) || robot.shunt()")
    assert mission_problems(tmp_path) == [
        "fetch.rlc:2:23: Under `||` both `drive` and `shunt` take wheels, at the same time."
    ]


def test_a_mission_check_follows_the_trees_of_its_skills(tmp_path: Path) -> None:
    composition(tmp_path, "robot.tour(rack)")
    (tmp_path / "tour.xml").write_text(MISSION.replace("<honk/>", "<hnk/>").replace('"1,2"', '"{rack}"'))
    assert [problem.partition(";")[0] for problem in mission_problems(tmp_path)] == [
        "fetch.rlc:2:5: These skills would start each other for ever: `fetch` -> `tour` -> `fetch`. Change a tree.",
        "tour.xml:2: There is no node `hnk`",
        "tour.xml:2: These skills would start each other for ever: `tour` -> `fetch` -> `tour`. Change a tree.",
    ]


def test_a_mission_check_reports_a_tree_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "fetch.xml").write_text("<tree/>")
    assert mission_problems(tmp_path) == ['fetch.xml:1: Begin with `<root BTCPP_format="4">`.']


def test_a_mission_check_is_quiet_about_sound_trees(tmp_path: Path) -> None:
    composition(tmp_path, MATCH)
    assert mission_problems(tmp_path) == []
