"""A resource manager that goes on where another has stopped, from nothing but what that one has kept."""

from __future__ import annotations

from typing import Any

import pytest
from rig import RIG, Bench
from soundness import assert_all_sound

from skillwing.services.core.kept import (
    DatumKept,
    GoalOver,
    GrantOpened,
    Kept,
    ManagerNoted,
    ResourceStands,
)
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import SAID_AGAIN, ResourceCore
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import ErrorCode, FireExtern, Granted, Record, RecordKind, Violated


def kept_by(bench: Bench) -> Kept:
    """What the entries of a bench add up to."""

    def of(kind: type[Any]) -> list[Any]:
        return [entry for entry in bench.kept if isinstance(entry, kind)]

    stood = [entry for entry in bench.core.inventory() if isinstance(entry, ResourceStands)]
    stands: list[ResourceStands] = of(ResourceStands)
    resources = {entry.resource: entry for entry in (*stood, *stands)}
    ended: list[GoalOver] = of(GoalOver)
    over = {entry.goal_id: entry for entry in ended}
    opened: list[GrantOpened] = of(GrantOpened)
    return Kept(
        resources=tuple(resources.values()),
        grants=tuple(entry for entry in opened if entry.granted.goal_id not in over),
        goals=tuple(over.values()),
        managers=tuple(of(ManagerNoted)),
        data=tuple(of(DatumKept)),
        last_token=max((entry.granted.token for entry in opened), default=0),
        records=tuple(bench.of(Record)),
        t=bench.now,
    )


def successor(bench: Bench, now: float) -> tuple[Bench, tuple[Any, ...], tuple[Any, ...]]:
    """A bench that goes on at `now`; what it is to say again, and what it has to say itself."""
    kept = kept_by(bench)
    later = Bench()
    later.now = now
    later.core = ResourceCore(RIG, source="rm", new_record_id=RecordIds("rm-again"), kept=kept)
    step = later.core.resume(kept, now)
    assert_all_sound(step.publications, now)
    return later, step.reply, step.publications


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.battery(80.0)
    bench.now = 1.0
    return bench


def granted(verdict: object) -> Granted:
    assert isinstance(verdict, Granted)
    return verdict


def test_it_goes_on_with_the_same_states_goals_tokens_and_processes(bench: Bench) -> None:
    grant = granted(bench.begin("move", "g", incarnation="second"))
    bench.extern("door", "OPEN")
    later, _, said = successor(bench, 2.0)
    assert (later.core.states, later.core.revision) == (bench.core.states, bench.core.revision)
    assert later.core.grants == bench.core.grants
    assert later.begin("move", "g", incarnation="second") == grant
    assert granted(later.begin("watch", "w")).token > grant.token
    [record] = said
    assert (record.kind, record.subject, record.before, record.after) == (RecordKind.PROCESS, "rm", None, "RESUMED")
    assert record.text == f"went on from its journal at revision {later.core.revision} with 1 goal"


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
    bench.now = 2.0 + SAID_AGAIN
    _, again, _ = successor(bench, 1000.0)
    assert again == (*(record for record in records if record.t == 2.0), violated)
    bench.now = 2.001 + SAID_AGAIN
    _, again, _ = successor(bench, 1000.0)
    assert again == ()


def test_ends_that_everybody_asked_for_are_not_said_again(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    bench.end("move", "g", token, result="DONE")
    _, again, _ = successor(bench, 2.0)
    assert all(isinstance(each, Record) for each in again)


def test_data_count_as_fresh_for_as_long_as_they_may_be(bench: Bench) -> None:
    granted(bench.begin("move", "g"))
    later, _, _ = successor(bench, 10.0)
    with pytest.raises(RefusedError) as refusal:
        later.begin("move", "next")
    assert refusal.value.code is ErrorCode.UNAVAILABLE
    later.now = 12.9
    later.perform(later.core.tick(later.now))
    assert later.violations == []
    assert later.core.next_tick(later.now) == 13.0
    later.now = 13.0
    later.perform(later.core.tick(later.now))
    assert later.violations == [("move", "charged")]


def test_a_new_journal_begins_with_every_resource_as_it_stands() -> None:
    core = ResourceCore(RIG, source="rm", new_record_id=RecordIds("rm"), found={"door": "OPEN"})
    core.fire_extern(FireExtern(resource="authority", target="OFF", source="test"), 0.0)
    assert {(entry.resource, entry.state) for entry in core.inventory() if isinstance(entry, ResourceStands)} == {
        ("authority", "OFF"),
        ("door", "OPEN"),
        ("axes", "FREE"),
        ("lamp", "OFF"),
    }
