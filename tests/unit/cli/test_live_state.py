"""Live state of a system, for any order of messages."""

from __future__ import annotations

import itertools
from typing import Any

import msgspec
import pytest

from skillwing.services.protocol import (
    Ending,
    GoalProgress,
    GoalStatus,
    Record,
    RecordKind,
    State,
    Terminal,
)
from skillwing.services.terminal.live_state import RECORDS_REMEMBERED, LiveState, ResourceNow, SkillNow

DONE = Terminal(ending=Ending.SUCCEEDED, reason="done", result="DONE", success=True)
BUSY = Terminal(ending=Ending.BUSY, reason="`hover` is busy with goal b.", running_goal="b")


def status(goal: str, state: State, t: float) -> GoalStatus:
    terminal = DONE if state is State.TERMINATED else None
    return GoalStatus(goal_id=goal, skill="hover", state=state, t=t, terminal=terminal)


STORY = (
    status("a", State.VALIDATING, 1.0),
    status("a", State.RUNNING, 2.0),
    status("a", State.TERMINATED, 3.0),
    status("b", State.VALIDATING, 4.0),
    status("b", State.RUNNING, 5.0),
)


@pytest.mark.parametrize("order", list(itertools.permutations(range(len(STORY)))))
def test_in_whatever_order_it_is_heard_the_same_goal_runs(order: tuple[int, ...]) -> None:
    present = LiveState()
    for index in order:
        present.add_status(STORY[index])
    now = present.skill("hover")
    assert (now.goal_id, now.state, now.last, now.ended) == ("b", State.RUNNING, DONE, 3.0)
    assert now.since == 4.0


REFUSED = (
    status("b", State.VALIDATING, 4.0),
    status("b", State.RUNNING, 5.0),
    GoalStatus(goal_id="c", skill="hover", state=State.TERMINATED, t=6.0, terminal=BUSY),
)


@pytest.mark.parametrize("order", list(itertools.permutations(REFUSED)))
def test_a_goal_that_was_refused_for_the_one_that_runs_leaves_it_running(order: tuple[GoalStatus, ...]) -> None:
    present = LiveState()
    for each in order:
        present.add_status(each)
    now = present.skill("hover")
    assert (now.goal_id, now.state, now.since, now.last, now.ended) == ("b", State.RUNNING, 4.0, BUSY, 6.0)
    present.add_status(status("b", State.TERMINATED, 7.0))
    present.add_status(REFUSED[1])
    assert (present.skill("hover").goal_id, present.skill("hover").last) == (None, DONE)


def test_a_skill_of_which_nothing_was_heard_is_idle() -> None:
    assert LiveState().skill("hover") == SkillNow("hover")


def test_progress_belongs_to_its_goal() -> None:
    present = LiveState()
    present.add_status(status("a", State.RUNNING, 1.0))
    present.add_progress(GoalProgress(goal_id="old", skill="hover", t=0.5, feedback={"left": 9}))
    assert present.skill("hover").feedback is None
    present.add_progress(GoalProgress(goal_id="a", skill="hover", t=1.5, feedback={"left": 3}))
    assert present.skill("hover").feedback == {"left": 3}


def record(name: str, kind: RecordKind, subject: str, after: str, t: float, **more: Any) -> Record:
    return Record(id=name, t=t, source="resource_manager", kind=kind, subject=subject, before=None, after=after, **more)


def test_a_hook_that_blocked_is_shown_until_a_better_goal() -> None:
    present = LiveState()
    present.add_status(status("a", State.RUNNING, 1.0))
    for t, text in ((3.0, "blocked for 2.0 s"), (2.0, "blocked for 1.5 s")):
        present.add_record(record(f"r{t}", RecordKind.PROCESS, "skill/hover", "BLOCKED", t, goal_id="a", text=text))
    assert present.skill("hover").blocked == "blocked for 2.0 s"
    assert present.skill("goto").blocked == ""
    present.add_status(status("a", State.TERMINATED, 4.0))
    assert present.skill("hover").blocked == "blocked for 2.0 s"
    present.add_status(status("b", State.VALIDATING, 5.0))
    assert present.skill("hover").blocked == ""
    present.add_status(status("b", State.TERMINATED, 6.0))
    assert present.skill("hover").blocked == ""


@pytest.mark.parametrize("record_first", [True, False])
def test_a_goal_whose_manager_died_is_lost(record_first: bool) -> None:
    present = LiveState()
    lost = record("r1", RecordKind.GOAL, "hover", "LOST", 2.0, goal_id="a", text="Its manager is gone.")
    if record_first:
        present.add_record(lost)
    present.add_status(status("a", State.RUNNING, 1.0))
    if not record_first:
        present.add_record(lost)
    now = present.skill("hover")
    assert now.state == "IDLE"
    assert now.last is not None
    assert (now.last.ending, now.last.reason) == (Ending.LOST, "Its manager is gone.")


@pytest.mark.parametrize("kind", [RecordKind.GOAL, RecordKind.RESOURCE])
def test_what_a_client_says_of_a_loss_or_a_change_is_left_to_the_resource_manager(kind: RecordKind) -> None:
    present = LiveState()
    present.add_status(status("a", State.RUNNING, 1.0))
    said = record("alice~1#2", kind, "hover", "LOST", 2.0, goal_id="a")
    present.add_record(msgspec.structs.replace(said, source="alice"))
    assert present.skill("hover").state == State.RUNNING
    assert present.resources({"hover": "LOST"}) == [ResourceNow("hover", "LOST")]


def test_a_lost_goal_is_known_without_any_status_of_its_manager() -> None:
    """A viewer that connects later does not get them: they were in the memory of that process."""
    present = LiveState()
    present.add_record(record("r1", RecordKind.GOAL, "hover", "LOST", 2.0, goal_id="a", text="Its manager is gone."))
    now = present.skill("hover")
    assert (now.state, now.ended) == ("IDLE", 2.0)
    assert now.last is not None
    assert now.last.ending is Ending.LOST


def test_a_granted_goal_runs_although_its_manager_and_its_statuses_are_gone() -> None:
    present = LiveState()
    present.add_record(record("r1", RecordKind.GOAL, "hover", "GRANTED", 2.0, goal_id="a", text="to skill/hover"))
    now = present.skill("hover")
    assert (now.goal_id, now.state, now.since) == ("a", State.RUNNING, 2.0)
    goal = present.goal("hover")
    assert goal is not None
    assert goal.goal_id == "a"


ENDS = [
    record("r2", RecordKind.GOAL, "hover", "ENDED", 3.0, goal_id="a", text="DONE"),
    record("r2", RecordKind.GOAL, "hover.clear", "VIOLATED", 3.0, goal_id="a", text="`area` is OCCUPIED."),
    record("r2", RecordKind.GOAL, "hover", "LOST", 3.0, goal_id="a", text="Its manager is gone."),
]


@pytest.mark.parametrize("end", ENDS, ids=lambda end: end.after)
@pytest.mark.parametrize("end_first", [True, False])
def test_a_granted_goal_runs_until_the_resource_manager_has_ended_it(end: Record, end_first: bool) -> None:
    present = LiveState()
    granted = record("r1", RecordKind.GOAL, "hover", "GRANTED", 2.0, goal_id="a")
    for each in (end, granted) if end_first else (granted, end):
        present.add_record(each)
    assert present.skill("hover").state == "IDLE"


def test_statuses_of_a_goal_say_more_than_its_grant() -> None:
    present = LiveState()
    present.add_status(status("a", State.VALIDATING, 1.0))
    present.add_record(record("r1", RecordKind.GOAL, "hover", "GRANTED", 2.0, goal_id="a"))
    assert present.skill("hover").state == State.VALIDATING
    present.add_status(status("a", State.TERMINATED, 3.0))
    assert present.skill("hover").state == "IDLE"


@pytest.mark.parametrize(
    ("alive", "known"),
    [
        ((), True),
        (("skill/hover",), True),
        (("resource_manager",), True),
        (("resource_manager", "skill/hover"), False),
    ],
)
def test_a_recorded_goal_counts_if_no_living_process_would_know_of_it(alive: tuple[str, ...], known: bool) -> None:
    present = LiveState()
    present.add_recorded({"hover": status("a", State.RUNNING, 1.0)}, alive)
    assert (present.goal("hover") is not None) is known


def test_a_recorded_end_counts_only_without_a_later_goal() -> None:
    recorded = {"hover": status("a", State.TERMINATED, 9.0)}
    present = LiveState()
    present.add_recorded(recorded, ("resource_manager", "skill/hover"))
    assert present.goal("hover") == recorded["hover"]
    present = LiveState()
    present.add_status(status("b", State.TERMINATED, 1.0))
    present.add_recorded(recorded, ())
    goal = present.goal("hover")
    assert goal is not None
    assert goal.goal_id == "b"


def test_resources_tell_since_when_and_by_whom() -> None:
    present = LiveState()
    present.add_record(record("c", RecordKind.GOAL, "takeoff", "RUNNING", 1.0))
    present.add_record(record("r", RecordKind.RESOURCE, "axes", "USED", 1.0, cause="c"))
    assert present.resources({"axes": "USED", "link": "GOOD"}) == [
        ResourceNow("axes", "USED", 1.0, "takeoff RUNNING"),
        ResourceNow("link", "GOOD"),
    ]


def test_a_state_that_nobody_has_explained_has_no_age() -> None:
    present = LiveState()
    present.add_record(record("r", RecordKind.RESOURCE, "axes", "USED", 1.0))
    assert present.resources({"axes": "AVAILABLE"}) == [ResourceNow("axes", "AVAILABLE")]


def test_memory_is_bounded() -> None:
    present = LiveState()
    present.add_record(record("first", RecordKind.GOAL, "takeoff", "RUNNING", 0.0))
    for number in range(RECORDS_REMEMBERED):
        present.add_record(record(f"n{number}", RecordKind.GOAL, "takeoff", "RUNNING", 1.0))
    present.add_record(record("r", RecordKind.RESOURCE, "axes", "USED", 2.0, cause="first"))
    (axes,) = present.resources({"axes": "USED"})
    assert axes.by == "resource_manager"
