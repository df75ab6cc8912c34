"""`WithLease`: a part of a mission that runs while a lease is granted."""

from __future__ import annotations

import pytest
from fake_interface import FakeGoal, FakeMission
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, StatusQueue, Success
from py_trees.common import Status

from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.running.progress_text import progress_text
from skillwing.bt_missions.subtrees.lease import AGAIN_AFTER, WithLease
from skillwing.bt_missions.subtrees.parallel_all import ParallelAll
from skillwing.bt_missions.subtrees.pausing import Pausable
from skillwing.services.protocol import Ending, State, Terminal


class Part:
    """A lease of the skill `look` for the skill `go`, on a fake robot."""

    def __init__(self, stay: Behaviour | None = None, patience: float = 10.0) -> None:
        self.fake = FakeMission()
        self.body = SkillAction("go", self.fake.context, "go")
        lease = SkillAction("lease", self.fake.context, "look")
        self.node = WithLease("part", self.fake.context, lease, self.body, stay, patience=patience)

    def tick(self, seconds: float = 0.0) -> Status:
        self.fake.time += seconds
        self.node.tick_once()
        return self.node.status

    def goals(self, skill: str) -> list[FakeGoal]:
        return [goal for goal in self.fake.goals if goal.skill == skill]

    def granted(self) -> FakeGoal:
        """Run until the body runs; returns the goal of the lease."""
        self.tick()
        (lease,) = self.goals("look")
        assert not self.goals("go")
        lease.run()
        assert self.tick() is Status.RUNNING
        self.goals("go")[0].run()
        return lease


def test_the_part_starts_with_the_grant_and_its_end_gives_the_lease_back() -> None:
    part = Part()
    lease = part.granted()
    part.goals("go")[0].end("S_ARRIVED", success=True)
    assert part.tick() is Status.SUCCESS
    assert lease.interrupts == 1


def test_a_refused_lease_is_asked_for_again_until_the_patience_is_over() -> None:
    part = Part(patience=3.0 * AGAIN_AFTER)
    for number in range(3):
        assert part.tick() is Status.RUNNING
        assert len(part.goals("look")) == number + 1
        part.goals("look")[-1].end("NR" if number else "BUSY")
        assert part.tick(0.5 * AGAIN_AFTER) is Status.RUNNING
        assert len(part.goals("look")) == number + 1
        part.fake.time += 0.5 * AGAIN_AFTER
    assert part.tick(AGAIN_AFTER) is Status.FAILURE
    assert not part.goals("go")
    assert part.fake.context.failure is not None
    assert part.fake.context.failure.text == "look was not granted within 3 s; the last look ended NR: NR for the test"
    assert part.fake.context.failure.record == part.goals("look")[-1].record


def test_a_refusal_that_is_followed_by_a_new_question_hides_no_failure_of_another_part() -> None:
    part = Part()
    part.fake.context.observe("the other one fell", None, failed=True)
    part.tick()
    part.goals("look")[0].end("NR")
    assert part.tick() is Status.RUNNING
    assert part.fake.context.failure is not None
    assert part.fake.context.failure.text == "the other one fell"


def test_a_wait_is_one_text_however_often_the_lease_is_asked_for() -> None:
    part = Part()
    texts = {progress_text(part.node)}
    for _ in range(3):
        part.tick()
        texts.add(progress_text(part.node))
        part.goals("look")[-1].end("NR")
        part.tick()
        texts.add(progress_text(part.node))
        part.fake.time += AGAIN_AFTER
    assert texts == {"deciding", "waiting for look", "waiting for look: NR for the test"}
    part.tick()
    part.goals("look")[-1].run()
    part.tick()
    assert progress_text(part.node) == "lease, go"


@pytest.mark.parametrize(
    ("reason", "text"),
    [
        ("`corridor == FREE` does not hold: corridor is UNCLEAR.", "waiting for look: corridor is UNCLEAR"),
        (
            "`pad == FREE` does not hold: pad is UNCLEAR. The effect `take` cannot be applied.",
            "waiting for look: pad is UNCLEAR",
        ),
        ("Goal 7 of left runs.", "waiting for look: Goal 7 of left runs"),
    ],
)
def test_a_wait_has_the_reason_of_the_last_refusal(reason: str, text: str) -> None:
    part = Part()
    part.tick()
    goal = part.goals("look")[-1]
    goal.state, goal.terminal = State.TERMINATED, Terminal(ending=Ending.NOT_READY, reason=reason)
    part.tick()
    assert progress_text(part.node) == text
    part.tick(AGAIN_AFTER)
    assert len(part.goals("look")) == 2
    assert progress_text(part.node) == text


def test_progress_on_several_robots_names_each_robot() -> None:
    left, right = FakeMission(), FakeMission()
    left.context.robot, right.context.robot = "left", "right"
    home = SkillAction("home", left.context, "go")
    wait = WithLease(
        "part", left.context, SkillAction("lease", right.context, "look"), SkillAction("home", left.context, "go")
    )
    both = ParallelAll("both", [home, SkillAction("left: turn", left.context, "turn"), wait])
    both.tick_once()
    assert progress_text(both) == "left: home, left: turn, left: waiting for look"


def test_a_judge_that_does_not_answer_ends_the_wait_as_well() -> None:
    part = Part(patience=5.0)
    assert part.tick() is Status.RUNNING
    assert part.tick(6.0) is Status.FAILURE
    assert part.goals("look")[0].interrupts == 1


def test_the_end_of_the_lease_halts_the_part() -> None:
    part = Part()
    lease = part.granted()
    lease.end("LOST")
    assert part.tick() is Status.FAILURE
    assert part.goals("go")[0].interrupts == 1
    assert part.fake.context.failure is not None
    assert part.fake.context.failure.text.startswith("look ended LOST")
    assert part.fake.context.failure.record == lease.record


def test_a_robot_that_is_in_the_place_goes_on_to_leave_it() -> None:
    inside = StatusQueue("inside", [Status.SUCCESS, Status.SUCCESS, Status.FAILURE], Status.FAILURE)
    part = Part(inside)
    part.granted().end("LOST")
    assert part.tick() is Status.RUNNING
    assert part.tick() is Status.RUNNING
    assert part.goals("go")[0].interrupts == 0
    assert part.tick() is Status.FAILURE
    assert len(part.goals("look")) == 1
    part = Part(Success("inside"))
    part.granted().end("LOST")
    part.goals("go")[0].end("S_ARRIVED", success=True)
    assert part.tick() is Status.SUCCESS


def test_a_halt_halts_both() -> None:
    part = Part(Failure("inside"))
    lease = part.granted()
    part.node.stop(Status.INVALID)
    assert [goal.interrupts for goal in (lease, part.goals("go")[0])] == [1, 1]


def test_a_pause_holds_the_part_and_not_its_lease() -> None:
    part = Part()
    turn = SkillAction("turn", part.fake.context, "turn")
    pausable = Pausable("pausable", part.fake.context, Success("may"), turn, part.node)
    assert [leaf.skill for leaf in pausable.held] == ["go"]
