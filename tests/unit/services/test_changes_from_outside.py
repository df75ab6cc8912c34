"""Extern transitions and events: which are refused, and what is said of them."""

from __future__ import annotations

import pytest
from rig import Bench, granted

from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, FireEvent, Record, RecordKind


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
    assert bench.core.last_step == 0


def test_naming_the_state_that_is_changes_nothing(bench: Bench) -> None:
    assert bench.extern("authority", "ON").step == 0
    assert bench.changes == []


def test_an_event_is_all_or_nothing_and_guarded(bench: Bench) -> None:
    event = FireEvent(event="storm", source="test")
    bench.perform(bench.core.step(event, 0.0))
    assert bench.changes == [("authority", "OFF"), ("door", "OPEN")]
    with pytest.raises(RefusedError, match="authority is OFF"):
        bench.core.step(event, 0.0)
    with pytest.raises(RefusedError) as refusal:
        bench.core.step(FireEvent(event="strom", source="test"), 0.0)
    assert refusal.value.known == ("storm",)


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


@pytest.mark.parametrize(("resource", "target", "mover"), [("axes", "USED", "skills"), ("lamp", "LIT", "BROKEN")])
def test_a_refused_transition_names_who_moves_the_resource(
    bench: Bench, resource: str, target: str, mover: str
) -> None:
    with pytest.raises(RefusedError, match="no extern transition") as refusal:
        bench.extern(resource, target)
    assert mover in refusal.value.help
    assert ("functional layer" in refusal.value.help) == bool(refusal.value.known)
