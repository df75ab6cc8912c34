"""A resource manager that continues from the snapshot of another one."""

from __future__ import annotations

from typing import Any

import pytest
from gate import GATE, Gate
from msgspec.structs import replace
from rig import Bench, granted
from soundness import assert_all_sound

from skillwing.services.core.events import Resumed, TimePassed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import REPEATED_SPAN, ResourceCore, publications_to_repeat
from skillwing.services.core.snapshot import (
    DatumEntry,
    FinishedGoal,
    GrantEntry,
    ManagerEntry,
    ResourceEntry,
    Snapshot,
)
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import ErrorCode, FireExtern, Granted, Record, RecordKind, Violated


def kept_by(bench: Bench) -> Snapshot:
    """Sum of the entries of a bench."""

    def of(kind: type[Any]) -> list[Any]:
        return [entry for entry in bench.kept if isinstance(entry, kind)]

    stood = [entry for entry in bench.core.initial_entries() if isinstance(entry, ResourceEntry)]
    stands: list[ResourceEntry] = of(ResourceEntry)
    resources = {entry.resource: entry for entry in (*stood, *stands)}
    ended: list[FinishedGoal] = of(FinishedGoal)
    over = {entry.goal_id: entry for entry in ended}
    opened: list[GrantEntry] = of(GrantEntry)
    return Snapshot(
        resources=tuple(resources.values()),
        grants=tuple(entry for entry in opened if entry.granted.goal_id not in over),
        goals=tuple(over.values()),
        managers=tuple(of(ManagerEntry)),
        data=tuple(of(DatumEntry)),
        last_token=max((entry.granted.token for entry in opened), default=0),
        step=bench.core.last_step,
        records=tuple(bench.of(Record)),
        t=bench.now,
    )


def successor(bench: Bench, now: float) -> tuple[Bench, tuple[Any, ...], tuple[Any, ...]]:
    """A bench that continues at `now`, the publications to repeat, and its own ones."""
    kept = kept_by(bench)
    later = Bench(bench.skillset)
    later.now = now
    later.core = ResourceCore(bench.skillset, source="rm", new_record_id=RecordIds("rm-again"), snapshot=kept)
    step = later.core.step(Resumed(), now)
    assert_all_sound(step.publications, now)
    return later, publications_to_repeat(kept), step.publications


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.battery(80.0)
    bench.now = 1.0
    return bench


def test_it_goes_on_with_the_same_states_goals_tokens_and_processes(bench: Bench) -> None:
    grant = granted(bench.begin("move", "g", incarnation="second"))
    bench.extern("door", "OPEN")
    later, _, said = successor(bench, 2.0)
    assert (later.core.states, later.core.last_step) == (bench.core.states, bench.core.last_step + 1)
    assert later.core.grants == bench.core.grants
    assert later.begin("move", "g", incarnation="second") == grant
    assert granted(later.begin("watch", "w")).token > grant.token
    [record] = said
    assert (record.kind, record.subject, record.before, record.after) == (RecordKind.PROCESS, "rm", None, "RESUMED")
    assert record.text == f"went on from its journal after step {bench.core.last_step} with 1 goal"


@pytest.mark.parametrize(("goals", "told"), [(0, "0 goals"), (2, "2 goals")])
def test_it_tells_with_how_many_goals(bench: Bench, goals: int, told: str) -> None:
    for skill in ("move", "watch")[:goals]:
        granted(bench.begin(skill, skill))
    _, _, [record] = successor(bench, 2.0)
    assert record.text.endswith(f"with {told}")


def test_it_says_again_what_may_not_have_been_heard_and_nothing_older(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    bench.now = 2.0
    bench.extern("authority", "OFF")
    [violated] = bench.of(Violated)
    records = bench.of(Record)
    _, again, _ = successor(bench, 1000.0)
    assert again == (*records, violated), "however long nobody was there to say it"
    bench.now = 2.0 + REPEATED_SPAN
    _, again, _ = successor(bench, 1000.0)
    assert again == (*(record for record in records if record.t == 2.0), violated)
    bench.now = 2.001 + REPEATED_SPAN
    _, again, _ = successor(bench, 1000.0)
    assert again == ()


def test_ends_that_everybody_asked_for_are_not_said_again(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.end("move", "g", token, result="DONE")
    _, again, _ = successor(bench, 2.0)
    assert all(isinstance(each, Record) for each in again)


def test_it_goes_on_with_the_answers_to_finished_goals(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    ended = bench.end("move", "g", token, result="DONE")
    later, _, _ = successor(bench, 2.0)
    assert later.end("move", "g", token, result="DONE") == ended
    assert later.begin("move", "g") == ended, "it runs no second time"
    assert later.core.states["axes"] == "FREE"


def test_data_count_as_fresh_for_as_long_as_they_may_be(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    later, _, _ = successor(bench, 10.0)
    with pytest.raises(RefusedError) as refusal:
        later.begin("move", "next")
    assert refusal.value.code is ErrorCode.UNAVAILABLE
    later.now = 12.9
    later.perform(later.core.step(TimePassed(), later.now))
    assert later.violations == []
    assert later.core.next_tick(later.now) == 13.0
    later.now = 13.0
    later.perform(later.core.step(TimePassed(), later.now))
    assert later.violations == [("move", "charged")]


def test_a_new_journal_begins_with_every_resource_as_it_stands(bench: Bench) -> None:
    core = ResourceCore(bench.skillset, source="rm", new_record_id=RecordIds("rm"), found={"door": "OPEN"})
    core.step(FireExtern(resource="authority", target="OFF", source="test"), 0.0)
    assert {
        (entry.resource, entry.state, entry.change_set)
        for entry in core.initial_entries()
        if isinstance(entry, ResourceEntry)
    } == {("authority", "OFF", 1), ("door", "OPEN", 0), ("axes", "FREE", 0), ("lamp", "OFF", 0)}


def test_a_replaced_process_stays_replaced(bench: Bench) -> None:
    for incarnation in ("first", "second"):
        bench.attach("skill/move", incarnation)
    later, _, _ = successor(bench, 2.0)
    with pytest.raises(RefusedError) as refusal:
        later.begin("move", "g", incarnation="first")
    assert refusal.value.code is ErrorCode.REPLACED
    granted(later.begin("watch", "w", manager="skill/move", incarnation="second"))


def test_the_first_news_of_a_datum_ends_the_wait_for_it(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    later, _, _ = successor(bench, 10.0)
    later.now = 10.5
    later.battery(5.0)
    assert later.violations == [("move", "charged")], "and no guard holds any longer for want of them"


# --- guards while the data are not known yet -------------------------------------------------------------------------


@pytest.fixture
def gate() -> Gate:
    gate = Gate()
    gate.now = 0.5
    return gate


def refused(call: Any) -> ErrorCode:
    with pytest.raises(RefusedError) as refusal:
        call()
    return refusal.value.code


def test_neither_an_event_nor_an_end_is_judged_on_data_that_may_be_fresh(gate: Gate) -> None:
    token = granted(gate.lift()).token
    later, _, _ = successor(gate, 10.0)
    assert refused(lambda: later.fire("gust")) is ErrorCode.UNAVAILABLE
    assert refused(lambda: later.end("lift", "g", token, result="UP")) is ErrorCode.UNAVAILABLE
    assert (later.core.states["arm"], later.published, later.kept) == ("USED", [], [])
    later.fire("calm")
    later.datum("heat", 1.0)
    later.end("lift", "g", token, result="UP")
    assert later.core.states["arm"] == "FREE"


def test_what_names_no_datum_that_is_awaited_is_judged_at_once(gate: Gate) -> None:
    """An input may bear the name of a datum, and what lasts is known from the journal."""
    goal = {"x": 3.0, "z": 1.0}
    later, _, _ = successor(gate, 10.0)
    light = granted(later.begin("lift", "light", goal=goal))
    later.end("lift", "light", light.token, result="HEAVY")
    assert isinstance(later.begin("lift", "heavy", goal=goal, load=8.5), Violated)
    assert later.violations == [("lift", "small")]


# --- values that last, and those of a core that this one replaces ----------------------------------------------------


def test_of_what_lasts_each_change_is_kept_and_nothing_else(gate: Gate) -> None:
    gate.kept.clear()
    for gate.now, permit in ((1.0, 1.0), (2.0, 2.0), (3.0, 2.0), (4.0, 1.0)):
        gate.datum("permit", permit)
        gate.datum("load", gate.now)
    assert gate.kept == [DatumEntry("permit", 2.0, 2.0), DatumEntry("permit", 1.0, 4.0)]


def in_place_of(bench: Bench, kept: Snapshot) -> ResourceCore:
    """A core that is given the data of one whose last step was never written down."""
    return ResourceCore(GATE, source="rm", new_record_id=RecordIds("rm-again"), snapshot=kept, data=bench.core.data)


def test_a_lasting_value_that_was_never_written_down_is_kept_with_the_next_step(gate: Gate) -> None:
    written = kept_by(gate)
    lost = replace(written, data=())
    outdated = replace(written, data=(DatumEntry("permit", 9.0, 0.0),))
    for kept in (lost, outdated):
        core = in_place_of(gate, kept)
        assert core.step(TimePassed(), gate.now).entries == (DatumEntry("permit", 1.0, 0.0),)
        assert core.step(TimePassed(), gate.now).entries == ()
    assert in_place_of(gate, written).step(TimePassed(), gate.now).entries == ()
    assert in_place_of(Gate(fed=False), lost).step(TimePassed(), gate.now).entries == ()


def test_data_that_are_known_already_are_not_awaited(gate: Gate) -> None:
    kept = kept_by(gate)
    gate.core = in_place_of(gate, kept)
    gate.perform(gate.core.step(Resumed(), gate.now))
    assert isinstance(gate.begin("weigh", "w"), Granted)
    gate.core = in_place_of(Gate(fed=False), kept)
    gate.perform(gate.core.step(Resumed(), gate.now))
    assert refused(lambda: gate.begin("weigh", "next")) is ErrorCode.UNAVAILABLE


def test_where_somebody_has_set_the_clock_back_old_values_shut_out_no_new_ones(gate: Gate) -> None:
    gate.now = 1000.0
    gate.datum("load", 1.0)
    kept = kept_by(gate)
    gate.core = in_place_of(gate, kept)
    gate.now = 500.0
    gate.core.step(Resumed(), gate.now)
    assert gate.core.data.value("load") == 1.0
    assert gate.core.data.reading("permit", gate.now).t == 0.0, "what is older stays as old as it is"
    gate.now = 500.5
    gate.datum("load", 9.5)
    assert gate.core.data.value("load") == 9.5
    gate.now = 503.5
    assert gate.core.data.value("load") == 9.5, "the latest value, stale or not"
    assert gate.core.data.reading("load", gate.now).stale
