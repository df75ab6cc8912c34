"""Choices, delays and memory, with the semantics of BehaviorTree.CPP 4."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from fake_interface import SKILLSET, FakeMission
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.common import OneShotPolicy, ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import OneShot, Repeat, Retry
from tree_files import problems_of, with_tree

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.tree_check import ends_of
from skillwing.bt_missions.leaves.blackboard_entry import BlackboardEntry
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.decorators import Delay, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, SequenceWithMemory, ValueSwitch

RUNNING, SUCCESS, FAILURE, INVALID = Status.RUNNING, Status.SUCCESS, Status.FAILURE, Status.INVALID


class Scripted(Behaviour):
    """Leaf with one status a tick, and then the last one. ticks, halts: their numbers until now."""

    def __init__(self, name: str, *statuses: Status) -> None:
        super().__init__(name)
        self._statuses = list(statuses)
        self.ticks = 0
        self.halts = 0

    def update(self) -> Status:
        self.ticks += 1
        return self._statuses.pop(0) if len(self._statuses) > 1 else self._statuses[0]

    def terminate(self, new_status: Status) -> None:
        self.halts += new_status is INVALID and self.status is RUNNING


def ticked(tree: Behaviour, times: int) -> list[Status]:
    found: list[Status] = []
    for _ in range(times):
        tree.tick_once()
        found.append(tree.status)
    return found


def test_a_condition_chooses_a_branch_once_and_is_not_asked_while_that_runs() -> None:
    condition, then = Scripted("if", RUNNING, SUCCESS), Scripted("then", RUNNING, SUCCESS)
    other = Scripted("else", FAILURE)
    assert ticked(IfThenElse("choice", condition, then, other), 3) == [RUNNING, RUNNING, SUCCESS]
    assert (condition.ticks, then.ticks, other.ticks) == (2, 2, 0)


def test_a_failed_condition_chooses_the_other_branch_or_is_a_failure_without_one() -> None:
    condition, then, other = Scripted("if", FAILURE), Scripted("then", SUCCESS), Scripted("else", RUNNING, FAILURE)
    assert ticked(IfThenElse("choice", condition, then, other), 3) == [RUNNING, FAILURE, FAILURE]
    assert (condition.ticks, then.ticks) == (2, 0)
    assert ticked(IfThenElse("choice", Failure("if"), Success("then")), 1) == [FAILURE]


def test_a_halted_choice_asks_again() -> None:
    condition, then = Scripted("if", SUCCESS), Scripted("then", RUNNING)
    choice = IfThenElse("choice", condition, then)
    choice.tick_once()
    choice.stop(INVALID)
    assert then.halts == 1
    choice.tick_once()
    assert condition.ticks == 2


@pytest.mark.parametrize(
    ("value", "chosen"),
    [("a", 0), ("b", 1), ("c", 2), (1.0, 2), ("A", 2), (True, 2), (None, 2)],
)
def test_the_case_that_equals_the_variable_is_chosen(value: object, chosen: int) -> None:
    children = [Scripted(name, SUCCESS) for name in ("first", "second", "else")]
    assert ticked(ValueSwitch("switch", value, ("a", "b"), children), 1) == [SUCCESS]
    assert [child.ticks for child in children] == [number == chosen for number in range(3)]


@pytest.mark.parametrize(
    ("value", "case"), [(2, "2"), (2.0, "2"), (2, "2.0"), ("2", "2.00"), (True, "true"), (0.1 + 0.2, "0.3")]
)
def test_values_are_compared_as_texts_and_as_numbers(value: object, case: str) -> None:
    children = [Success("equal"), Failure("other")]
    assert ticked(ValueSwitch("switch", value, (case,), children), 1) == [SUCCESS]


def test_a_variable_that_changes_halts_the_child_that_runs_first() -> None:
    values = iter(["a", "b", "b"])
    first, second, default = Scripted("first", RUNNING), Scripted("second", RUNNING, SUCCESS), Scripted("else", FAILURE)
    assert ticked(ValueSwitch("switch", lambda: next(values), ("a", "b"), [first, second, default]), 3) == [
        RUNNING,
        RUNNING,
        SUCCESS,
    ]
    assert (first.ticks, first.halts, second.ticks, default.ticks) == (1, 1, 2, 0)


def test_a_variable_without_a_value_has_no_case() -> None:
    entry, fake = BlackboardEntry("a"), FakeMission()
    entry.announce()
    for variable in (entry, LatestReading(fake.context, "load")):
        assert ticked(ValueSwitch("switch", variable, ("a",), [Failure("case"), Success("else")]), 1) == [SUCCESS]
    entry.write("a")
    assert ticked(ValueSwitch("switch", entry, ("a",), [Failure("case"), Success("else")]), 1) == [FAILURE]


def test_a_switch_has_one_child_more_than_cases() -> None:
    with pytest.raises(ValueError, match="a child for each, and one for all else"):
        ValueSwitch("switch", "a", ("a", "b"), [Success("case")])


def test_a_sequence_with_memory_starts_again_with_the_child_that_failed() -> None:
    first, second, third = Scripted("1", SUCCESS), Scripted("2", FAILURE, RUNNING, SUCCESS), Scripted("3", SUCCESS)
    tree = SequenceWithMemory("all", [first, second, third])
    assert ticked(tree, 3) == [FAILURE, RUNNING, SUCCESS]
    assert (first.ticks, second.ticks, third.ticks) == (1, 3, 1)
    assert ticked(tree, 1) == [SUCCESS]
    assert (first.ticks, second.ticks, third.ticks) == (2, 4, 2)


def test_a_sequence_with_memory_starts_again_with_the_child_that_was_halted() -> None:
    first, second = Scripted("1", SUCCESS), Scripted("2", RUNNING)
    tree = SequenceWithMemory("all", [first, second])
    tree.tick_once()
    tree.stop(INVALID)
    tree.tick_once()
    assert (first.ticks, second.ticks, second.halts) == (1, 2, 1)


def test_a_delay_starts_its_child_after_robot_time(mission: FakeMission) -> None:
    child = Scripted("child", RUNNING, SUCCESS)
    tree = Delay("later", mission.context, 2.0, child)
    for time, status, ticks in ((0.0, RUNNING, 0), (1.9, RUNNING, 0), (2.0, RUNNING, 1), (2.1, SUCCESS, 2)):
        mission.time = time
        assert ticked(tree, 1) == [status]
        assert child.ticks == ticks
    assert ticked(tree, 1) == [RUNNING], "it waits again in its next run"
    assert child.status is INVALID


def test_a_delay_that_is_halted_starts_no_child(mission: FakeMission) -> None:
    child = Scripted("child", RUNNING)
    tree = Delay("later", mission.context, 2.0, child)
    tree.tick_once()
    tree.stop(INVALID)
    mission.time = 3.0
    assert ticked(tree, 1) == [RUNNING]
    assert child.ticks == 0


def test_what_runs_once_is_skipped_after_its_end() -> None:
    child = Scripted("child", RUNNING, FAILURE)
    tree = Sequence("all", True, [RunOnce("once", child), Success("after")])
    assert ticked(tree, 4) == [RUNNING, FAILURE, SUCCESS, SUCCESS]
    assert child.ticks == 2


def test_a_skipped_node_is_no_obstacle_to_the_next_child() -> None:
    after = Scripted("after", SUCCESS)
    assert ticked(Sequence("all", True, [RunOnce("once", Scripted("child", SUCCESS)), after]), 2) == [SUCCESS, SUCCESS]
    other = Scripted("other", SUCCESS)
    tree = Selector("one", True, [RunOnce("once", Scripted("child", SUCCESS)), other])
    assert ticked(tree, 2) == [SUCCESS, SUCCESS]
    assert (after.ticks, other.ticks) == (2, 1)


def test_what_runs_once_and_is_halted_runs_again() -> None:
    child = Scripted("child", RUNNING)
    tree = Sequence("all", True, [RunOnce("once", child)])
    tree.tick_once()
    tree.stop(INVALID)
    tree.tick_once()
    assert child.ticks == 2


Make = Callable[[], Behaviour]


@pytest.mark.parametrize(
    ("make", "ends"),
    [
        (lambda: IfThenElse("i", Success("c"), Failure("t"), Success("e")), {FAILURE}),
        (lambda: IfThenElse("i", Failure("c"), Failure("t"), Success("e")), {SUCCESS}),
        (lambda: IfThenElse("i", Failure("c"), Success("t")), {FAILURE}),
        (lambda: ValueSwitch("s", "a", ("a",), [Success("c"), Failure("e")]), {SUCCESS, FAILURE}),
        (lambda: SequenceWithMemory("m", [Success("a"), Success("b")]), {SUCCESS}),
        (lambda: Delay("d", offline_context(SKILLSET), 1.0, Failure("c")), {FAILURE}),
        (lambda: OneShot("o", Failure("c"), OneShotPolicy.ON_COMPLETION), {FAILURE}),
        (lambda: RunOnce("r", Failure("c")), {FAILURE}),
    ],
)
def test_ends_of_these_nodes_are_known(make: Make, ends: set[Status]) -> None:
    assert ends_of(make(), SKILLSET) == ends


def test_what_runs_once_may_be_skipped_in_a_loop() -> None:
    once = RunOnce("once", Failure("child"))
    Retry("again", Sequence("all", True, [once]), 2)
    assert ends_of(once, SKILLSET) == {SUCCESS, FAILURE}


@pytest.mark.parametrize(
    ("tree", "problem"),
    [
        ("<IfThenElse><go/><turn/></IfThenElse>", None),
        ("<IfThenElse><go/><turn/><look/></IfThenElse>", None),
        ('<Sequence><RunOnce name="once"><go/></RunOnce><turn/></Sequence>', None),
        ('<Inverter><RunOnce name="once" then_skip="false"><go/></RunOnce></Inverter>', None),
        ('<Delay delay_msec="500"><go/></Delay>', None),
        ("<IfThenElse><go/></IfThenElse>", "`IfThenElse` has 1 child; it takes 2 or 3."),
        (
            "<IfThenElse><AlwaysSuccess name='c'/><go/><turn/></IfThenElse>",
            "Branch `turn` of `IfThenElse` is never reached: `c` cannot fail.",
        ),
        (
            "<IfThenElse><AlwaysFailure name='c'/><go/><turn/></IfThenElse>",
            "Branch `go` of `IfThenElse` is never reached: `c` cannot succeed.",
        ),
        (
            '<Inverter><RunOnce name="once"><go/></RunOnce></Inverter>',
            "`once` is skipped after its end, which only a Sequence or a Fallback can do. Put it directly into one, or "
            "let it repeat its end: `then_skip` false, in Python `OneShot`.",
        ),
        (
            '<Switch2 variable="a" case_1="a" case_2="a"><go/><turn/><AlwaysFailure/></Switch2>',
            "Branch `turn` of `Switch2` is never reached: cases 1 and 2 are the same.",
        ),
        (
            '<Switch2 variable="a" case_1="a" case_2="b"><go/><turn/></Switch2>',
            "`Switch2` has 2 children; it takes 3.",
        ),
        (
            '<Switch2 variable="{a}" case_1="a" case_2="b"><go/><turn/><AlwaysFailure/></Switch2>',
            "`variable` reads `{a}`, which nothing fills; declare it as a port of the tree.",
        ),
        ('<Delay delay_msec="soon"><go/></Delay>', "`delay_msec` is `soon`; it takes a number."),
        ('<Delay delay_msec="-500"><go/></Delay>', "`delay_msec` is -500; it takes 0 or more."),
        ('<Delay delay_msec="0.5"><go/></Delay>', "`delay_msec` is `0.5`; it takes a whole number."),
        ('<Timeout msec="-500"><go/></Timeout>', "`msec` is -500; it takes 0 or more."),
        (
            '<Switch variable="a" case_1="a" case_2="b"><go/><turn/><AlwaysFailure/></Switch>',
            "There is no node `Switch`; did you mean `Switch2`?",
        ),
        (
            '<Switch variable="a" case_1="a" case_2="b" case_3="c"><go/><turn/></Switch>',
            "There is no node `Switch`; did you mean `Switch3`?",
        ),
        (
            '<Switch9 variable="a" case_1="a" case_2="b"><go/><turn/><AlwaysFailure/></Switch9>',
            "There is no node `Switch9`; did you mean `Switch2`?",
        ),
        ('<Sleep msec="9"/>', "`Sleep` of BehaviorTree.CPP is not supported; use Delay."),
    ],
)
def test_problems_of_these_tags_have_sentences(tree: str, problem: str | None) -> None:
    assert problems_of(with_tree(tree)) == ([] if problem is None else [f"2: {problem}"])


def test_a_skill_under_a_choice_is_halted_with_it(mission: FakeMission) -> None:
    leaf = SkillAction("go", mission.context, "go")
    stop = Scripted("stop", RUNNING, FAILURE)
    choice = IfThenElse("choice", Success("yes"), leaf)
    tree = Parallel("both", policy=ParallelPolicy.SuccessOnAll(), children=[choice, stop])
    ticked(tree, 2)
    assert mission.goals[0].interrupts == 1


def test_a_loop_of_a_switch_starts_the_child_again(mission: FakeMission) -> None:
    child = Scripted("child", SUCCESS)
    tree = Repeat("twice", ValueSwitch("switch", "a", ("a",), [child, Failure("else")]), 2)
    assert ticked(tree, 2)[-1] is SUCCESS
    assert child.ticks == 2
