"""Tree files: read, written, and refused with a place and a sentence."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fake_interface import SKILLSET, FakeMission
from hypothesis import given
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.common import OneShotPolicy, ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, OneShot, Repeat, Retry, SuccessIsFailure
from tree_files import RESCUE, mission_of, problems_of, with_tree
from typer.testing import CliRunner

from skillwing.bt_missions.checking.mission_check import check_mission, offline_context
from skillwing.bt_missions.cli.mission import mission as mission_command
from skillwing.bt_missions.leaves.branch_switch import NeverSwitched, NoteSwitch, WaitForSettled
from skillwing.bt_missions.leaves.conditions import SIGNS, DataCompare, ResourceIs
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.mission.mission import Mission, MissionTrees, Progress
from skillwing.bt_missions.missions import inspection, mapping
from skillwing.bt_missions.planning.detour import RoutePlanner
from skillwing.bt_missions.planning.waypoints import Route, WaypointWriter
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside
from skillwing.bt_missions.subtrees.decorators import Deadline, Delay, RepeatUntil, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, SequenceWithMemory, ValueSwitch
from skillwing.bt_missions.subtrees.pausing import Pausable, StateChange, WhileGranted
from skillwing.bt_missions.xml.writer import NotWritableError, write_mission
from skillwing.dsl import load

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
M600 = load(ROOT / "services/skillwing/m600/m600.skillset")
MISSIONS = ROOT / "bt_missions/skillwing/bt_missions/missions"
MAPPING = MISSIONS / "mapping.xml"


@pytest.mark.parametrize("mission", [mapping.MISSION, inspection.MISSION], ids=lambda mission: mission.name)
def test_the_tree_files_of_the_library_are_the_missions_written_in_python(mission: Mission) -> None:
    context = offline_context(M600)
    flown = find_mission(str(MISSIONS / f"{mission.name}.xml"))
    by_file = flown.build(context, flown.Options())
    by_python = mission.build(context, mission.Options())
    assert write_mission(mission.name, by_file, M600) == write_mission(mission.name, by_python, M600)
    assert flown.needs == dict(mission.needs)
    assert check_mission(flown, M600, flown.Options()) == []


def test_options_are_ports_of_the_main_tree() -> None:
    flown = find_mission(str(MAPPING))
    options = flown.read_options({"speed": "1.5", "route": [["1", "2", "3"]]})
    trees = flown.build(offline_context(M600), options)
    legs = [leaf for leaf in trees.root.iterate() if isinstance(leaf, SkillAction) and leaf.name == "goto"]
    assert [leg.inputs["speed"] for leg in legs] == [1.5]
    assert trees.progress().waypoints == 1


LEAVES = st.one_of(
    st.builds(lambda: Success("well")),
    st.builds(lambda: Failure("ill")),
    st.builds(
        lambda states, wait, question: ResourceIs(
            "camera?", offline_context(SKILLSET), "camera", *states, wait=wait, question=question
        ),
        st.lists(st.sampled_from(["OK", "FAILED"]), min_size=1, unique=True),
        st.sampled_from([0.0, 2.5]),
        st.booleans(),
    ),
    st.builds(
        lambda speed, wait, question: MayStart(
            "ready?",
            offline_context(SKILLSET),
            "go",
            None if speed is None else {"speed": speed},
            wait=wait,
            question=question,
        ),
        st.none() | st.floats(0.1, 5.0),
        st.sampled_from([0.0, 2.5]),
        st.booleans(),
    ),
    st.builds(
        lambda sign, value: DataCompare("enough?", offline_context(SKILLSET), "position.z", sign, value),
        st.sampled_from(SIGNS),
        st.one_of(st.booleans(), st.sampled_from(["high", "low"]), st.floats(-1e3, 1e3)),
    ),
    st.builds(
        lambda speed, success, patience: SkillAction(
            "go there",
            offline_context(SKILLSET),
            "go",
            {"speed": speed},
            outcomes={"S_ARRIVED": Status.SUCCESS, "S_BLOCKED": success},
            patience=patience,
        ),
        st.floats(0.1, 5.0),
        st.sampled_from([Status.SUCCESS, Status.FAILURE]),
        st.sampled_from([15.0, 3.0]),
    ),
    st.builds(lambda: NoteSwitch("why", offline_context(SKILLSET), "it", "this <&> that", 'an "other"')),
    st.builds(lambda: NeverSwitched("as planned?", offline_context(SKILLSET), "it")),
    st.builds(lambda patience: WaitForSettled("settled", offline_context(SKILLSET), patience), st.floats(0.1, 100.0)),
)


CONTEXT = offline_context(SKILLSET)
CASES = ("a", "1", "b c", "", "true", "2.5")
VARIABLES = st.sampled_from(["text", 2.0, LatestReading(CONTEXT, "datum.field")])


def _grown(children: st.SearchStrategy[Behaviour]) -> st.SearchStrategy[Behaviour]:
    some = st.lists(children, min_size=1, max_size=3)
    more = st.lists(children, min_size=3, max_size=7)
    one, every = ParallelPolicy.SuccessOnOne, ParallelPolicy.SuccessOnAll
    return st.one_of(
        st.builds(lambda memory, below: Sequence("in order", memory, below), st.booleans(), some),
        st.builds(lambda memory, below: Selector("else", memory, below), st.booleans(), some),
        st.builds(lambda policy, below: Parallel("at once", policy(), below), st.sampled_from([one, every]), some),
        st.builds(lambda below, last: alongside("beside", *below, until=last), some, children),
        st.builds(lambda kind, below: kind("turned", below), st.sampled_from([Inverter, SuccessIsFailure]), children),
        st.builds(lambda below: FailureIsSuccess("at least tried", below), children),
        st.builds(lambda count, below: Retry("again", below, count), st.integers(1, 9), children),
        st.builds(lambda count, below: Repeat("once more", below, count), st.integers(-1, 9), children),
        st.builds(
            lambda seconds, below: Deadline("soon", offline_context(SKILLSET), seconds, below),
            st.sampled_from([0.5, 900.0]),
            children,
        ),
        st.builds(lambda below: SequenceWithMemory("from there", below), some),
        st.builds(lambda below: IfThenElse("choice", *below), st.lists(children, min_size=2, max_size=3)),
        st.builds(lambda value, below: ValueSwitch("by value", value, CASES[: len(below) - 1], below), VARIABLES, more),
        st.builds(lambda seconds, child: Delay("later", CONTEXT, seconds, child), st.just(2.5), children),
        st.builds(lambda child: RunOnce("once", child), children),
        st.builds(lambda child: OneShot("first end", child, OneShotPolicy.ON_COMPLETION), children),
        st.builds(lambda first, then: OnEnding("or", first, ("NR", "S_BLOCKED"), then), children, children),
        st.builds(
            lambda below: WhileGranted(
                "unless",
                offline_context(SKILLSET),
                below,
                resource="axes",
                states=("FREE",),
                patience=2.5,
                ended_by=StateChange("camera", "FAILED"),
            ),
            children,
        ),
        st.builds(
            lambda condition, meanwhile, body: Pausable(
                "or wait", offline_context(SKILLSET), condition, meanwhile, body
            ),
            children,
            children,
            children,
        ),
    )


@given(st.recursive(LEAVES, _grown, max_leaves=8))
def test_a_tree_that_was_written_is_read_as_the_same(tree: Behaviour) -> None:
    written = write_mission("main", MissionTrees(tree, Success("safe"), Progress), SKILLSET)
    loaded = mission_of(written)
    again = loaded.build(offline_context(SKILLSET), loaded.Options())
    assert write_mission("main", again, SKILLSET) == written
    assert _shape(again.root) == _shape(tree)


def _shape(node: Behaviour) -> object:
    policy = type(node.policy).__name__ if isinstance(node, Parallel) else None
    return type(node), node.name, getattr(node, "memory", None), policy, [_shape(child) for child in node.children]


def test_what_only_python_can_do_is_not_written() -> None:
    leaf = SkillAction("go", offline_context(SKILLSET), "go", {"speed": lambda: 1.0}, on_end=print)
    with pytest.raises(NotWritableError, match="Python"):
        write_mission("main", MissionTrees(leaf, Success("safe"), Progress), SKILLSET)


@pytest.mark.parametrize(
    ("tree", "problems"),
    [
        ('<go speed="2"/>', []),
        ('<Action ID="go" speed="2" _uid="7"/>', []),
        ("<tun/>", ["2: There is no node `tun`; did you mean `turn`?"]),
        ('<go sped="2"/>', ["2: `go` has no port `sped`; did you mean `speed`?"]),
        ('<go speed="fast"/>', ["2: `speed` is `fast`; it takes a finite number."]),
        ('<go speed="9"/>', ["2: Leaf `go`: go: `speed` is 9;"]),
        ('<go speed="{fast}"/>', ["2: `speed` reads `{fast}`, which nothing fills"]),
        ('<go success_on="S_ARIVED"/>', ["2: Leaf `go`: There is no ending", "2: Leaf `go`: go can end S_BLOCKED"]),
        ('<go success_on="IT"/>', ["2: Leaf `go` maps IT to SUCCESS"]),
        ('<go leg_of="{plan}"/>', ["2: `leg_of` reads `{plan}`"]),
        (
            '<Sequence><PointAbove height="3" target="{up}"/><go patience="{up}"/></Sequence>',
            ["2: `patience` is `{up}`, but it has to be known before the run."],
        ),
        ("<Sequence/>", ["2: `Sequence` has no children"]),
        ("<Inverter><go/><go/></Inverter>", ["2: `Inverter` has 2 children; it takes one."]),
        ("<go><go/></go>", ["2: `go` is a leaf"]),
        ('<go _skipIf="x"/>', ["2: `_skipIf` is a script"]),
        ('<Script code="x:=1"/>', ["2: `Script` of BehaviorTree.CPP is not supported; use R"]),
        ("<WhileDoElse><go/><go/></WhileDoElse>", ["2: `WhileDoElse` of BehaviorTree.CPP is not supported; put its"]),
        ('<Switch4 variable="x"><go/></Switch4>', ["2: `Switch4` has 1 child; it takes 5."]),
        ('<Timeout msec="x"><go/></Timeout>', ["2: `msec` is `x`; it takes a number."]),
        ('<Parallel failure_count="2"><go/></Parallel>', ["2: `failure_count` has to be 1"]),
        ('<Parallel success_count="2"><go/><look/><turn/></Parallel>', ["2: `success_count` is 2"]),
        (
            '<RetryUntilSuccessful num_attempts="-1"><go/></RetryUntilSuccessful>',
            ["2: `num_attempts` is -1; a mission"],
        ),
        ('<Repeat num_cycles="1.5"><go/></Repeat>', ["2: `num_cycles` is `1.5`; it takes a whole number."]),
        ('<ResourceIs resource="camera"/>', ["2: `ResourceIs` lacks its port `states`"]),
        ('<ResourceIs resource="kamera" states="OK"/>', ["2: Leaf `ResourceIs`: There is no resource `kamera`"]),
        ('<ResourceIs resource="camera" states="OK" question="perhaps"/>', ["2: `question` is `perhaps`"]),
        ('<MayStart skill="gi"/>', ["2: Leaf `MayStart`: There is no skill `gi`"]),
        ('<MayStart skill="go" inputs="sped=1"/>', ["2: Leaf `MayStart`: go: There is no field `sped`"]),
        ('<MayStart skill="go" inputs="speed=far"/>', ["2: `speed` is `far`"]),
        ('<MayStart skill="go" inputs="speed=9"/>', ["2: Leaf `MayStart`: go: `speed` is 9"]),
        ('<MayStart skill="go" inputs="fast"/>', ["2: `inputs` is `fast`; it takes pairs"]),
        ("<MayStart skill='go' inputs='speed=\"1'/>", ["2: `inputs` is"]),
        ('<OnEnding endings="S_BLOKED"><go/><look/></OnEnding>', ["2: Node `OnEnding`: There is no ending below"]),
        ('<OnEnding endings="NR"><go/></OnEnding>', ["2: `OnEnding` has 1 child; it takes 2."]),
        ("<Pausable><go/><look/></Pausable>", ["2: `Pausable` has 2 children; it takes 3."]),
        (
            '<WhileGranted resource="axis" states="FREE" patience="1" ended_by="camera GONE"><go/></WhileGranted>',
            [
                "2: Node `WhileGranted`: There is no resource",
                "2: Node `WhileGranted`: There is no state `GONE`",
            ],
        ),
        (
            '<WhileGranted resource="axes" states="FREE" patience="1" ended_by="camera"><go/></WhileGranted>',
            ["2: `ended_by` is `camera`; it takes a resource and one of its states."],
        ),
        ('<go done="speed"/>', ["2: `done` is `speed`; it takes pairs like `laps=laps_done`."]),
        ('<go done="speed=flown"/>', ["2: Leaf `go`: There is no feedback `flown` of `go`"]),
        ('<DataCompare datum="z" sign="=>" value="1"/>', ["2: `sign` is `=>`"]),
        ('<SubTree ID="other"/>', ["2: There is no tree `other`"]),
        ('<SubTree ID="main"/>', ["2: Tree `main` contains itself"]),
        ("<gi/><go/>", ["1: Tree `main` has 2 nodes at its top; it takes one."]),
        ("<Sequence><gi/>\n<ResourceIs resource='x' states='y'/></Sequence>", ["2: There is no node", "3: Leaf"]),
    ],
)
def test_every_problem_has_its_line_and_a_sentence(tree: str, problems: list[str]) -> None:
    found = problems_of(with_tree(tree))
    assert len(found) >= len(problems)
    assert bool(found) == bool(problems)
    for problem in problems:
        assert any(each.startswith(problem) for each in found), found


ONE_AFTER_ANOTHER = """<Sequence>
<goo sped="2" speed="{pace}" patience="long"/>
<go sped="2" speed="fast" patience="{long}" done="speed"/>
<Timeout msec="{soon}" within="1"><turn speed="9"/><look/></Timeout>
<WhileGranted resource="axis" states="FREE" patience="x" ended_by="camera"><ResourceIs resource="x"/></WhileGranted>
<SubTree ID="other" speed="{pace}"/>
</Sequence>"""
ALL_AT_ONCE = [
    "3: There is no node `goo`; did you mean `go`?",
    "3: `go` has no port `sped`; did you mean `speed`?",
    "3: `patience` is `long`; it takes a number.",
    "3: `speed` reads `{pace}`, which nothing fills; declare it as a port of the tree. The same in line 7.",
    "4: `done` is `speed`; it takes pairs like `laps=laps_done`.",
    "4: `go` has no port `sped`; did you mean `speed`?",
    "4: `patience` reads `{long}`, which nothing fills; declare it as a port of the tree.",
    "4: `speed` is `fast`; it takes a finite number.",
    "5: Leaf `turn`: turn: `speed` is 9; it has to lie between 0.1 and 5.",
    "5: `Timeout` has 2 children; it takes one.",
    "5: `Timeout` has no port `within`; it has `msec`.",
    "5: `msec` reads `{soon}`, which nothing fills; declare it as a port of the tree.",
    "6: Leaf `ResourceIs`: There is no resource `x`. What exists: `axes` and `camera`.",
    "6: Node `WhileGranted`: There is no resource `axis`; did you mean `axes`? What exists: `axes` and `camera`.",
    "6: `ResourceIs` lacks its port `states`: states of which it has to be in one.",
    "6: `ended_by` is `camera`; it takes a resource and one of its states.",
    "6: `patience` is `x`; it takes a number.",
    "7: There is no tree `other`; there is `main` and `rescue`.",
]


def test_all_problems_are_reported_at_once_without_those_that_follow() -> None:
    assert sorted(problems_of(with_tree(ONE_AFTER_ANOTHER))) == ALL_AT_ONCE


def test_problems_of_frame_options_and_trees_are_reported_together() -> None:
    """A misspelt rescue and a broken option do not hide the problems of the trees."""
    model = MODEL.format(name="speed", kind="double", rest='default="much"', needs="camera: BLIND; axes")
    text = with_tree('<go speed="{speed}" sped="1"/>', model).replace('"rescue"', '"resque"')
    assert sorted(problems_of(text)) == [
        "1: There is no tree `rescue`, which runs when somebody aborts the mission; did you mean `resque` to be it?",
        "2: `go` has no port `sped`; did you mean `speed`?",
        "5: The default of option `speed` cannot be read: Expected `float`, got `str`.",
        "6: The mission's needs: There is no state `BLIND` of `camera`. What exists: `OK` and `FAILED`.",
        "6: `axes` in `needs` is not of the form RESOURCE: STATE ...",
    ]


def test_a_tree_that_nobody_calls_is_checked_too_but_for_what_a_caller_would_give_it() -> None:
    spare = (
        '<BehaviorTree ID="spare"><Sequence><go speed="{speed}" sped="1"/><look time="{t}"/></Sequence></BehaviorTree>'
    )
    assert [each.partition(": ")[2] for each in problems_of(with_tree("<go/>", spare))] == [
        "`go` has no port `sped`; did you mean `speed`?",
        "`look` has no port `time`; it has `success_on`, `failure_on`, `patience`, `leg_of` and `done`.",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<root", "1:1: What begins here is not closed"),
        ("", "1:1: There is no tag"),
        ("<tree/>", '1: Begin with `<root BTCPP_format="4">`.'),
        ('<root main_tree_to_execute="a"/>', '1: Begin with `<root BTCPP_format="4">`.'),
        ('<root BTCPP_format="4"/>', "1: Name the main tree"),
        (with_tree("<go/>", RESCUE), "4: There are two trees `rescue`"),
        (with_tree("<go/>", '<include path="x"/>'), "4: Files are not included"),
        (with_tree("<go/>", "<go/>"), "4: `go` does not belong here"),
        (with_tree("<go/>", "<BehaviorTree/>"), "4: This tree has no ID"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><r>&a;</r>', "1: Take out the entity"),
    ],
)
def test_a_file_that_is_no_tree_file_is_refused(text: str, problem: str) -> None:
    assert any(found.startswith(problem) for found in problems_of(text)), problems_of(text)


MODEL = """<TreeNodesModel><SubTree ID="main">
<input_port name="{name}" type="{kind}" {rest}/>
<MetadataFields><Metadata needs="{needs}"/></MetadataFields></SubTree></TreeNodesModel>"""


@pytest.mark.parametrize(
    ("name", "kind", "rest", "needs", "problem"),
    [
        ("speed", "double", 'default="2"', "camera: OK FAILED; axes: FREE", None),
        ("speed", "Speed", 'default="2"', "", "Option `speed` is of type `Speed`"),
        ("speed", "double", "", "", "Option `speed` has no default"),
        ("speed", "double", 'default="much"', "", "The default of option `speed` cannot be read"),
        ("speed", "double", 'default="2"', "camera", "`camera` in `needs`"),
        ("speed", "double", 'default="2"', 'camera: OK" owner_grace="20', None),
        (
            "speed",
            "double",
            'default="2"',
            'camera: OK" owner_grace="61',
            "`owner_grace` is `61`; it takes",
        ),
        (
            "speed",
            "double",
            'default="2"',
            'camera: OK" owner_grace="long',
            "`owner_grace` is `long`; it takes seconds",
        ),
        ("speed", "double", 'default="2"', "camera: BLIND", "The mission's needs: There is no state"),
        ("speed", "double", 'default="7"', "", "Leaf `go`: go: `speed` is 7;"),
    ],
)
def test_options_and_needs_are_checked(name: str, kind: str, rest: str, needs: str, problem: str | None) -> None:
    model = MODEL.format(name=name, kind=kind, rest=rest, needs=needs)
    found = problems_of(with_tree('<go speed="{speed}"/>', model))
    assert len(found) == (problem is not None), found
    assert problem is None or problem in found[0]


@pytest.mark.parametrize("name", ["laps-x", "1st", "", "a b", "__laps", "_laps"])
def test_what_is_no_name_cannot_be_that_of_an_option(name: str) -> None:
    model = MODEL.format(name=name, kind="double", rest='default="2"', needs="")
    (found,) = problems_of(with_tree(f'<go speed="{{{name}}}"/>' if name.isidentifier() else "<go/>", model))
    assert found.startswith(f"5: `{name}` cannot name an option; write a letter,")


@pytest.mark.parametrize(
    ("call", "inside", "speed"),
    [
        ('<SubTree ID="sub" pace="3"/>', "{pace}", 3.0),
        ('<SubTree ID="sub" pace="{speed}"/>', "{pace}", 2.0),
        ('<SubTree ID="sub" _autoremap="true"/>', "{speed}", 2.0),
        ('<SubTree ID="sub"/>', "{@speed}", 2.0),
        ('<SubTree ID="sub"/>', "{speed}", None),
    ],
)
def test_a_subtree_sees_its_ports_and_no_more(call: str, inside: str, speed: float | None) -> None:
    model = MODEL.format(name="speed", kind="double", rest='default="2"', needs="")
    sub = f'<BehaviorTree ID="sub"><go speed="{inside}"/></BehaviorTree>'
    text = with_tree(call, sub + model)
    if speed is None:
        assert "which nothing fills" in problems_of(text)[0]
        return
    loaded = mission_of(text)
    go = loaded.build(offline_context(SKILLSET), loaded.Options()).root
    assert isinstance(go, SkillAction)
    assert go.inputs == {"speed": speed}


def test_a_file_flies(mission: FakeMission) -> None:
    tree = '<Fallback><go speed="3" failure_on="S_ARRIVED S_BLOCKED"/><turn/></Fallback>'
    loaded = mission_of(with_tree(tree))
    root = loaded.build(mission.context, loaded.Options()).root
    root.tick_once()
    mission.goals[0].end("S_ARRIVED", success=True)
    root.tick_once()
    assert [(goal.skill, goal.inputs) for goal in mission.goals] == [("go", {"speed": 3.0}), ("turn", {})]


def test_the_command_checks_a_file_and_says_where(tmp_path: Path) -> None:
    file = tmp_path / "wrong.xml"
    file.write_text(with_tree("<takeof/>"))
    result = CliRunner().invoke(mission_command, ["check", str(file)])
    assert result.exit_code == 1
    assert f"{file}:2: There is no node `takeof`; did you mean `takeoff`?" in result.output
    assert CliRunner().invoke(mission_command, ["check", str(MAPPING)]).exit_code == 0


@pytest.mark.parametrize(
    ("text", "code", "place", "problem"),
    [
        (with_tree("<takeoff/>").replace(RESCUE, ""), 1, ":2", "The mission has no rescue"),
        (with_tree("<takeof/>"), 1, ":2", "There is no node `takeof`"),
        (with_tree("<stream/>"), 0, "", None),
    ],
    ids=["without rescue", "does not fit", "fits"],
)
def test_exit_code_and_json_of_the_check(tmp_path: Path, text: str, code: int, place: str, problem: str | None) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(text)
    result = CliRunner().invoke(mission_command, ["check", str(file), "--json"])
    assert result.exit_code == code, result.output
    found = json.loads(result.stdout)
    assert result.stderr == ""
    assert bool(found) == (problem is not None)
    assert problem is None or any(each["place"] == f"{file}{place}" and problem in each["text"] for each in found)


def test_the_command_writes_a_file_that_fits(tmp_path: Path) -> None:
    file = tmp_path / "mapping.xml"
    assert CliRunner().invoke(mission_command, ["export", "mapping", "speed=1", "-o", str(file)]).exit_code == 0
    assert CliRunner().invoke(mission_command, ["check", str(file)]).exit_code == 0
    assert 'ID="goto"' in CliRunner().invoke(mission_command, ["nodes"]).output


def test_a_cell_holds_what_was_written_into_it_last() -> None:
    climbs = '<PointAbove height="{0}"/><goto name="to {0}" target="{{up}}"/>'
    text = with_tree(f"<Sequence>{climbs.format(5)}{climbs.format(9)}{climbs.format(7)}</Sequence>")
    fake = FakeMission(M600)
    fake.interface.know("position", {"x": 1.0, "y": 2.0, "z": 0.5})
    loaded = mission_of(text)
    root = loaded.build(fake.context, loaded.Options()).root
    for height in (5.0, 9.0, 7.0):
        root.tick_once()
        assert fake.goals[-1].inputs["target"] == {"x": 1.0, "y": 2.0, "z": height}
        fake.goals[-1].end("S_ARRIVED", success=True)
    root.tick_once()
    assert root.status is Status.SUCCESS


def test_entries_keep_their_names_when_a_file_is_written_again() -> None:
    point = '<PointAbove height="5" target="{above}"/><goto target="{above}"/>'
    legs = '<WaypointWriter plan="{plan}" target="{leg}"/><goto target="{leg}"/>'
    loaded = mission_of(with_tree(f'<Sequence><PlanRoute route="[[1,2,3]]" plan="{{plan}}"/>{point}{legs}</Sequence>'))
    written = write_mission("main", loaded.build(offline_context(M600), loaded.Options()), M600)
    again = mission_of(written)
    assert write_mission("main", again.build(offline_context(M600), again.Options()), M600) == written


def test_a_mission_with_two_routes_is_not_written_as_one() -> None:
    context = offline_context(M600)
    routes = [Route(context, RoutePlanner([(x, 0.0, 4.0)])) for x in (5.0, 9.0)]
    legs = [RepeatUntil("legs", route.is_done, WaypointWriter("writer", context, route)) for route in routes]
    trees = MissionTrees(Sequence("both", memory=True, children=legs), Success("rescue"), Progress)
    with pytest.raises(NotWritableError, match="`both` has 2 routes, and a tree file holds one"):
        write_mission("both", trees, M600)
