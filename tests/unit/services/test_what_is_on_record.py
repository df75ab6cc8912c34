"""Ends that nobody asked for, as the resource manager reports them: to whom, why, and what it comes of."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rig import RIG, Bench, granted

from skillwing.dsl import parse
from skillwing.services.core.events import GoalSilent, ManagerExited, ManagerGone, TimePassed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.snapshot import FinishedGoal
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import (
    NO_TOKEN,
    BeginGoal,
    Ended,
    EndGoal,
    EndKind,
    ErrorCode,
    Lost,
    Record,
    RecordKind,
    Violated,
)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.battery(80.0)
    bench.now = 0.5
    return bench


def record_of(bench: Bench, record_id: str) -> Record:
    [record] = bench.of(Record, lambda record: record.id == record_id)
    return record


def change_of(bench: Bench, resource: str, state: str) -> Record:
    """The record of a resource's change."""
    [change] = bench.of(Record, lambda record: (record.subject, record.after) == (resource, state))
    return change


def test_what_a_goal_takes_and_gives_back_is_on_record_with_the_goal_and_its_cause(bench: Bench) -> None:
    grant = granted(bench.begin("move", "g", cause="skill/move#1"))
    bench.now = 0.75
    ended = bench.end("move", "g", grant.token, result="DONE", cause="skill/move#9")
    assert isinstance(ended, Ended)
    for step, after, cause, state in (
        (grant.record, "GRANTED", "skill/move#1", "USED"),
        (ended.record, "ENDED", "skill/move#9", "FREE"),
    ):
        record = record_of(bench, step)
        assert (record.subject, record.after, record.goal_id, record.cause) == ("move", after, "g", cause)
        changed = change_of(bench, "axes", state)
        assert (changed.goal_id, changed.cause) == ("g", step)


def test_what_a_lost_goal_gives_back_is_on_record_with_the_goal_and_its_loss(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    bench.perform(bench.core.step(ManagerGone("skill/move"), bench.now))
    [lost] = bench.of(Lost)
    assert lost.reason == "The manager `skill/move` was lost: its alive token is gone."
    record = change_of(bench, "axes", "FREE")
    assert (record.goal_id, record.cause) == ("g", lost.record)


def test_a_goal_that_is_lost_alone_leaves_the_others_of_its_manager(bench: Bench) -> None:
    lost, kept = granted(bench.begin("move", "g", manager="arm")), granted(bench.begin("watch", "w", manager="arm"))
    bench.now = 0.75
    bench.perform(bench.core.step(GoalSilent("g", "silent for 2.0 s"), bench.now))
    [verdict] = bench.of(Lost)
    assert (verdict.goal_id, verdict.skill, verdict.token) == ("g", "move", lost.token)
    assert verdict.reason == "The manager `arm` was lost: silent for 2.0 s."
    record = record_of(bench, verdict.record)
    assert (record.kind, record.subject, record.after) == (RecordKind.GOAL, "move", "LOST")
    assert (record.goal_id, record.cause, record.text) == ("g", None, verdict.reason), "the grant lost nothing"
    assert [grant.granted for grant in bench.core.grants] == [kept]
    said = len(bench.published)
    for goal_id in ("g", "nobody"):
        bench.perform(bench.core.step(GoalSilent(goal_id, "silent for 2.0 s"), bench.now))
    assert len(bench.published) == said


def test_what_is_given_up_before_its_begin_is_on_record_and_remembered(bench: Bench) -> None:
    request = EndGoal(goal_id="g", skill="move", token=NO_TOKEN, how=EndKind.ERROR, cause="skill/move#7")
    ended = bench.perform(bench.core.step(request, bench.now))
    assert isinstance(ended, Ended)
    assert (ended.goal_id, ended.held, ended.step) == ("g", False, bench.core.last_step)
    assert ended.reason == "The manager gave the goal up before it was granted."
    record = record_of(bench, ended.record)
    assert (record.subject, record.after, record.goal_id) == ("move", "ENDED", "g")
    assert (record.cause, record.text) == ("skill/move#7", ended.reason)
    assert bench.kept == [FinishedGoal("g", "move", NO_TOKEN, ended)]
    assert bench.perform(bench.core.step(request, bench.now)) == ended
    with pytest.raises(RefusedError, match=r"Token 5 .* goal g ") as refusal:
        bench.end("move", "g", 5, EndKind.ERROR)
    assert refusal.value.code is ErrorCode.STALE_TOKEN


@pytest.mark.parametrize(
    ("token", "how", "result"), [(0, EndKind.INTERRUPT, None), (0, EndKind.RESULT, "DONE"), (7, EndKind.ERROR, None)]
)
def test_only_who_never_heard_of_a_grant_gives_up_what_was_never_granted(
    bench: Bench, token: int, how: EndKind, result: str | None
) -> None:
    with pytest.raises(RefusedError, match="g was ever granted") as refusal:
        bench.end("move", "g", token, how, result)
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL
    assert bench.kept == []


def test_a_violation_names_the_goal_the_cause_and_the_token(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.now = 0.75
    bench.extern("authority", "OFF", cause="pilot#1")
    [verdict] = bench.of(Violated)
    assert (verdict.goal_id, verdict.skill, verdict.token) == ("g", "move", token)
    assert (verdict.invariant, verdict.subject) == ("authority", "authority")
    assert verdict.reason == "`authority == ON` does not hold: authority is OFF."
    record = record_of(bench, verdict.record)
    assert (record.kind, record.subject) == (RecordKind.GOAL, "move.authority")
    assert (record.before, record.after, record.text) == ("HOLDS", "VIOLATED", verdict.reason)
    assert record.goal_id == "g"
    assert bench.chain(verdict.record) == ["pilot#1", "authority OFF", "move.authority VIOLATED"]
    [freed] = bench.of(Record, lambda record: record.subject == "axes" and record.after == "FREE")
    assert (freed.cause, freed.goal_id) == (verdict.record, "g")


def test_a_datum_that_breaks_something_is_put_on_record_with_its_value(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    bench.battery(5.0)
    [verdict] = bench.of(Violated)
    assert (verdict.invariant, verdict.subject) == ("charged", "battery")
    record = record_of(bench, record_of(bench, verdict.record).cause or "")
    assert (record.kind, record.subject, record.before, record.after) == (RecordKind.DATA, "battery", None, "5.0")
    assert record.text == "`battery > 10.0` does not hold: battery is 5."


def test_a_datum_that_turned_stale_is_put_on_record_as_that(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    bench.now = 3.0
    bench.perform(bench.core.step(TimePassed(), bench.now))
    [verdict] = bench.of(Violated)
    record = record_of(bench, record_of(bench, verdict.record).cause or "")
    assert (record.subject, record.after) == ("battery", "STALE")


TWO = parse(
    """
    skillset two {
        data { load: float64 period=1.0  heat: float64 period=10.0 }
        resource left { initial UP  extern UP -> DOWN  extern DOWN -> UP }
        resource right { initial UP  extern UP -> DOWN  extern DOWN -> UP }
        resource arm { state { FREE USED SAFE }  initial FREE  FREE -> USED  USED -> FREE  USED -> SAFE  SAFE -> FREE }
        skill hold {
            effect { take: arm -> USED  release: arm -> FREE  secure: arm -> SAFE }
            precondition { free: resource=(arm == FREE)  success take }
            invariant {
                standing: resource=(left == UP or right == UP) violation=release
                light: data=(heat < 50.0 and load < 5.0) violation=release
            }
            interrupt { apply=release timeout=1.0 }
            lost { apply=secure }
            result { END: apply=release }
        }
    }
    """,
    "two.skillset",
)


@pytest.fixture
def two() -> Bench:
    bench = Bench()
    bench.core = ResourceCore(TWO, source="rm", new_record_id=RecordIds("rm"))
    bench.datum("heat", 20.0)
    bench.datum("load", 1.0)
    request = BeginGoal(
        goal_id="g", skill="hold", inputs={}, manager="skill/hold", owner="test", schema=TWO.schema_hash
    )
    granted(bench.perform(bench.core.step(request, bench.now)))
    return bench


def test_what_is_lost_has_an_effect_of_its_own_if_the_skillset_says_so(two: Bench) -> None:
    two.perform(two.core.step(ManagerGone("skill/hold"), two.now))
    assert two.core.states["arm"] == "SAFE"


def test_a_loss_has_the_exit_of_its_manager_as_its_cause(two: Bench) -> None:
    two.perform(two.core.step(ManagerExited("skill/hold", "launcher#1", two.now), two.now))
    assert two.core.grants, "the goal is lost only when the manager's token is gone"
    two.perform(two.core.step(ManagerGone("skill/hold"), two.now))
    [lost] = two.of(Lost)
    assert two.chain(lost.record)[0] == "launcher#1"


def test_a_successor_that_attaches_first_leaves_the_cause_as_it_is(two: Bench) -> None:
    two.perform(two.core.step(ManagerExited("skill/hold", "launcher#1", two.now), two.now))
    two.attach("skill/hold", "next")
    [lost] = two.of(Lost)
    assert two.chain(lost.record)[0] == "launcher#1"


@pytest.mark.parametrize(("manager", "before"), [("skill/hold", 0.1), ("skill/other", 0.0)])
def test_the_exit_of_a_predecessor_or_of_another_process_causes_no_loss(
    two: Bench, manager: str, before: float
) -> None:
    two.perform(two.core.step(ManagerExited(manager, "launcher#1", two.now - before), two.now))
    two.perform(two.core.step(ManagerGone("skill/hold"), two.now))
    [lost] = two.of(Lost)
    assert "launcher#1" not in two.chain(lost.record)


def test_what_is_lost_without_one_has_the_effect_of_an_interrupt() -> None:
    """A model that no file was read for may leave it open."""
    skills = tuple(replace(skill, lost=None) for skill in RIG.skills)
    bench = Bench(replace(RIG, skills=skills))
    bench.battery(80.0)
    granted(bench.begin("move", "g"))
    bench.perform(bench.core.step(ManagerGone("skill/move"), bench.now))
    assert bench.core.states["axes"] == "FREE"


@pytest.mark.parametrize(("first", "second"), [("left", "right"), ("right", "left")])
def test_of_several_resources_the_last_change_is_to_blame(two: Bench, first: str, second: str) -> None:
    two.extern(first, "DOWN")
    two.extern(second, "DOWN", cause="wind#1")
    [verdict] = two.of(Violated)
    assert verdict.subject == second
    assert two.chain(verdict.record)[0] == "wind#1"


def test_of_several_data_the_one_that_is_stale_is_to_blame(two: Bench) -> None:
    two.now = 3.0
    two.perform(two.core.step(TimePassed(), two.now))
    [verdict] = two.of(Violated)
    assert verdict.subject == "load"


def test_an_invariant_that_is_false_from_the_start_has_no_cause() -> None:
    bench = Bench(
        parse(
            """
            skillset s {
                resource valve { initial SHUT  OPEN -> SHUT  SHUT -> OPEN }
                resource log { initial EMPTY  EMPTY -> FULL  FULL -> EMPTY }
                skill pour {
                    effect { note: log -> FULL  clear: log -> EMPTY }
                    invariant { open: resource=(valve == OPEN) violation=note }
                    result { DONE: apply=clear }
                    interrupt { apply=clear }
                }
                skill open { effect { open: valve -> OPEN }  result { OPEN: apply=open } }
            }
            """,
            "s.skillset",
        )
    )
    bench.begin("pour", "g", cause="skill/pour#1")
    [violated] = bench.of(Violated)
    assert record_of(bench, violated.record).cause is None, "not the start of its own goal"
