"""Values that pass through a tree: from outputs of skills and readings of the robot to inputs of later skills."""

from __future__ import annotations

import pytest
from fake_interface import FakeMission
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.common import Status
from py_trees.composites import Sequence
from tree_files import mission_of, problems_of, with_tree

from skillwing.bt_missions.checking.declared_values import units_agree
from skillwing.bt_missions.checking.preflight import tree_problems
from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry, MissingValueError
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import MissionTrees
from skillwing.bt_missions.subtrees.flow_control import ValueSwitch
from skillwing.bt_missions.xml.writer import NotWritableError, write_mission
from skillwing.dsl import parse
from skillwing.dsl.model import Skillset

CRANE: Skillset = parse("""
skillset crane {
    type Spot { x: float64 [m]  y: float64 [m] }
    enum Load { NONE LIGHT HEAVY }
    data {
        spot:  Spot          period=0.1
        mass:  float64 [kg]  period=1.0
        load:  Load          period=1.0
        lifts: int32         period=1.0
        names: string[]      period=1.0
    }
    skill move {
        input { to: Spot  speed: float64 [m/s] in 0.1..5.0 = 1.0 }
        output { at: Spot  to: Spot  way: float64 [m] }
        result {
            success THERE
            failure STUCK
        }
    }
    skill lift {
        input { height: float64 [m]  count: int32 = 1  label: string = "x"  load: Load = LIGHT }
        output { count: int32  lifted: Load }
        result {
            success UP
        }
    }
}
""")


@pytest.fixture
def crane() -> FakeMission:
    return FakeMission(CRANE)


def built(tree: str, fake: FakeMission) -> Behaviour:
    loaded = mission_of(with_tree(tree))
    return loaded.build(fake.context, loaded.Options()).root


def move(fake: FakeMission, name: str, to: object, /, **entries: BlackboardEntry) -> SkillAction:
    return SkillAction(name, fake.context, "move", {"to": to}, outputs=entries)


OUT_AND_BACK = '<Sequence><move to="1,2" at="{where}"/><move to="{where}" speed="2"/></Sequence>'


def test_an_output_of_a_skill_is_the_input_of_a_later_one(crane: FakeMission) -> None:
    root = built(OUT_AND_BACK, crane)
    root.tick_once()
    crane.goals[0].end("S_THERE", success=True, output={"at": {"x": 0.5, "y": 2.0}, "way": 2.0})
    root.tick_once()
    assert crane.goals[1].inputs == {"to": {"x": 0.5, "y": 2.0}, "speed": 2.0}


def test_the_same_in_python(crane: FakeMission) -> None:
    where = BlackboardEntry("where")
    steps = [move(crane, "out", {"x": 1.0, "y": 2.0}, at=where), move(crane, "back", where)]
    root = Sequence("both", memory=True, children=steps)
    root.tick_once()
    crane.goals[0].end("S_THERE", success=True, output={"at": {"x": 0.5, "y": 2.0}})
    root.tick_once()
    assert crane.goals[1].inputs == {"to": {"x": 0.5, "y": 2.0}}


def test_a_failed_goal_with_an_output_sets_it_too_and_one_without_keeps_the_value(crane: FakeMission) -> None:
    where = BlackboardEntry("where")
    leaf = move(crane, "out", {"x": 1.0, "y": 2.0}, at=where)
    with pytest.raises(MissingValueError):
        where()
    for label, output in (("S_STUCK", {"at": {"x": 7.0, "y": 0.0}}), ("LOST", None)):
        leaf.tick_once()
        crane.goals[-1].end(label, output=output)
        leaf.tick_once()
        assert leaf.status is Status.FAILURE
        assert where() == {"x": 7.0, "y": 0.0}


def test_a_leaf_whose_entry_has_no_value_yet_fails_with_a_sentence(crane: FakeMission) -> None:
    where = BlackboardEntry("where")
    move(crane, "out", {"x": 1.0, "y": 2.0}, at=where)
    back = move(crane, "back", where)
    back.tick_once()
    assert back.status is Status.FAILURE
    assert back.feedback_message == "move was not started: `{where}` has no value yet"
    assert crane.goals == []


def test_inputs_are_the_latest_readings_at_the_start_of_the_skill(crane: FakeMission) -> None:
    root = built('<Sequence><move to="{data.spot}"/><lift height="{data.spot.x}"/></Sequence>', crane)
    crane.interface.know("spot", {"x": 1.0, "y": 2.0})
    root.tick_once()
    crane.interface.know("spot", {"x": 3.0, "y": 4.0})
    crane.goals[0].end("S_THERE", success=True)
    root.tick_once()
    assert [goal.inputs for goal in crane.goals] == [{"to": {"x": 1.0, "y": 2.0}}, {"height": 3.0}]


@pytest.mark.parametrize(("is_known", "reason"), [(False, "spot.x is not known"), (True, "spot.x is stale")])
def test_a_leaf_fails_if_a_reading_is_stale_or_not_known(crane: FakeMission, is_known: bool, reason: str) -> None:
    leaf = SkillAction("up", crane.context, "lift", {"height": LatestReading(crane.context, "spot.x")})
    if is_known:
        crane.interface.know("spot", {"x": 1.0, "y": 2.0}, stale=True)
    leaf.tick_once()
    assert leaf.status is Status.FAILURE
    assert leaf.feedback_message == f"lift was not started: {reason}"
    assert crane.goals == []


def test_a_subtree_gets_a_reading_as_a_port(crane: FakeMission) -> None:
    sub = '<BehaviorTree ID="sub"><move to="{goal}"/></BehaviorTree>'
    loaded = mission_of(with_tree('<SubTree ID="sub" goal="{data.spot}"/>', sub))
    root = loaded.build(crane.context, loaded.Options()).root
    crane.interface.know("spot", {"x": 1.0, "y": 2.0})
    root.tick_once()
    assert crane.goals[0].inputs == {"to": {"x": 1.0, "y": 2.0}}


def test_an_output_with_the_name_of_an_input_has_a_port_of_its_own(crane: FakeMission) -> None:
    leaf = built('<move to="1,2" to_="{where}"/>', crane)
    assert isinstance(leaf, SkillAction)
    assert list(leaf.outputs) == ["to"]


def test_python_and_tree_file_are_written_alike(crane: FakeMission) -> None:
    where = BlackboardEntry("where")
    here = move(crane, "here", LatestReading(crane.context, "spot"), at=where, to=BlackboardEntry("goal"))
    load = BlackboardEntry("load")
    up = SkillAction("up", crane.context, "lift", {"height": 1.0}, outputs={"lifted": load})
    by_load = ValueSwitch("by load", load, ("HEAVY", "NONE"), [Success("heavy"), Success("none"), Failure("light")])
    root = Sequence("all", True, [here, move(crane, "back", where), up, by_load])
    text = write_mission("main", MissionTrees(root), CRANE)
    assert '<move name="here" to="{data.spot}" at="{where}" to_="{goal}" />' in text
    assert '<Switch2 name="by load" variable="{load}" case_1="HEAVY" case_2="NONE">' in text
    assert '<output_port name="at" type="Spot">' in text
    loaded = mission_of(text)
    assert write_mission("main", loaded.build(crane.context, loaded.Options()), CRANE) == text


def test_two_entries_with_one_name_are_not_written_as_one(crane: FakeMission) -> None:
    steps = [move(crane, "out", {"x": 1.0, "y": 2.0}, at=BlackboardEntry("here")) for _ in range(2)]
    with pytest.raises(NotWritableError, match=r"Two entries are called `\{here\}`"):
        write_mission("main", MissionTrees(Sequence("all", True, steps)), CRANE)


@pytest.mark.parametrize(
    ("tree", "problems"),
    [
        (OUT_AND_BACK, []),
        ('<move to="{data.spot}"/>', []),
        ('<move to="{there}"/>', ["2: `to` reads `{there}`, which nothing fills; declare it as a port of the tree."]),
        ('<move to="1,2" at="where"/>', ["2: `at` is `where`; it takes the name of an entry in braces: `{at}`."]),
        (
            '<move to="1,2" at="{data.spot}"/>',
            ["2: `at` sets `{data.spot}`, which is data of the robot; take another name."],
        ),
        (
            '<Sequence><move to="1,2" way="{way}"/><Timeout msec="{way}"><move to="1,2"/></Timeout></Sequence>',
            ["2: `msec` is `{way}`, but it has to be known before the run."],
        ),
    ],
)
def test_references_are_checked(tree: str, problems: list[str]) -> None:
    assert problems_of(with_tree(tree), CRANE) == problems


@pytest.mark.parametrize(
    ("writer", "problem"),
    [
        ('<move to="1,2" att="{a}"/>', "`move` has no port `att`; did you mean `at`?"),
        ('<move to="1,2" finally="{a}"/>', "`move` has no port `finally`; it has "),
        ('<walk into="{a}"/>', "There is no node `walk`; "),
    ],
)
def test_a_mistake_in_an_output_is_reported_once(writer: str, problem: str) -> None:
    (found,) = problems_of(with_tree(f'<Sequence>{writer}<move to="{{a}}"/></Sequence>'), CRANE)
    assert found.startswith(f"2: {problem}")


def test_an_output_cannot_replace_an_option() -> None:
    model = (
        '<TreeNodesModel><SubTree ID="main"><input_port name="spot" type="Spot" default="1,2"/></SubTree>'
        "</TreeNodesModel>"
    )
    assert problems_of(with_tree('<move to="{spot}" at="{spot}"/>', model), CRANE) == [
        "2: `at` sets `{spot}`, which has a fixed value; take another name."
    ]


SPOT = "a structure with the fields `x` and `y` (`Spot`)"


@pytest.mark.parametrize(
    ("steps", "problem"),
    [
        ('<move to="1,2" at="{a}"/>\n<move to="{a}"/>', None),
        ('<move to="1,2" way="{a}"/>\n<lift height="{a}"/>', None),
        ('<lift height="1" count_="{a}"/>\n<lift height="{a}" count="{a}"/>', None),
        ('<lift height="1" lifted="{a}"/>\n<lift height="1" load="{a}" label="{a}"/>', None),
        ('<move to="1,2"/>\n<lift height="{data.spot.x}" count="{data.lifts}" load="{data.load}"/>', None),
        (
            '<move to="1,2" way="{a}"/>\n<move to="{a}"/>',
            f"Leaf `move`: `to` reads `{{a}}`, which is a finite number in m; it takes {SPOT}.",
        ),
        (
            '<move to="1,2" at="{a}"/>\n<lift height="{a}"/>',
            f"Leaf `lift`: `height` reads `{{a}}`, which is {SPOT}; it takes a finite number in m.",
        ),
        (
            '<move to="1,2" way="{a}"/>\n<move to="1,2" speed="{a}"/>',
            "Leaf `move`: `speed` reads `{a}`, which is a finite number in m; it takes a finite number in m/s.",
        ),
        (
            '<move to="1,2"/>\n<move to="1,2" speed="{data.mass}"/>',
            "Leaf `move`: `speed` reads `{data.mass}`, which is a finite number in kg; "
            "it takes a finite number in m/s.",
        ),
        (
            '<move to="1,2"/>\n<lift height="1" count="{data.mass}"/>',
            "Leaf `lift`: `count` reads `{data.mass}`, which is a finite number in kg; "
            "it takes a whole number (int32).",
        ),
        (
            '<move to="1,2"/>\n<lift height="1" label="{data.names}"/>',
            "Leaf `lift`: `label` reads `{data.names}`, which is a list of any length: each a text; it takes a text.",
        ),
        (
            '<move to="1,2"/>\n<move to="{data.spit}"/>',
            "Leaf `move`: There is no datum `spit`; did you mean `spot`? What exists: `spot`, `mass`, `load`, `lifts` "
            "and `names`.",
        ),
        (
            '<move to="1,2"/>\n<lift height="{data.spot.z}"/>',
            "Leaf `lift`: There is no field `z` of `spot`. What exists: `x` and `y`.",
        ),
        (
            '<move to="1,2"/>\n<lift height="{data.mass.z}"/>',
            "Leaf `lift`: `mass` is a finite number, and has no field `z`.",
        ),
    ],
)
def test_type_and_unit_of_what_an_input_reads_are_checked(steps: str, problem: str | None) -> None:
    found = problems_of(with_tree(f"<Sequence>{steps}</Sequence>"), CRANE)
    assert found == ([] if problem is None else [f"3: {problem}"])


ELSE = "<AlwaysSuccess/><AlwaysSuccess/><AlwaysFailure/>"


@pytest.mark.parametrize(
    ("variable", "cases", "problem"),
    [
        ("{data.load}", ("LIGHT", "HEAVY"), None),
        ("{data.mass}", ("1", "2.5"), None),
        ("{data.load}", ("LIGHT", "HEAVI"), "`NONE`, `LIGHT` and `HEAVY` (`Load`); it is never `HEAVI`."),
        ("{data.mass}", ("1", "much"), "a finite number in kg; it is never `much`."),
        ("{data.spot}", ("1", "2"), f"{SPOT}; it takes a number, a text, or true and false."),
    ],
)
def test_the_variable_of_a_switch_is_checked(variable: str, cases: tuple[str, str], problem: str | None) -> None:
    tree = f'<Switch2 variable="{variable}" case_1="{cases[0]}" case_2="{cases[1]}">{ELSE}</Switch2>'
    found = problems_of(with_tree(tree), CRANE)
    assert len(found) == (problem is not None), found
    assert problem is None or found[0].startswith(f"2: Node `Switch2`: `variable` reads `{variable}`, which is ")
    assert problem is None or found[0].endswith(problem)


READER, WRITER = '<move name="reader" to="{a}"/>', '<move name="writer" to="1,2" at="{a}"/>'
TOO_EARLY = "2: Leaf `reader`: `to` reads `{a}` before `writer` sets it; put `writer` before this node."


@pytest.mark.parametrize(
    ("tree", "is_too_early"),
    [
        (f"<Sequence>{READER}{WRITER}</Sequence>", True),
        (f'<Fallback><Timeout msec="9">{READER}</Timeout>{WRITER}</Fallback>', True),
        (f"<Repeat num_cycles='2'>{READER}</Repeat>{WRITER}", True),
        (f"<Sequence>{WRITER}{READER}</Sequence>", False),
        (f'<Repeat num_cycles="2"><Fallback>{READER}{WRITER}</Fallback></Repeat>', False),
        (f"<ReactiveFallback>{READER}{WRITER}</ReactiveFallback>", False),
    ],
)
def test_an_entry_that_is_read_before_any_leaf_can_set_it_is_a_problem(tree: str, is_too_early: bool) -> None:
    found = problems_of(with_tree(f"<Sequence>{tree}</Sequence>"), CRANE)
    assert [each for each in found if "reads" in each] == ([TOO_EARLY] if is_too_early else [])


def test_the_rescue_may_read_what_the_mission_has_written() -> None:
    text = with_tree(WRITER).replace("<AlwaysSuccess/>", READER)
    assert problems_of(text, CRANE) == []


def test_entries_and_outputs_are_checked_in_python_too(crane: FakeMission) -> None:
    there, out = BlackboardEntry("there"), BlackboardEntry("length")
    leaves = [move(crane, "there", there), move(crane, "out", {"x": 1, "y": 2}, length=out)]
    found = tree_problems([Sequence("all", memory=True, children=leaves)], CRANE)
    assert [each.text for each in found] == [
        "Leaf `there`: `to` reads `{there}`, which nothing fills; name it in the `outputs` of a leaf.",
        "Leaf `out`: There is no output `length` of `move`. What exists: `at`, `to` and `way`.",
    ]


@pytest.mark.parametrize(
    ("one", "other", "agree"),
    [("m", "m", True), (None, "m", True), ("m", None, True), (None, None, True), ("m", "km", False)],
)
def test_units_agree_if_both_are_the_same_or_one_is_not_declared(
    one: str | None, other: str | None, agree: bool
) -> None:
    assert units_agree(one, other) is agree
