"""A history in bounded memory: it has what is still true, and what was last."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_mission import SKILLSET, tell

from skillwing.services.history.history import History
from skillwing.services.history.recent_history import NEAR_CAUSES, STATUSES_KEPT, SUBJECTS_KEPT, RecentHistory
from skillwing.services.protocol import Ending, GoalStatus, Record, RecordKind, State, Terminal

DONE = Terminal(ending=Ending.SUCCEEDED, reason="arrived", result="ARRIVED", success=True)
RECORDS, GOALS = 50, 10


def change(number: int, subject: str, cause: str | None = None) -> Record:
    kind = RecordKind.RESOURCE if subject in INITIAL else RecordKind.DATA
    return Record(
        id=f"r#{number}", t=float(number), source="rm", kind=kind, subject=subject, before="A", after="B", cause=cause
    )


INITIAL = [resource.name for resource in SKILLSET.resources]
SKILLS = [skill.name for skill in SKILLSET.skills]


def test_a_short_history_is_that_of_all_messages() -> None:
    story = tell()
    recent = RecentHistory(SKILLSET)
    for record in story.records:
        recent.add_record(record)
    for status in story.statuses:
        recent.add_status(status)
    whole = History.of(story.records, story.statuses, SKILLSET)
    assert recent.bars == whole.bars
    assert recent.lanes == whole.lanes
    assert [recent.chain(record.id) for record in story.records] == [whole.chain(each.id) for each in story.records]
    assert recent.forgotten_until is None


@given(st.lists(st.tuples(st.sampled_from([*INITIAL, "noise"]), st.integers(1, 5)), min_size=60, max_size=300))
@settings(max_examples=60)
def test_the_latest_changes_stay_with_their_causes(told: list[tuple[str, int]]) -> None:
    recent, whole = RecentHistory(SKILLSET, records=RECORDS), History(SKILLSET)
    latest: dict[str, Record] = {}
    for number, (subject, back) in enumerate(told):
        record = change(number, subject, f"r#{number - back}" if number >= back else None)
        recent.add_record(record)
        whole.add_record(record)
        latest[subject] = record
    most = RECORDS + len(INITIAL) * (NEAR_CAUSES + 1)
    assert len(recent.records) <= most
    for subject in INITIAL:
        if subject in latest:
            found = recent.chain(latest[subject].id)
            assert found[-1] == latest[subject]
            assert recent.lanes[subject][-1].state == whole.lanes[subject][-1].state


def status(goal: int, state: State, t: float, skill: str = "goto", terminal: Terminal | None = None) -> GoalStatus:
    return GoalStatus(goal_id=f"g{goal}", skill=skill, state=state, t=t, terminal=terminal)


def test_goals_that_run_are_not_forgotten_and_ended_ones_are() -> None:
    recent = RecentHistory(SKILLSET, goals=GOALS)
    recent.add_status(status(0, State.RUNNING, 0.0, skill="takeoff"))
    for goal in range(1, 200):
        recent.add_status(status(goal, State.RUNNING, float(goal)))
        recent.add_status(status(goal, State.TERMINATED, goal + 0.5, terminal=DONE))
    assert "g0" in recent
    assert "g199" in recent
    assert len(recent.bars) == GOALS
    assert recent.forgotten_until is not None
    assert {each.goal_id for each in recent.lasting_statuses} == {"g0", "g199"}


def test_goals_of_strangers_that_never_end_are_bounded() -> None:
    recent = RecentHistory(SKILLSET, goals=GOALS)
    for goal in range(3 * SUBJECTS_KEPT):
        recent.add_status(status(goal, State.RUNNING, float(goal), skill=f"made_up_{goal}"))
    assert len(recent.bars) <= GOALS + 1


def test_a_head_is_enough_for_the_states_and_the_latest_goals() -> None:
    recent = RecentHistory(SKILLSET, records=RECORDS, goals=GOALS)
    for number in range(300):
        recent.add_record(change(number, INITIAL[0] if number == 3 else INITIAL[1]))
        recent.add_status(status(number, State.TERMINATED, float(number), SKILLS[number % 3], DONE))
    again = History.of(recent.lasting_records, recent.lasting_statuses, SKILLSET)
    assert {name: spans[-1].state for name, spans in again.lanes.items()} == {
        name: spans[-1].state for name, spans in recent.lanes.items()
    }
    assert {bar.goal_id for bar in again.bars} == {"g297", "g298", "g299"}


@given(st.lists(st.sampled_from([State.VALIDATING, State.DISPATCHING, State.RUNNING, None]), max_size=300))
@settings(max_examples=60)
def test_a_goal_that_is_modified_for_hours_has_the_bar_of_all_its_statuses(told: list[State | None]) -> None:
    recent, whole = RecentHistory(SKILLSET), History(SKILLSET)
    for number, state in enumerate(told):
        terminal = None if state else DONE
        each = status(0, state or State.TERMINATED, float(number), terminal=terminal)
        recent.add_status(each)
        whole.add_status(each)
        told_early = State.RUNNING in told[: STATUSES_KEPT // 2]
        if told_early or number < STATUSES_KEPT:
            assert recent.bar("g0") == whole.bar("g0")
    assert len(recent.lasting_statuses) <= STATUSES_KEPT
