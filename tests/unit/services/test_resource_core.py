"""The resource manager's judgement, rule by rule of docs/semantics.md."""

from __future__ import annotations

from typing import Any

import pytest
from gate import Gate
from rig import RIG, Bench

from skillwing.services.core.checks import LONGEST_GOAL_ID
from skillwing.services.core.grants import NO_TOKEN
from skillwing.services.core.kept import GoalOver, ManagerNoted
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import (
    AttachManager,
    BeginGoal,
    DataSample,
    Ended,
    ErrorCode,
    FireEvent,
    FireExtern,
    Granted,
    Lost,
    NotReady,
    Record,
    RecordKind,
    RenewGoal,
    ResourceChange,
    Violated,
)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.battery(80.0)
    return bench


def granted(verdict: object) -> Granted:
    assert isinstance(verdict, Granted)
    return verdict


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
    revision, published = bench.core.revision, len(bench.published)
    assert bench.begin("move", "g") == first
    assert (bench.core.revision, len(bench.published)) == (revision, published)


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
    [("result", "DONE", True), ("result", "STUCK", True), ("interrupt", None, True), ("error", None, True)],
)
def test_every_end_gives_back_what_the_goal_took(bench: Bench, how: str, result: str | None, held: bool) -> None:
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
    bench.perform(bench.core.tick(bench.now))
    assert bench.violations == []
    bench.now = 3.0
    bench.perform(bench.core.tick(bench.now))
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
    bench.core.update_datum(DataSample(name="battery", value=90.0, t=1e9), bench.now)
    bench.now = 5.0
    assert isinstance(bench.begin("move", "g"), NotReady)


@pytest.mark.parametrize(
    ("resource", "target", "code", "known"),
    [
        ("axes", "USED", ErrorCode.NOT_ALLOWED, ()),
        ("lamp", "LIT", ErrorCode.NOT_ALLOWED, ("BROKEN",)),
        ("authority", "MAYBE", ErrorCode.UNKNOWN_NAME, ("ON", "OFF")),
        ("autority", "OFF", ErrorCode.UNKNOWN_NAME, ("authority", "door", "axes", "lamp")),
    ],
)
def test_refused_extern_transitions_say_what_exists(
    bench: Bench, resource: str, target: str, code: ErrorCode, known: tuple[str, ...]
) -> None:
    with pytest.raises(RefusedError) as refusal:
        bench.extern(resource, target)
    assert refusal.value.code is code
    assert set(known) <= set(refusal.value.known)
    assert bench.core.revision == 0


def test_naming_the_state_that_is_changes_nothing(bench: Bench) -> None:
    assert bench.extern("authority", "ON").revision == 0
    assert bench.changes == []


def test_an_event_is_all_or_nothing_and_guarded(bench: Bench) -> None:
    event = FireEvent(event="storm", source="test")
    bench.perform(bench.core.fire_event(event, 0.0))
    assert bench.changes == [("authority", "OFF", 1), ("door", "OPEN", 1)]
    with pytest.raises(RefusedError, match="authority is OFF"):
        bench.core.fire_event(event, 0.0)
    with pytest.raises(RefusedError) as refusal:
        bench.core.fire_event(FireEvent(event="strom", source="test"), 0.0)
    assert refusal.value.known == ("storm",)


def test_a_lost_manager_loses_its_goals_and_its_token(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.perform(bench.core.manager_lost("skill/shine", 0.0))
    assert bench.core.states["axes"] == "USED"
    bench.perform(bench.core.manager_lost("skill/move", 0.0))
    assert bench.core.states["axes"] == "FREE"
    lost = bench.of(Lost)
    assert [(each.goal_id, each.token) for each in lost] == [("g", token)]
    assert [record.after for record in bench.of(Record, lambda record: record.id == lost[0].record)] == ["LOST"]
    granted(bench.begin("move", "next"))
    for call in (
        lambda: bench.end("move", "g", token, result="DONE"),
        lambda: bench.begin("move", "g"),
        lambda: bench.core.renew(RenewGoal(goal_id="g", skill="move", token=token)),
    ):
        with pytest.raises(RefusedError) as refusal:
            call()
        assert refusal.value.code is ErrorCode.STALE_TOKEN
    assert bench.core.states["axes"] == "USED", "what the old process says frees nothing of the new one's"


def test_the_begin_of_a_later_incarnation_takes_what_the_earlier_one_held(bench: Bench) -> None:
    granted(bench.begin("move", "g", incarnation="first"))
    granted(bench.begin("move", "next", incarnation="second"))
    assert [each.goal_id for each in bench.of(Lost)] == ["g"]
    with pytest.raises(RefusedError) as refusal:
        bench.begin("move", "late", incarnation="first")
    assert refusal.value.code is ErrorCode.REPLACED
    assert [grant.goal_id for grant in bench.core.grants] == ["next"]


def test_an_incarnation_that_attaches_again_loses_nothing(bench: Bench) -> None:
    granted(bench.begin("move", "g", incarnation="first"))
    for manager, incarnation in (("skill/move", "first"), ("skill/shine", "other")):
        request = AttachManager(manager=manager, incarnation=incarnation)
        bench.perform(bench.core.attach_manager(request, 0.0))
    assert bench.core.states["axes"] == "USED"
    bench.perform(bench.core.attach_manager(AttachManager(manager="skill/move", incarnation="second"), 0.0))
    assert bench.core.states["axes"] == "FREE"


def test_a_goal_given_up_before_its_begin_arrives_is_never_granted(bench: Bench) -> None:
    assert isinstance(bench.end("move", "g", 0, "error"), Ended)
    assert isinstance(bench.begin("move", "g"), Ended)
    assert bench.core.states["axes"] == "FREE"


def test_a_goal_given_up_without_its_token_is_freed_all_the_same(bench: Bench) -> None:
    bench.begin("move", "g", incarnation="this")
    assert isinstance(bench.end("move", "g", 0, "error", incarnation="this"), Ended)
    assert bench.core.states["axes"] == "FREE"


@pytest.mark.parametrize("attached", [True, False])
def test_a_goal_of_the_successor_is_not_given_up_by_a_process_without_its_token(bench: Bench, attached: bool) -> None:
    if attached:
        bench.perform(bench.core.attach_manager(AttachManager(manager="skill/move", incarnation="first"), 0.0))
    granted(bench.begin("move", "g", incarnation="second"))
    for incarnation in ("first", ""):
        with pytest.raises(RefusedError) as refusal:
            bench.end("move", "g", 0, "error", incarnation=incarnation)
        assert refusal.value.code is ErrorCode.STALE_TOKEN
    assert bench.core.states["axes"] == "USED"


@pytest.mark.parametrize(
    ("how", "result", "token", "code"),
    [
        ("result", "DONE", 99, ErrorCode.STALE_TOKEN),
        ("result", "DOEN", None, ErrorCode.UNKNOWN_NAME),
        ("result", None, None, ErrorCode.BAD_REQUEST),
        ("vanish", None, None, ErrorCode.BAD_REQUEST),
    ],
)
def test_a_malformed_end_frees_nothing(
    bench: Bench, how: str, result: str | None, token: int | None, code: ErrorCode
) -> None:
    real = granted(bench.begin("move", "g")).token
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "g", token or real, how, result)
    assert refusal.value.code is code
    assert bench.core.states["axes"] == "USED"


def test_ends_of_unknown_goals_and_borrowed_ids_are_refused(bench: Bench) -> None:
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "nobody", 1, result="DONE")
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL
    bench.begin("move", "g")
    with pytest.raises(RefusedError, match="belongs to `move`"):
        bench.begin("watch", "g")
    with pytest.raises(RefusedError, match="characters"):
        bench.begin("move", "x" * 1000)


def test_a_foreign_schema_is_refused_naming_both(bench: Bench) -> None:
    request = BeginGoal(goal_id="g", skill="move", inputs={}, manager="m", owner="o", schema="abcd")
    with pytest.raises(RefusedError) as refusal:
        bench.core.begin(request, 0.0)
    assert refusal.value.code is ErrorCode.SCHEMA_MISMATCH
    assert "abcd" in str(refusal.value)
    assert RIG.schema_hash in str(refusal.value)


# --- what a process of a manager is told of its goals, and those of others -------------------------------------------


def test_a_renewal_tells_how_the_goal_stands(bench: Bench) -> None:
    grant = granted(bench.begin("move", "g"))
    assert bench.renew("move", "g", grant.token) == grant
    ended = bench.end("move", "g", grant.token, result="DONE")
    assert bench.renew("move", "g", grant.token) == ended
    for skill, goal_id, token, code in (
        ("move", "g2", grant.token, ErrorCode.UNKNOWN_GOAL),
        ("fly", "g", grant.token, ErrorCode.UNKNOWN_NAME),
        ("watch", "g", grant.token, ErrorCode.BAD_REQUEST),
    ):
        with pytest.raises(RefusedError) as refusal:
            bench.renew(skill, goal_id, token)
        assert refusal.value.code is code
        assert (skill if code is ErrorCode.UNKNOWN_NAME else goal_id) in refusal.value.message
    assert bench.of(Lost) == []


def test_a_renewal_with_another_token_is_refused(bench: Bench) -> None:
    bench.now = 1.0
    token = granted(bench.begin("move", "g")).token
    for wrong in (token - 1, token + 1):
        with pytest.raises(RefusedError, match="g was granted with") as refusal:
            bench.renew("move", "g", wrong)
        assert refusal.value.code is ErrorCode.STALE_TOKEN
    assert bench.core.states["axes"] == "USED"


def test_a_successor_that_asks_for_its_predecessors_goal_is_told_that_it_was_lost(bench: Bench) -> None:
    bench.now = 1.0
    first = granted(bench.begin("move", "g", incarnation="first"))
    bench.now = 2.0
    verdict = bench.begin("move", "g", incarnation="second")
    assert isinstance(verdict, Lost)
    assert (verdict.goal_id, verdict.skill, verdict.token, verdict.t) == ("g", "move", first.token, 2.0)
    assert verdict.reason == "The manager `skill/move` was lost: another process has taken its place."
    [record] = bench.of(Record, lambda record: record.id == verdict.record)
    assert (record.after, record.goal_id, record.text) == ("LOST", "g", verdict.reason)
    assert record.cause == first.record
    assert bench.core.states["axes"] == "FREE"
    with pytest.raises(RefusedError) as refusal:
        bench.begin("move", "g", incarnation="first")
    assert refusal.value.code in (ErrorCode.REPLACED, ErrorCode.STALE_TOKEN)


def test_a_replaced_process_that_asks_for_its_successors_goal_takes_nothing(bench: Bench) -> None:
    bench.attach("skill/move", "first")
    second = granted(bench.begin("move", "g", incarnation="second"))
    with pytest.raises(RefusedError) as refusal:
        bench.begin("move", "g", incarnation="first")
    assert refusal.value.code is ErrorCode.REPLACED
    assert bench.of(Lost) == []
    assert bench.begin("move", "g", incarnation="second") == second
    third = bench.begin("move", "g", incarnation="third")
    assert isinstance(third, Lost)
    assert bench.kept[-1] == GoalOver("g", "move", second.token, third)
    assert ManagerNoted("skill/move", "third") in bench.kept


def test_the_same_process_and_one_that_does_not_tell_get_the_same_grant_again(bench: Bench) -> None:
    first = granted(bench.begin("move", "g", incarnation="first"))
    assert bench.begin("move", "g", incarnation="first") == first
    assert bench.begin("move", "g") == first
    assert bench.begin("move", "g", manager="another", incarnation="second") == first
    assert bench.of(Lost) == []


def test_each_incarnation_is_noted_once_and_a_replaced_one_cannot_come_back(bench: Bench) -> None:
    for incarnation in ("first", "first", "second", "second"):
        states = bench.attach("skill/move", incarnation)
        assert (states.states, states.revision) == (dict(bench.core.states), bench.core.revision)
    bench.attach("skill/watch", "first")
    assert bench.kept == [
        ManagerNoted("skill/move", "first"),
        ManagerNoted("skill/move", "second"),
        ManagerNoted("skill/watch", "first"),
    ]
    with pytest.raises(RefusedError, match="place of this `skill/move`") as refusal:
        bench.attach("skill/move", "first")
    assert refusal.value.code is ErrorCode.REPLACED
    bench.attach("skill/watch", "first")


# --- events, and what is on record ---------------------------------------------------------------------------------


def test_an_event_tells_who_fired_it_why_and_what_it_broke(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    bench.now = 2.0
    bench.published.clear()
    states = bench.fire("storm", cause="sky#1")
    assert states.states == dict(bench.core.states)
    assert (states.states["authority"], states.states["door"], states.states["axes"]) == ("OFF", "OPEN", "FREE")
    assert bench.violations == [("move", "authority")]
    causes = [record for record in bench.of(Record) if record.kind is RecordKind.RESOURCE]
    assert [(each.subject, each.cause, each.text) for each in causes[:2]] == [
        ("authority", "sky#1", "event storm by test"),
        ("door", "sky#1", "event storm by test"),
    ]
    with pytest.raises(RefusedError, match=r"storm.*authority is OFF") as refusal:
        bench.fire("storm")
    assert refusal.value.code is ErrorCode.NOT_ALLOWED


def test_an_unknown_event_is_refused_naming_what_exists(bench: Bench) -> None:
    with pytest.raises(RefusedError, match="strom") as refusal:
        bench.fire("strom")
    assert (refusal.value.code, refusal.value.known) == (ErrorCode.UNKNOWN_NAME, ("storm",))


def test_a_refused_transition_names_the_targets_there_are_from_here(bench: Bench) -> None:
    with pytest.raises(RefusedError) as refusal:
        bench.extern("lamp", "LIT")
    assert refusal.value.known == ("BROKEN",)
    bench.extern("lamp", "BROKEN")
    with pytest.raises(RefusedError) as refusal:
        bench.extern("lamp", "LIT")
    assert refusal.value.known == ("OFF",)


def test_only_a_goal_makes_time_matter(bench: Bench) -> None:
    assert bench.core.next_tick(bench.now) is None
    granted(bench.begin("move", "g"))
    assert bench.core.next_tick(bench.now) == 3.0


@pytest.mark.parametrize(
    ("inputs", "named"), [({"speed": "fast"}, "speed"), ({"sped": 1.0}, "sped"), ({"speed": 99.0}, "speed")]
)
def test_inputs_that_do_not_fit_are_refused_by_name_and_leave_no_trace(
    bench: Bench, inputs: dict[str, Any], named: str
) -> None:
    with pytest.raises(RefusedError, match=f"`{named}`") as refusal:
        bench.begin("move", "g", **inputs)
    assert refusal.value.code is ErrorCode.BAD_REQUEST
    assert bench.core.states["axes"] == "FREE"
    granted(bench.begin("move", "g"))


def test_who_speaks_of_another_version_of_the_skillset_moves_nothing(bench: Bench) -> None:
    for call in (
        lambda schema: bench.core.fire_event(FireEvent(event="storm", source="test", schema=schema), 0.0),
        lambda schema: bench.core.fire_extern(
            FireExtern(resource="authority", target="OFF", source="test", schema=schema), 0.0
        ),
    ):
        with pytest.raises(RefusedError) as refusal:
            call("of another file")
        assert refusal.value.code is ErrorCode.SCHEMA_MISMATCH
        assert bench.core.states["authority"] == "ON"
        call(RIG.schema_hash)
        assert bench.core.states["authority"] == "OFF"
        bench.extern("authority", "ON")


@pytest.mark.parametrize(("length", "fits"), [(0, False), (1, True), (LONGEST_GOAL_ID, True)])
def test_a_goal_id_is_neither_empty_nor_without_bounds(bench: Bench, length: int, fits: bool) -> None:
    if fits:
        granted(bench.begin("move", "x" * length))
    for too_much in ("" if length == 0 else "x" * (LONGEST_GOAL_ID + 1),):
        with pytest.raises(RefusedError) as refusal:
            bench.begin("move", too_much)
        assert refusal.value.code is ErrorCode.BAD_REQUEST


def test_an_end_of_no_known_kind_is_told_which_there_are(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    with pytest.raises(RefusedError) as refusal:
        bench.end("move", "g", token, "vanish")
    assert refusal.value.known == ("result", "interrupt", "error", "ungranted")
    assert refusal.value.help


@pytest.mark.parametrize(("resource", "target", "mover"), [("axes", "USED", "skills"), ("lamp", "LIT", "BROKEN")])
def test_a_refused_transition_is_told_who_moves_the_resource(
    bench: Bench, resource: str, target: str, mover: str
) -> None:
    with pytest.raises(RefusedError, match="no extern transition") as refusal:
        bench.extern(resource, target)
    assert mover in refusal.value.help
    assert ("functional layer" in refusal.value.help) == bool(refusal.value.known)


# --- guards that speak of inputs, of data, and of parts of them ------------------------------------------------------


def test_a_precondition_is_judged_on_the_inputs_of_its_goal() -> None:
    gate = Gate()
    verdict = gate.lift("far", z=6.0)
    assert isinstance(verdict, NotReady)
    assert verdict.failing == {"near": "`goal.z < 5.0` does not hold: goal.z is 6."}
    granted(gate.lift("near", z=4.5))


def test_an_invariant_is_judged_on_the_inputs_of_its_goal() -> None:
    gate = Gate()
    granted(gate.lift(x=3.0))
    gate.height(2.5)
    assert gate.violations == []
    gate.height(4.0)
    [violated] = gate.of(Violated)
    assert (violated.invariant, violated.subject) == ("below", "at")
    assert violated.reason == "`at.z < goal.x` does not hold: at.z is 4, goal.x is 3."


@pytest.mark.parametrize(("x", "held"), [(3.0, False), (6.0, True)])
def test_a_postcondition_is_judged_on_the_inputs_of_its_goal(x: float, held: bool) -> None:
    gate = Gate()
    token = granted(gate.lift(x=x)).token
    gate.datum("heat", 5.0)
    ended = gate.end("lift", "g", token, result="UP")
    assert isinstance(ended, Ended)
    assert ended.held == held
    assert gate.core.states["arm"] == "FREE"


def test_an_invariant_on_nothing_but_inputs_blames_no_resource_of_the_same_name() -> None:
    gate = Gate()
    gate.extern("flag", "UP")
    violated = gate.lift(flag=False)
    assert isinstance(violated, Violated)
    assert (violated.invariant, violated.subject) == ("plain", "plain")
    assert gate.chain(violated.record) == ["lift GRANTED", "lift.plain VIOLATED"]


def test_exactly_the_data_that_a_guard_speaks_of_are_followed() -> None:
    """Be it that of an event, a precondition, an invariant or a result; an input's name stands for the input."""
    gate = Gate()
    assert gate.core.data_names == ("wind", "load", "at", "permit", "heat")
    gate.datum("spare", "of no type that it should have")


def test_an_event_may_be_guarded_by_data_or_by_nothing() -> None:
    gate = Gate()
    with pytest.raises(RefusedError, match="wind is 1") as refusal:
        gate.fire("gust")
    assert refusal.value.code is ErrorCode.NOT_ALLOWED
    gate.datum("wind", 10.0)
    gate.fire("gust")
    assert gate.core.states["flag"] == "UP"
    gate.fire("calm")
    assert gate.core.states["flag"] == "DOWN"


# --- what a refusal does ---------------------------------------------------------------------------------------------


def test_a_goal_that_is_not_ready_has_its_failure_effect_and_is_remembered() -> None:
    gate = Gate()
    gate.now = 0.5
    verdict = gate.lift(z=6.0, cause="skill/lift#1")
    assert isinstance(verdict, NotReady)
    assert (gate.core.states["flag"], gate.core.states["arm"], gate.core.grants) == ("UP", "FREE", ())
    [refused] = gate.of(Record, lambda record: record.id == verdict.record)
    assert (refused.after, refused.goal_id, refused.cause) == ("NOT_READY", "g", "skill/lift#1")
    [raised] = gate.of(Record, lambda record: record.subject == "flag")
    assert (raised.cause, raised.goal_id) == (verdict.record, "g")
    [change] = gate.of(ResourceChange)
    assert (change.resource, change.after, change.cause) == ("flag", "UP", verdict.record)
    assert gate.kept[-1] == GoalOver("g", "lift", NO_TOKEN, verdict)
    assert gate.lift(z=1.0) == verdict, "the id of a goal that was refused is used up"
    with pytest.raises(RefusedError, match="belongs to `lift`"):
        gate.begin("weigh", "g")


def test_a_failure_effect_that_cannot_apply_is_loud_and_hides_no_precondition() -> None:
    gate = Gate()
    gate.extern("flag", "BROKEN")
    verdict = gate.lift(z=6.0)
    assert isinstance(verdict, NotReady)
    assert list(verdict.failing) == ["near", "effect warn"]
    assert "no internal transition from BROKEN to UP" in verdict.failing["effect warn"]
    assert gate.core.states["flag"] == "BROKEN"
