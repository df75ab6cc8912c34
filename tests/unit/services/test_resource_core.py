"""The resource manager's judgement, rule by rule of docs/semantics.md: goals begin, end, and lose what they hold."""

from __future__ import annotations

import pytest
from gate import Gate
from rig import RIG, Bench, granted

from skillwing.services.core.events import TimePassed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.snapshot import FinishedGoal, ResourceEntry, Snapshot
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import NO_TOKEN, DataSample, Ended, EndKind, NotReady, Record, Violated


def test_every_failing_precondition_is_named_with_its_reason() -> None:
    bench = Bench()
    bench.extern("authority", "OFF")
    verdict = bench.begin("move", "g")
    assert isinstance(verdict, NotReady)
    assert verdict.failing == {
        "authority": "`authority == ON` does not hold: authority is OFF.",
        "charged": "`battery > 15.0` does not hold: battery is stale or was never published.",
    }
    assert bench.core.states["axes"] == "FREE"


def test_two_goals_cannot_both_take_the_axes(bench: Bench) -> None:
    granted(bench.begin("move", "g1"))
    verdict = bench.begin("move", "g2")
    assert isinstance(verdict, NotReady)
    assert list(verdict.failing) == ["free"]


def test_a_start_effect_that_cannot_apply_is_not_half_applied(bench: Bench) -> None:
    bench.extern("lamp", "BROKEN")
    verdict = bench.begin("carry", "g")
    assert isinstance(verdict, NotReady)
    assert verdict.failing == {
        "effect take": "The effect `take` cannot be applied: `lamp` has no internal transition from BROKEN to LIT."
    }
    assert bench.core.states["axes"] == "FREE"


def test_begin_again_with_the_same_id_takes_nothing_twice(bench: Bench) -> None:
    first = bench.begin("move", "g")
    number, published = bench.core.last_step, len(bench.published)
    assert bench.begin("move", "g") == first
    assert (bench.core.last_step, len(bench.published)) == (number, published)


def test_begin_again_after_the_goal_was_violated_tells_so(bench: Bench) -> None:
    bench.begin("move", "g")
    bench.extern("authority", "OFF")
    assert isinstance(bench.begin("move", "g"), Violated)
    assert bench.core.states["axes"] == "FREE"


def test_tokens_grow_and_outgrow_those_of_an_earlier_process() -> None:
    first, second = Bench(), Bench()
    first.now, second.now = 10.0, 20.0
    tokens = []
    for bench in (first, second):
        for number in range(3):
            tokens.append(granted(bench.begin("watch", f"g{number}")).token)
    assert tokens == sorted(set(tokens))


@pytest.mark.parametrize(
    ("how", "result", "held"),
    [
        (EndKind.RESULT, "DONE", True),
        (EndKind.RESULT, "STUCK", True),
        (EndKind.INTERRUPT, None, True),
        (EndKind.ERROR, None, True),
    ],
)
def test_every_end_gives_back_what_the_goal_took(bench: Bench, how: EndKind, result: str | None, held: bool) -> None:
    token = granted(bench.begin("move", "g")).token
    ended = bench.end("move", "g", token, how, result)
    assert isinstance(ended, Ended)
    assert (ended.held, bench.core.states["axes"], bench.core.grants) == (held, "FREE", ())
    assert bench.end("move", "g", token, how, result) == ended


def test_a_postcondition_that_does_not_hold_leaves_the_effect_applied(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.extern("door", "OPEN")
    ended = bench.end("move", "g", token, result="STUCK")
    assert isinstance(ended, Ended)
    assert not ended.held
    assert ended.reason == "The postcondition `door == CLOSED` does not hold: door is OPEN."
    assert bench.core.states["axes"] == "FREE"


def test_mistake_an_effect_that_could_not_apply_still_says_success(bench: Bench) -> None:
    token = granted(bench.begin("carry", "g")).token
    bench.extern("lamp", "BROKEN")
    ended = bench.end("carry", "g", token, result="END")
    assert isinstance(ended, Ended)
    assert not ended.held
    assert "`lamp` has no internal transition from BROKEN to OFF" in ended.reason
    assert bench.core.states["axes"] == "USED", "nothing is half-applied"


def test_mistake_the_invariant_loop_stops_early(bench: Bench) -> None:
    """`watch` is judged first and holds; only what the later goals give back breaks it."""
    for skill in ("watch", "move", "shine"):
        granted(bench.begin(skill, skill))
    bench.published.clear()
    bench.extern("authority", "OFF", cause="camera#1")
    assert bench.violations == [("move", "authority"), ("shine", "moving"), ("watch", "something")]
    assert bench.core.grants == ()
    last = bench.of(Violated)[-1]
    assert bench.chain(last.record) == [
        "camera#1",
        "authority OFF",
        "move.authority VIOLATED",
        "axes FREE",
        "shine.moving VIOLATED",
        "lamp OFF",
        "watch.something VIOLATED",
    ]


def test_what_one_goal_gives_back_may_end_another_in_the_same_step(bench: Bench) -> None:
    token = granted(bench.begin("move", "m")).token
    bench.begin("shine", "s")
    ended = bench.end("move", "m", token, result="DONE")
    assert bench.violations == [("shine", "moving")]
    assert isinstance(ended, Ended)
    assert bench.chain(bench.of(Violated)[0].record)[-3:] == ["move ENDED", "axes FREE", "shine.moving VIOLATED"]


def test_a_goal_whose_own_end_breaks_its_invariant_just_ends(bench: Bench) -> None:
    bench.begin("move", "m")
    token = granted(bench.begin("shine", "s")).token
    bench.end("shine", "s", token, result="END")
    assert bench.violations == []


def test_an_invariant_that_is_false_from_the_start_ends_the_goal_in_the_same_step(bench: Bench) -> None:
    verdict = bench.begin("shine", "s")
    assert isinstance(verdict, Violated)
    assert bench.core.states["lamp"] == "OFF"


def test_a_violation_effect_that_cannot_apply_is_said_aloud(bench: Bench) -> None:
    bench.begin("move", "m")
    bench.begin("shine", "s")
    bench.extern("lamp", "BROKEN")
    bench.extern("authority", "OFF")
    violated = bench.of(Violated)[-1]
    assert violated.skill == "shine"
    assert "The effect `dark` could not be applied" in violated.reason


def test_stale_data_break_an_invariant_when_their_time_comes(bench: Bench) -> None:
    bench.begin("move", "g")
    assert bench.core.next_tick(bench.now) == 3.0
    bench.now = 2.999
    bench.perform(bench.core.step(TimePassed(), bench.now))
    assert bench.violations == []
    bench.now = 3.0
    bench.perform(bench.core.step(TimePassed(), bench.now))
    assert bench.violations == [("move", "charged")]
    assert bench.of(Violated)[0].subject == "battery"
    assert bench.chain(bench.of(Violated)[0].record) == ["battery STALE", "move.charged VIOLATED"]
    assert bench.core.next_tick(bench.now) is None


def test_a_datum_breaks_an_invariant_as_it_comes_in(bench: Bench) -> None:
    bench.begin("move", "g")
    bench.battery(9.0)
    assert bench.violations == [("move", "charged")]


@pytest.mark.parametrize("value", ["full", None, True, float("nan"), {"percent": 3}])
def test_a_datum_of_a_wrong_type_is_refused_and_the_old_value_stays(bench: Bench, value: object) -> None:
    with pytest.raises(RefusedError, match="battery"):
        bench.battery(value)
    granted(bench.begin("move", "g"))


def test_a_stamp_from_the_future_does_not_keep_a_value_fresh(bench: Bench) -> None:
    bench.now = 1.0
    bench.core.step(DataSample(name="battery", value=90.0, t=1e9), bench.now)
    bench.now = 5.0
    assert isinstance(bench.begin("move", "g"), NotReady)


def test_a_goal_that_is_not_ready_has_its_failure_effect_and_is_remembered() -> None:
    gate = Gate()
    gate.now = 0.5
    verdict = gate.lift(z=6.0, cause="skill/lift#1")
    assert isinstance(verdict, NotReady)
    assert (gate.core.states["flag"], gate.core.states["arm"], gate.core.grants) == ("UP", "FREE", ())
    [refused] = gate.of(Record, lambda record: record.id == verdict.record)
    assert (refused.after, refused.goal_id, refused.cause) == ("NOT_READY", "g", None), "no record shows inputs"
    [raised] = gate.of(Record, lambda record: record.subject == "flag")
    assert (raised.cause, raised.goal_id) == (verdict.record, "g")
    assert gate.changes == [("flag", "UP")]
    assert gate.kept[-1] == FinishedGoal("g", "lift", NO_TOKEN, verdict)
    assert gate.lift(z=1.0) == verdict, "the id of a goal that was refused is used up"
    with pytest.raises(RefusedError, match="belongs to `lift`"):
        gate.begin("weigh", "g")


@pytest.mark.parametrize(
    ("charge", "before", "skill", "causes"),
    [
        (80.0, ["authority OFF", "door OPEN"], "move", ["authority OFF"]),
        (80.0, ["lamp BROKEN", "door OPEN"], "carry", ["lamp BROKEN"]),
        (None, ["authority OFF"], "move", ["authority OFF"]),
        (None, ["door OPEN"], "move", ["battery STALE"]),
        (5.0, ["authority OFF", "authority ON"], "move", ["battery 5.0"]),
    ],
    ids=["a check", "the start effect", "a resource before a datum", "a stale datum", "the value of a datum"],
)
def test_a_goal_that_is_not_ready_is_put_down_to_what_makes_its_preconditions_fail(
    charge: float | None, before: list[str], skill: str, causes: list[str]
) -> None:
    bench = Bench()
    if charge is not None:
        bench.battery(charge)
    for change in before:
        bench.extern(*change.split())
    verdict = bench.begin(skill, "g", cause="skill/move#1")
    assert isinstance(verdict, NotReady)
    assert bench.chain(verdict.record) == [*causes, f"{skill} NOT_READY"]


def test_a_failure_effect_that_cannot_apply_is_loud_and_hides_no_precondition() -> None:
    gate = Gate()
    gate.extern("flag", "BROKEN")
    verdict = gate.lift(z=6.0)
    assert isinstance(verdict, NotReady)
    assert list(verdict.failing) == ["near", "effect warn"]
    assert "no internal transition from BROKEN to UP" in verdict.failing["effect warn"]
    assert gate.core.states["flag"] == "BROKEN"


def test_a_token_is_the_robot_time_in_milliseconds_or_the_next_number(bench: Bench) -> None:
    """A process without a journal continues above the tokens of its predecessor, as long as the clock does."""
    bench.now = 2.5
    assert granted(bench.begin("watch", "w1")).token == 2500
    assert granted(bench.begin("watch", "w2")).token == 2501
    bench.now = 1000.001
    assert granted(bench.begin("watch", "w3")).token == 1_000_001


def test_states_come_with_the_number_and_the_series_of_their_step() -> None:
    core = ResourceCore(RIG, source="rm", new_record_id=RecordIds("rm"), snapshot=Snapshot(step=7, epoch="of now"))
    states = core.resource_states(3.0)
    assert (states.step, states.epoch, states.t) == (7, "of now", 3.0)


def test_a_resource_that_never_changed_has_no_record() -> None:
    entries = Bench().core.initial_entries()
    assert entries[0] == ResourceEntry("authority", "ON", 0, "")
