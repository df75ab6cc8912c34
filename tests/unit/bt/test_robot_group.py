"""Missions on several robots: the robot of each leaf, and the check of each robot by itself."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from fake_interface import SKILLSET, FakeMission
from hypothesis import given
from hypothesis import strategies as st
from py_trees.behaviours import Success
from py_trees.common import Status
from tree_files import mission_of

from skillwing.bt_missions.checking.mission_check import check_mission_on, offline_contexts
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext, MissionNotes
from skillwing.bt_missions.leaves.may_start import MayStart
from skillwing.bt_missions.leaves.robot_group import GroupTime, MissingRobotError, RobotGroup
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.dsl import parse
from skillwing.dsl.model import UnknownNameError
from skillwing.services.protocol import Terminal
from skillwing.services.rescue_goal import RescueGoal

CRANE = parse(
    """
    skillset crane {
        data { load: float64 [kg] period=1.0 }
        resource hook { initial EMPTY  EMPTY -> LOADED  LOADED -> EMPTY }
        skill lift {
            input { load: float64 [kg] = 1.0 }
            effect { take: hook -> LOADED }
            precondition { empty: resource=(hook == EMPTY)  success take }
            result { success UP: apply=take }
        }
        skill lower {
            effect { put: hook -> EMPTY }
            precondition { loaded: resource=(hook == LOADED) }
            result { success DOWN: apply=put }
        }
    }
    """,
    "crane.skillset",
)
LOWERED = RescueGoal(
    resource="hook",
    state="EMPTY",
    away={"LOADED": "under load"},
    skill="lower",
    left_by=("lift",),
    reached="without load",
    action="lowering",
)
TOY, PLAIN = RobotModel(SKILLSET), RobotModel(CRANE)
ROBOTS = {"left": TOY, "right": TOY, "crane": PLAIN}
LOWER = '<BehaviorTree ID="rescue_crane">\n<lower/>\n</BehaviorTree>'


def file(tree: str, more: str = "", needs: str = "") -> str:
    """A tree file for a mission on these three robots."""
    model = f'<SubTree ID="main"><MetadataFields><Metadata robots="left right crane" needs="{needs}"/></MetadataFields>'
    models = f"<TreeNodesModel>{model}</SubTree></TreeNodesModel>"
    main = f'<BehaviorTree ID="main">\n{tree}\n</BehaviorTree>'
    return f'<root BTCPP_format="4" main_tree_to_execute="main">{main}\n{more}{models}</root>'


def problems_of(tree: str, more: str = "", needs: str = "", robots: Mapping[str, RobotModel] = ROBOTS) -> list[str]:
    mission = mission_of(file(tree, more, needs))
    return [each.text for each in check_mission_on(mission, robots, mission.Options())]


def test_each_tag_is_of_the_robot_that_it_or_a_tag_above_names() -> None:
    tree = """<Sequence>
        <go robot="left"/>
        <Sequence robot="right"><turn/><SubTree ID="lifts" robot="crane"/><look/></Sequence>
    </Sequence>"""
    mission = mission_of(file(tree, '<BehaviorTree ID="lifts"><lift/></BehaviorTree>'))
    assert mission.robots == ("left", "right", "crane")
    root = mission.build(offline_contexts(ROBOTS), mission.Options()).root
    leaves = [leaf for leaf in root.iterate() if isinstance(leaf, SkillAction)]
    assert {(leaf.robot, leaf.skill) for leaf in leaves} == {
        *(("left", "go"), ("right", "turn")),
        *(("crane", "lift"), ("right", "look")),
    }
    assert {leaf.robot: leaf.skillset for leaf in leaves} == {"left": SKILLSET, "right": SKILLSET, "crane": CRANE}
    assert problems_of(tree, '<BehaviorTree ID="lifts"><lift/></BehaviorTree>') == []


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("<go/>", "`go` has to name a robot. It names none of the robots `left`, `right` and `crane`; add `robot`."),
        ('<go robot="lefft"/>', "did you mean `left`?"),
        ('<lift robot="left"/>', "There is no node `lift`"),
        ('<go robot="crane"/>', "There is no node `go`"),
        ('<ResourceIs robot="crane" resource="axes" states="FREE"/>', "resource `axes`"),
        ('<ResourceIs resource="axes" states="FREE"/>', "`ResourceIs` has to name a robot."),
        ('<lift robot="crane" load="{data.speed}"/>', "There is no datum `speed`"),
        ('<lift robot="crane" load="{data.load}"/>', ""),
    ],
)
def test_each_leaf_is_checked_against_its_own_robot(tree: str, problem: str) -> None:
    found = problems_of(tree)
    assert (found == []) if not problem else any(problem in each for each in found), found


def test_two_robots_use_the_same_skill_at_the_same_time_and_one_robot_does_not() -> None:
    assert problems_of('<Parallel><go robot="left"/><go robot="right"/></Parallel>') == []
    found = problems_of('<ParallelAll><go robot="left"/><go robot="left"/></ParallelAll>')
    assert "skill `go` of `left` would run twice" in found[0]
    found = problems_of('<Parallel><go robot="left"/><turn robot="left"/></Parallel>')
    assert "take axes, at the same time" in found[0]
    assert problems_of('<Parallel><go robot="left"/><turn robot="right"/></Parallel>') == []


def test_needs_name_robot_and_resource() -> None:
    tree = '<go robot="left"/>'
    assert problems_of(tree, needs="left.axes: FREE; crane.hook: EMPTY") == []
    assert "resource" in problems_of(tree, needs="crane.axes: FREE")[0]
    assert "There is no robot `middle`" in problems_of(tree, needs="middle.axes: FREE")[0]
    assert "add `robot`" in problems_of(tree, needs="axes: FREE")[0]


def test_the_robots_of_the_mission_have_to_be_given() -> None:
    assert problems_of('<go robot="left"/>', robots={"": TOY}) == [
        "Mission `main` is for the robots `left`, `right` and `crane`. "
        "Name them: `--robot left=NAME --robot right=NAME --robot crane=NAME`."
    ]


RESCUED = {**ROBOTS, "crane": RobotModel(CRANE, LOWERED)}


def test_the_rescue_is_checked_for_each_robot_that_has_a_goal() -> None:
    unsafe = '<Sequence><lift robot="crane"/><go robot="left"/><lower robot="crane"/></Sequence>'
    found = problems_of(unsafe, LOWER, robots=RESCUED)
    assert len(found) == 1
    assert "`crane` may end under load when one of `crane: lift` and `left: go` fails" in found[0]
    safe = f'<Fallback>{unsafe}<lower robot="crane"/></Fallback>'
    assert problems_of(safe, LOWER, robots=RESCUED) == []
    assert "no rescue of `crane`" in problems_of(safe, robots=RESCUED)[0]


def test_the_failure_of_a_branch_does_not_leave_the_other_robot_away_in_a_parallel_all() -> None:
    lifted = (
        '<Fallback><Sequence><lift robot="crane"/><lower robot="crane"/></Sequence><lower robot="crane"/></Fallback>'
    )
    both = f'{{}}<go robot="left"/>{lifted}{{}}'
    together = both.format("<ParallelAll>", "</ParallelAll>")
    assert problems_of(together, LOWER, robots=RESCUED) == []
    assert problems_of(both.format("<Parallel>", "</Parallel>"), LOWER, robots=RESCUED) != []


# --- contexts --------------------------------------------------------------------------------------------------------


class AlwaysClosed:
    """A gate that holds everything."""

    def blocks(self, skill: str) -> str | None:
        return "for a test"

    def explains(self, skill: str, terminal: Terminal) -> bool:
        return False


class TwoRobots:
    """A group of two fake robots, with the records that it writes."""

    def __init__(self) -> None:
        self.fakes = {"left": FakeMission(), "right": FakeMission()}
        self.records: list[tuple[str, Mapping[str, str | None]]] = []
        notes = MissionNotes()
        contexts = {
            name: MissionContext(fake.interface, SKILLSET, lambda: 0.0, fake._write, robot=name, notes=notes)
            for name, fake in self.fakes.items()
        }
        self.group = RobotGroup(contexts, notes, self._write)

    def _write(
        self, subject: str, before: str | None, after: str, text: str, causes: Mapping[str, str | None]
    ) -> Mapping[str, str]:
        self.records.append((text, causes))
        return {name: f"{name}#{len(self.records)}" for name in causes}


def test_goals_and_states_of_the_robots_are_apart() -> None:
    two = TwoRobots()
    left, right = two.fakes["left"], two.fakes["right"]
    go = SkillAction("go", two.group, "go", robot="left")
    looks = ResourceIs("camera?", two.group, "camera", "OK", robot="right")
    left.interface.states["camera"] = "FAILED"
    go.tick_once()
    looks.tick_once()
    assert (len(left.goals), len(right.goals)) == (1, 0)
    assert looks.status is Status.SUCCESS
    two.group.cancel_all()
    assert [goal.skill for goal in two.group.unfinished] == ["go"]


def test_a_switch_is_recorded_for_each_robot_with_the_cause_of_its_own() -> None:
    two = TwoRobots()
    go = SkillAction("go", two.group, "go", robot="left")
    go.tick_once()
    two.fakes["left"].goals[0].end("RI")
    go.tick_once()
    assert two.group.failure is not None
    assert two.group.failure.text.startswith("left: go ended RI")
    two.group.note_switch("mission", "first", "second")
    assert two.records == [(two.group.failure.text, {"left": "goal-0:RI", "right": None})]
    for robot in ("left", "right"):
        SkillAction("turn", two.group, "turn", robot=robot).tick_once()
        assert two.fakes[robot].goals[-1].cause == f"{robot}#1"


def test_a_robot_that_cannot_be_reached_is_a_failure_of_its_leaves() -> None:
    two = TwoRobots()
    runs = SkillAction("go", two.group, "go", robot="left")
    other = SkillAction("go", two.group, "go", robot="right")
    for leaf in (runs, other):
        leaf.tick_once()
    two.group.of("left").absence = "it is away"
    starts = SkillAction("turn", two.group, "turn", robot="left")
    looks = ResourceIs("camera?", two.group, "camera", "OK", robot="left")
    for leaf in (runs, other, starts, looks):
        leaf.tick_once()
    assert [leaf.status for leaf in (runs, other, starts, looks)] == [
        *(Status.FAILURE, Status.RUNNING),
        *(Status.FAILURE, Status.FAILURE),
    ]
    assert two.fakes["left"].goals[0].interrupts == 1


def test_leaves_that_wait_for_a_robot_fail_when_it_is_lost_though_its_time_stands_still() -> None:
    two = TwoRobots()
    left = two.group.of("left")
    state = ResourceIs("camera?", two.group, "camera", "FAILED", wait=10.0, robot="left")
    start = MayStart("may turn?", two.group, "turn", wait=10.0, robot="left")
    held = SkillAction("go", two.group, "go", robot="left")
    held.follow(AlwaysClosed())
    for leaf in (state, start, held):
        leaf.tick_once()
        assert leaf.status is Status.RUNNING
    left.absence = "it is away"
    for leaf in (state, start, held):
        leaf.tick_once()
        assert leaf.status is Status.FAILURE
    assert start.feedback_message == "turn may not start: it is away"
    assert held.feedback_message == "go was held: it is away"


def test_a_leaf_has_to_name_one_of_the_robots() -> None:
    group = TwoRobots().group
    with pytest.raises(MissingRobotError, match="`left` and `right`"):
        SkillAction("go", group, "go")
    with pytest.raises(UnknownNameError, match="left"):
        SkillAction("go", group, "go", robot="lefft")
    with pytest.raises(UnknownNameError):
        SkillAction("go", FakeMission().context, "go", robot="left")


def test_the_time_of_a_group_passes_as_long_as_that_of_any_robot() -> None:
    clocks = {"left": 5.0, "right": 1000.0}
    now = GroupTime({name: lambda name=name: clocks[name] for name in clocks})
    clocks["left"] += 0.5
    assert now() == 0.5
    clocks["right"] += 0.75
    assert now() == 0.75, "the same time, told by the other robot"
    clocks["left"] += 0.5
    clocks["right"] += 0.5
    assert now() == 1.25
    assert now() == 1.25


def test_a_clock_that_had_stopped_counts_again_from_its_return() -> None:
    clocks = {"left": 5.0, "right": 1000.0}
    now = GroupTime({name: lambda name=name: clocks[name] for name in clocks})
    for _ in range(100):
        clocks["right"] += 0.25
        now()
    assert now() == 25.0
    clocks["left"] += 5.0
    assert now() == 25.0, "the seconds of its jump were counted by the other"
    clocks["left"] += 0.5
    assert now() == 25.5
    clocks["left"] = 0.0
    assert now() == 25.5
    clocks["left"] += 0.5
    assert now() == 26.0


@given(st.lists(st.tuples(st.booleans(), st.floats(0.0, 0.4)), max_size=50))
def test_the_time_of_a_group_is_that_of_clocks_which_tell_one_time_by_turns(turns: list[tuple[bool, float]]) -> None:
    """Clocks that are read from messages show one true time, each as of its latest message."""
    true, shown = 0.0, {"left": 0.0, "right": 0.0}
    now = GroupTime({name: lambda name=name: shown[name] for name in shown})
    for is_left, passed in turns:
        true += passed
        shown["left" if is_left else "right"] = true
        if true - min(shown.values()) > 0.9:
            shown = dict.fromkeys(shown, true)
        assert now() == pytest.approx(true)


def test_a_parallel_all_lets_each_child_come_to_its_end() -> None:
    fake = FakeMission()
    go, look = SkillAction("go", fake.context, "go"), SkillAction("look", fake.context, "look")
    both = ParallelAll("both", [go, look, Success("done")])
    both.tick_once()
    fake.goals[1].end("S_NO_DATA")
    both.tick_once()
    assert (look.status, both.status) == (Status.FAILURE, Status.RUNNING)
    assert fake.goals[0].interrupts == 0
    fake.goals[0].end("S_ARRIVED", success=True)
    both.tick_once()
    assert both.status is Status.FAILURE
    both.tick_once()
    assert both.status is Status.RUNNING
    assert len(fake.goals) == 4
