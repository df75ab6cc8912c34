"""One mission on two robots with real managers, in virtual time: two namespaces of one network."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure
from py_trees.decorators import FailureIsSuccess, Repeat

from skillwing.bt_missions.leaves.branch_switch import NoteSwitch
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.robot_group import RobotGroup
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionTrees
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.bt_missions.running.robot_presence import LOST_AFTER
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.bt_missions.subtrees.composites import first_that_works, in_order
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.dsl import parse
from skillwing.services.bus import Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import NO_ANSWER, STILL_HELD, follow_records
from skillwing.services.client.causal_view import CausalView
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.mocking.system import make_mock_managers
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import (
    FireExtern,
    GoalStatus,
    Keys,
    MissionPhase,
    MissionStatus,
    Record,
    RecordKind,
    State,
    Terminal,
    encode,
)
from skillwing.services.rescue_goal import RescueGoal

CRANE = parse(
    """
    skillset crane {
        resource hook { initial EMPTY  EMPTY -> LOADED  extern EMPTY -> LOADED  LOADED -> EMPTY }
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        skill lift {
            effect { take: arm -> USED  up { arm -> FREE  hook -> LOADED }  give: arm -> FREE }
            precondition { free: resource=(arm == FREE)  success take }
            result { success UP: apply=up  failure SLIPPED: apply=give }
            interrupt { apply=give }
        }
        skill lower {
            effect { take: arm -> USED  give { arm -> FREE  hook -> EMPTY }  stop: arm -> FREE }
            precondition { free: resource=(arm == FREE)  success take }
            result { success DOWN: apply=give  failure STUCK: apply=stop }
            interrupt { apply=stop }
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
KEYS = Keys(CRANE.name)
ROBOTS = ("left", "right")
LIFT = skill_process("lift")


class OnBoth(Mission):
    """Runs the tree of a function on both robots; each robot lowers its load as its rescue."""

    name = "both"
    summary = "Lift on two robots."
    robots = ROBOTS

    def __init__(self, tree: Callable[[MissionContext], Behaviour]) -> None:
        self._tree = tree

    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        rescues: dict[str, Behaviour] = {robot: SkillAction("lower", context, "lower", robot=robot) for robot in ROBOTS}
        return MissionTrees(self._tree(context), rescues=rescues)


class Yard:
    """Two robots on one network, a mission on both, and what each of them hears."""

    def __init__(
        self,
        tree: Callable[[MissionContext], Behaviour],
        script: MockScript | None = None,
        *,
        left: MockScript | None = None,
        seed: int = 0,
        jitter: float = 0.0,
        rescued: bool = True,
    ) -> None:
        self.network = InProcessNetwork(seed=seed, jitter=jitter)
        self.scripts = {"left": left or script or MockScript(), "right": script or MockScript()}
        self.nodes: dict[tuple[str, str], Bus] = {}
        self.statuses: dict[str, list[MissionStatus]] = {robot: [] for robot in ROBOTS}
        self.records: dict[str, list[Record]] = {robot: [] for robot in ROBOTS}
        self.ended: dict[str, int] = {}
        """Number of the step that ended a goal, by its id."""
        self.labels: list[tuple[str, str, str]] = []
        """Robot, skill and label of each goal, in the order of the ends."""
        for robot in ROBOTS:
            self._observe(robot)
            for node in make_mock_managers(CRANE, self.scripts[robot]):
                self.nodes[robot, node.name] = self.network.attach(node, robot)
        mission = OnBoth(tree)
        model = RobotModel(CRANE, LOWERED if rescued else None)
        self.node = MissionNode.on_robots(mission, dict.fromkeys(ROBOTS, model), mission.read_options({}))
        self.node.attach_to({robot: self.network.bus("mission", robot) for robot in ROBOTS})

    def _observe(self, robot: str) -> None:
        observer = self.network.bus("observer", robot)
        follow_records(observer, KEYS, self.records[robot].append)
        status = message_reader(MissionStatus, self.statuses[robot].append)
        observer.subscribe(KEYS.mission_status, status, events=True)

        def note(status: GoalStatus) -> None:
            if status.state is State.TERMINATED and status.terminal is not None and status.goal_id not in self.ended:
                self.ended[status.goal_id] = status.after_step
                self.labels.append((robot, status.skill, status.terminal.label))

        observer.subscribe(KEYS.status("*"), message_reader(GoalStatus, note), events=True)

    def kill(self, robot: str, *names: str) -> None:
        for key in [key for key in self.nodes if key[0] == robot and (not names or key[1] in names)]:
            self.nodes.pop(key).close()

    def start(self, robot: str, *names: str) -> None:
        for node in make_mock_managers(CRANE, self.scripts[robot]):
            if node.name in names and (robot, node.name) not in self.nodes:
                self.nodes[robot, node.name] = self.network.attach(node, robot)

    def report(self, robot: str, resource: str, state: str) -> None:
        """Report a state of a resource, as the robot does."""
        extern = FireExtern(resource=resource, target=state, source="bridge")
        self.network.bus("bridge", robot).ask(KEYS.resource_extern, encode(extern), lambda answer: None)

    def run_until_over(self, within: float = 120.0) -> MissionStatus:
        assert self.network.run_until(lambda: self.node.over, within), self.node.status
        self.network.run_for(0.1)
        return self.node.status


def lifts(context: MissionContext, robot: str) -> SkillAction:
    return SkillAction(f"{robot} lifts", context, "lift", robot=robot)


def lowers(context: MissionContext, robot: str) -> SkillAction:
    return SkillAction(f"{robot} lowers", context, "lower", robot=robot)


def safely(context: MissionContext, robot: str) -> Behaviour:
    """Lift and lower; after any failure lower."""
    return first_that_works(
        robot, in_order("as planned", lifts(context, robot), lowers(context, robot)), lowers(context, robot)
    )


def one_after_the_other(context: MissionContext) -> Behaviour:
    return in_order("all", *(safely(context, robot) for robot in ROBOTS))


def test_a_tree_commands_both_robots_and_both_show_the_mission() -> None:
    yard = Yard(one_after_the_other)
    assert yard.run_until_over().phase is MissionPhase.SUCCEEDED
    assert yard.labels == [
        *(("left", "lift", "S_UP"), ("left", "lower", "S_DOWN")),
        *(("right", "lift", "S_UP"), ("right", "lower", "S_DOWN")),
    ]
    for robot in ROBOTS:
        assert yard.statuses[robot][-1].phase is MissionPhase.SUCCEEDED
        kinds = [record.after for record in yard.records[robot] if record.kind is RecordKind.MISSION]
        assert kinds == ["RUNNING", "SUCCEEDED"]


def known_causes(records: list[Record]) -> bool:
    ids = {record.id for record in records}
    return all(record.cause is None or record.cause in ids for record in records)


def test_the_causes_of_a_record_are_of_the_same_robot() -> None:
    def tree(context: MissionContext) -> Behaviour:
        note = NoteSwitch("note", context, "mission", "both", "down")
        return first_that_works("all", both(context), in_order("then", note, Failure("over")))

    slips = MockScript(skills={"lift": (MockRun(result="SLIPPED"),), "lower": (MockRun(result="STUCK"),) * 2})
    yard = Yard(tree, left=slips)
    assert yard.run_until_over().phase is MissionPhase.FAILED
    assert all(known_causes(records) for records in yard.records.values())
    assert "left: lower ended S_STUCK" in yard.node.status.text
    (switch,) = (each for each in yard.records["left"] if each.subject == "mission")
    assert switch.cause is not None
    assert [each.cause for each in yard.records["right"] if each.subject == "mission"] == [None]


def both(context: MissionContext) -> Behaviour:
    return ParallelAll("both", [safely(context, robot) for robot in ROBOTS])


def test_a_lost_robot_is_a_failure_of_its_leaves_and_the_other_goes_on() -> None:
    yard = Yard(both, MockScript(skills={"lift": (MockRun(delay=LOST_AFTER + 5.0),)}))
    yard.network.run_for(2.0)
    yard.kill("left")
    status = yard.run_until_over()
    assert status.phase is MissionPhase.FAILED
    assert "left: lower was not started" in status.text
    assert [label for robot, _, label in yard.labels if robot == "right"] == ["S_UP", "S_DOWN"]
    assert yard.statuses["right"][-1].phase is MissionPhase.FAILED


def test_a_robot_that_returns_at_once_is_not_lost() -> None:
    yard = Yard(both, MockScript(skills={"lift": (MockRun(delay=4.0),)}))
    yard.network.run_for(2.0)
    yard.kill("left", LIFT)
    yard.start("left", LIFT)
    status = yard.run_until_over()
    assert status.phase is MissionPhase.SUCCEEDED
    assert [label for robot, _, label in yard.labels if robot == "left"][-1] == "S_DOWN"


def test_an_abort_rescues_each_robot_for_itself() -> None:
    yard = Yard(both, MockScript(skills={"lift": (MockRun(delay=3.0),)}))
    yard.network.run_for(1.0)
    yard.node.abort()
    status = yard.run_until_over()
    assert status.phase is MissionPhase.ABORTED
    assert sorted(yard.labels) == sorted(
        (robot, *end) for robot in ROBOTS for end in (("lift", "IT"), ("lower", "S_DOWN"))
    )
    assert "`left` and `right` are without load" in status.text


def test_a_rescue_that_a_robot_at_its_goal_refuses_is_no_failure() -> None:
    """The abort comes before a load is up. Then the way down may not be ready."""
    stuck = MockScript(skills={"lift": (MockRun(delay=5.0),), "lower": (MockRun(result="STUCK"),)})
    yard = Yard(both, stuck)
    yard.network.run_for(2.0)
    yard.node.abort("a test")
    status = yard.run_until_over()
    assert status.phase is MissionPhase.ABORTED
    assert "lowering failed: " in status.text
    assert status.text.endswith("; `left` and `right` are without load")
    assert {label for _, _, label in yard.labels} == {"S_STUCK", "IT"}


def test_a_robot_whose_report_comes_after_its_refused_rescue_is_rescued_after_all() -> None:
    """The robot has left its goal a moment before, and says so a moment later."""
    script = MockScript(skills={"lift": (MockRun(delay=5.0),), "lower": (MockRun(result="STUCK"), MockRun())})
    yard = Yard(both, left=script, script=MockScript(skills={"lift": (MockRun(delay=5.0),)}))
    yard.network.run_for(2.0)
    yard.node.abort("a test")
    refused = ("left", "lower", "S_STUCK")
    assert yard.network.run_until(lambda: refused in yard.labels, 10.0)
    yard.report("left", "hook", "LOADED")
    status = yard.run_until_over()
    assert "it ended left under load; `left` is without load" in status.text
    assert [label for robot, _, label in yard.labels if robot == "left"] == ["IT", "S_STUCK", "S_DOWN"]


def test_only_the_robot_that_is_away_is_rescued_at_the_end() -> None:
    stuck = MockScript(skills={"lower": (MockRun(result="STUCK"), MockRun(result="STUCK"), MockRun())})
    yard = Yard(both, left=stuck)
    status = yard.run_until_over()
    assert status.phase is MissionPhase.FAILED
    assert "it ended left under load; `left` is without load" in status.text
    assert [label for robot, _, label in yard.labels if robot == "left"] == ["S_UP", "S_STUCK", "S_STUCK", "S_DOWN"]
    assert [label for robot, _, label in yard.labels if robot == "right"] == ["S_UP", "S_DOWN"]


class Rounds:
    """Tree that lifts again and again on both robots, and compares each end with the states that its tick sees."""

    def __init__(self) -> None:
        self.seen: list[tuple[str, str, str, int | None]] = []
        self.unreleased: list[str] = []

    def __call__(self, context: MissionContext) -> Behaviour:
        rounds: list[Behaviour] = []
        for robot in ROBOTS:
            leaf = SkillAction(robot, context, "lift", robot=robot)
            leaf.on_end = lambda terminal, leaf=leaf: self.compare(context, leaf, terminal)
            rounds.append(Repeat(robot, FailureIsSuccess("round", leaf), -1))
        return ParallelAll("both", rounds)

    def compare(self, group: MissionContext, leaf: SkillAction, terminal: Terminal) -> None:
        assert isinstance(group, RobotGroup)
        own = group.of(leaf.robot)
        view: CausalView = own.interface._resources  # type: ignore[attr-defined] - the leaf's states are its robot's
        assert leaf.goal is not None
        self.seen.append((leaf.robot, leaf.goal.goal_id, terminal.label, view.number))
        told = terminal.reason.endswith((NO_ANSWER, STILL_HELD))
        if terminal.detected_by == "client" and not told and own.interface.state("arm") == "USED":
            self.unreleased.append(terminal.reason)

    def early(self, ended: dict[str, int]) -> list[str]:
        """Ends that a tick saw before the states of the step that ended the goal."""
        return [
            f"{robot}: {label} after step {ended[goal_id]}, at step {number}"
            for robot, goal_id, label, number in self.seen
            if goal_id in ended and (number is None or number < ended[goal_id])
        ] + self.unreleased


ACTIONS = st.lists(
    st.tuples(
        st.sampled_from(["kill", "start"]),
        st.sampled_from(ROBOTS),
        st.just(LIFT),
        st.sampled_from([0.01, 0.2, 0.9, 3.0]),
    ),
    max_size=10,
)


@given(seed=st.integers(0, 1000), jitter=st.sampled_from([0.0, 0.01, 0.3]), actions=ACTIONS)
@settings(max_examples=15, deadline=None)
def test_a_tick_sees_one_consistent_cut_of_each_robot(
    seed: int, jitter: float, actions: list[tuple[str, str, str, float]]
) -> None:
    rounds = Rounds()
    yard = Yard(rounds, MockScript(skills={"lift": (MockRun(delay=0.7),)}), seed=seed, jitter=jitter, rescued=False)
    yard.network.run_for(1.0)
    for action, robot, process, seconds in actions:
        (yard.kill if action == "kill" else yard.start)(robot, process)
        yard.network.run_for(seconds)
    for robot in ROBOTS:
        yard.start(robot, LIFT)
    yard.network.run_for(5.0)
    assert rounds.early(yard.ended) == []
    assert {robot for robot, *_ in rounds.seen} == set(ROBOTS)
    assert RESOURCE_MANAGER in {name for _, name in yard.nodes}
