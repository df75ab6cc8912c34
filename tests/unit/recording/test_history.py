"""The history is a function of the set of messages: not of their order, nor of repetitions."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_mission import SKILLSET, tell

from skillwing.dsl.model import Resource, Skillset
from skillwing.services.history.history import GoalOutcome, History, StateSpan
from skillwing.services.history.wording import NEAREST, abridge, chain_text
from skillwing.services.protocol import Ending, GoalStatus, Record, RecordKind, State, Terminal

STORY = tell()


def outcomes(history: History) -> dict[str, GoalOutcome]:
    return {bar.goal_id: bar.outcome for bar in history.bars}


@given(st.data())
def test_order_and_repetition_change_nothing(data: st.DataObject) -> None:
    expected = History.of(STORY.records, STORY.statuses, SKILLSET)
    records = data.draw(st.permutations(STORY.records)) + data.draw(st.lists(st.sampled_from(STORY.records)))
    statuses = data.draw(st.permutations(STORY.statuses)) + data.draw(st.lists(st.sampled_from(STORY.statuses)))
    history = History.of(records, statuses, SKILLSET)
    assert history.bars == expected.bars
    assert history.lanes == expected.lanes
    assert history.switches == expected.switches
    assert history.records == expected.records


def test_an_effect_whose_clock_is_behind_comes_after_the_step_that_caused_it() -> None:
    def record(id: str, t: float, subject: str, cause: str | None) -> Record:
        kind = RecordKind.RESOURCE if subject == "axes" else RecordKind.GOAL
        return Record(id=id, t=t, source=id, kind=kind, subject=subject, before="", after="", cause=cause)

    ended = record("resource_manager#7126", 7.1265, "takeoff", None)
    freed = record("resource_manager#7127", 7.1265, "axes", ended.id)
    end = record("skill/takeoff#7125", 7.1251, "takeoff", ended.id)
    switch = record("mission#7124", 7.1250, "mission", end.id)
    later = record("mission#7128", 7.1270, "mission", None)
    expected = (ended, freed, end, switch, later)
    assert History.of(expected, []).records == History.of(reversed(expected), []).records == expected


def test_bars_have_the_colours_of_their_endings() -> None:
    history = History.of(STORY.records, STORY.statuses)
    assert outcomes(history) == {
        "g1": GoalOutcome.SUCCESS,
        "g2": GoalOutcome.FAILURE,
        "g3": GoalOutcome.FAILURE,
        "g4": GoalOutcome.INTERRUPTED,
        "g5": GoalOutcome.FAILURE,
        "g6": GoalOutcome.INTERRUPTED,
        "g7": GoalOutcome.SUCCESS,
        "g8": GoalOutcome.SUCCESS,
    }
    bar = history.bar("g3")
    assert (bar.t_start, bar.t_end, bar.terminal) == (6.4, 12.0, "S_BLOCKED")
    assert [bar.goal_id for bar in history.bars if bar.refused] == ["g5"]


@pytest.mark.parametrize("ending", list(Ending))
def test_only_a_success_that_held_is_green(ending: Ending) -> None:
    for success in (True, False):
        terminal = Terminal(ending=ending, reason="", result="R", success=success)
        status = GoalStatus(goal_id="g", skill="s", state=State.TERMINATED, t=1.0, terminal=terminal)
        green = History.of([], [status]).bar("g").outcome is GoalOutcome.SUCCESS
        assert green == (ending is Ending.SUCCEEDED and success)


def test_a_goal_of_a_dead_manager_is_ended_by_its_observer() -> None:
    running = GoalStatus(goal_id="g", skill="goto", state=State.RUNNING, t=3.0)
    noticed = Record(
        id="resource_manager#1",
        t=5.0,
        source="resource_manager",
        kind=RecordKind.GOAL,
        subject="goto",
        before="RUNNING",
        after="LOST",
        text="the manager of goto is gone",
        goal_id="g",
    )
    assert History.of([], [running]).bar("g").outcome is GoalOutcome.RUNNING
    bar = History.of([noticed], [running]).bar("g")
    assert (bar.t_end, bar.terminal, bar.outcome, bar.reason) == (5.0, "LOST", GoalOutcome.FAILURE, noticed.text)


def test_the_manager_overrules_the_observer() -> None:
    terminal = Terminal(ending=Ending.SUCCEEDED, result="ARRIVED", success=True, reason="arrived")
    ended = GoalStatus(goal_id="g", skill="goto", state=State.TERMINATED, t=4.0, terminal=terminal)
    noticed = Record(
        id="m#1", t=5.0, source="m", kind=RecordKind.GOAL, subject="goto", before=None, after="LOST", goal_id="g"
    )
    assert History.of([noticed], [ended]).bar("g").terminal == "S_ARRIVED"


def test_one_failure_reads_as_one_chain() -> None:
    (switch,) = History.of(STORY.records).switches
    assert (switch.t, switch.before, switch.after) == (20.54, "ZED branch", "LiDAR branch")
    assert chain_text(switch.chain) == (
        "zed blackout ON -> zed FAILED -> zed_status FAILED -> zed_depthmap RI -> branch LiDAR branch"
    )


def test_of_what_a_goal_went_through_a_chain_says_the_end() -> None:
    steps = [("zed", RecordKind.FAULT, "blackout"), ("zed", RecordKind.HEALTH, "FAILED")]
    steps += [("goto", RecordKind.GOAL, after) for after in ("GRANTED", "RUNNING", "LOST")]
    chain = [
        Record(id=f"p#{n}", t=0.0, source="p", kind=kind, subject=subject, before=None, after=after)
        for n, (subject, kind, after) in enumerate(steps)
    ]
    assert chain_text(chain) == "zed blackout -> zed FAILED -> goto LOST"
    assert chain_text([]) == ""


def test_of_a_long_chain_the_root_and_the_nearest_causes_are_shown() -> None:
    """The note on causes that are left out takes as much room as one cause. So a single cause is never left out."""
    for length in range(20):
        causes = [f"cause {number}" for number in range(length)]
        told = abridge(causes)
        left_out = [cause for cause in causes if cause not in told]
        assert told[:1] == causes[:1]
        assert told[-NEAREST:] == causes[-NEAREST:]
        assert (f"... {len(left_out)} more" in told) == bool(left_out)
        assert len(left_out) != 1


def test_a_chain_ends_at_what_was_not_seen_and_in_a_circle() -> None:
    def record(name: str, cause: str) -> Record:
        return Record(
            id=name, t=0.0, source="p", kind=RecordKind.DATA, subject=name, before=None, after="x", cause=cause
        )

    assert [r.id for r in History.of([record("a", "never seen")]).chain("a")] == ["a"]
    assert {r.id for r in History.of([record("a", "b"), record("b", "a")]).chain("a")} == {"a", "b"}
    assert History().chain(None) == ()


def test_unchanged_resources_keep_their_initial_state() -> None:
    lanes = History.of(STORY.records, (), SKILLSET).lanes
    assert lanes["battery_status"] == (StateSpan("NORMAL", 0.0, None),)
    assert [span.state for span in lanes["zed_status"]] == ["UNKNOWN", "OK", "FAILED"]


@given(st.lists(st.tuples(st.floats(0, 100), st.sampled_from(["A", "B", "C"])), max_size=20))
def test_lanes_have_no_gaps_and_no_overlaps(changes: list[tuple[float, str]]) -> None:
    before, records = "A", list[Record]()
    for number, (t, state) in enumerate(sorted(changes, key=lambda change: change[0])):
        records.append(
            Record(id=f"m#{number}", t=t, source="m", kind=RecordKind.RESOURCE, subject="r", before=before, after=state)
        )
        before = state
    spans = History.of(records, (), Skillset("s", resources=(Resource("r", ("A", "B", "C"), "A", ()),))).lanes["r"]
    assert spans[0].t_start == 0.0
    assert spans[-1].t_end is None
    assert spans[-1].state == before
    assert all(a.t_end == b.t_start for a, b in pairwise(spans))


def said(t: float, source: str, after: str, number: int) -> tuple[GoalStatus, Record]:
    """A status of the goal g and its record."""
    terminal = Terminal(ending=Ending.LOST, reason="silent") if after == "LOST" else None
    state = State.TERMINATED if terminal else State(after)
    status = GoalStatus(
        goal_id="g", skill="lift", state=state, t=t, terminal=terminal, record=f"{source}#{number}", source=source
    )
    record = status.as_record()
    assert record is not None
    return status, record


@given(st.data())
def test_a_goal_of_a_manager_that_hung_has_one_ending(data: st.DataObject) -> None:
    """The resource manager loses it, the client says so, and the manager says more when it wakes up."""
    manager = [
        said(1.0, "skill/lift", "DISPATCHING", 1),
        said(8.0, "skill/lift", "RUNNING", 2),
        said(8.5, "skill/lift", "LOST", 3),
    ]
    others = [said(5.0, "resource_manager", "LOST", 1)[1], said(6.0, "client/mission", "LOST", 1)[1]]
    records = data.draw(st.permutations([*(record for _, record in manager), *others]))
    statuses = data.draw(st.permutations([status for status, _ in manager]))
    until = data.draw(st.integers(1, len(statuses)))
    history = History.of(records, statuses[:until])
    bar = history.bar("g")
    assert (bar.t_end, bar.terminal, bar.record) == (max(5.0, bar.t_start), "LOST", "resource_manager#1")
    assert [record.after for record in history.timeline] == ["DISPATCHING", "LOST"]
    assert len(history.records) == 5, "nothing is forgotten"


def test_an_end_by_the_manager_before_the_loss_of_its_goal_counts() -> None:
    """The resource manager was away, the goal got its end without it, and was lost afterwards."""
    status, record = said(4.0, "skill/lift", "LOST", 1)
    history = History.of([record, said(5.0, "resource_manager", "LOST", 1)[1]], [status])
    assert (history.bar("g").t_end, history.bar("g").record) == (4.0, "skill/lift#1")
