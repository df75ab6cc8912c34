"""`QueryReady`: its reply says yes if and only if a start would be granted, and names what is missing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig import RIG, Bench, granted

from skillwing.dsl import parse
from skillwing.services.core.events import Resumed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import (
    ErrorCode,
    Holder,
    NotReady,
    QueryReady,
    ReadyReport,
    SkillReady,
    decode,
    encode,
)


def ask(bench: Bench, skill: str, inputs: dict[str, object] | None = None) -> SkillReady:
    """The reply about one skill, after its way over the wire."""
    report = bench.core.ready_report(QueryReady(skill=skill, inputs=inputs), bench.now)
    (ready,) = decode(encode(report), ReadyReport).skills
    return ready


def test_a_skill_with_everything_may_start(bench: Bench) -> None:
    assert ask(bench, "move", {}) == SkillReady(skill="move", ready=True)


def test_reasons_are_those_of_a_refused_start() -> None:
    bench = Bench()
    bench.extern("authority", "OFF")
    ready = ask(bench, "move", {})
    verdict = bench.begin("move", "g")
    assert isinstance(verdict, NotReady)
    assert {check.name: check.reason for check in ready.failing} == verdict.failing
    authority, charged = ready.failing
    assert authority.missing[0].extern == ("ON",)
    assert charged.data == ("battery",)


def test_the_holder_of_a_resource_is_named(bench: Bench) -> None:
    granted(bench.begin("carry", "g"))
    (free,) = ask(bench, "move", {}).failing
    (axes,) = free.missing
    assert (axes.state, axes.wanted, axes.skills) == ("USED", ("FREE",), ("move", "carry"))
    assert axes.holder == Holder(skill="carry", goal_id="g", owner="test")


def test_a_skill_with_a_running_goal_is_not_ready(bench: Bench) -> None:
    granted(bench.begin("carry", "g"))
    granted(bench.begin("watch", "w"))
    watch = ask(bench, "watch")
    assert (watch.ready, watch.failing) == (False, ())
    assert watch.running == Holder(skill="watch", goal_id="w", owner="test")


def test_a_start_effect_that_cannot_apply_is_named(bench: Bench) -> None:
    bench.extern("lamp", "BROKEN")
    (effect,) = ask(bench, "carry").failing
    assert effect.name == "effect take"
    (lamp,) = effect.missing
    assert (lamp.resource, lamp.wanted, lamp.extern) == ("lamp", ("OFF", "LIT"), ("OFF",))


def test_a_failing_precondition_hides_no_start_effect_that_cannot_apply(bench: Bench) -> None:
    bench.extern("lamp", "BROKEN")
    granted(bench.begin("move", "g"))
    free, effect = ask(bench, "carry").failing
    assert (free.name, effect.name) == ("free", "effect take")
    assert [missing.resource for missing in effect.missing] == ["lamp"]
    verdict = bench.begin("carry", "h")
    assert isinstance(verdict, NotReady)
    assert list(verdict.failing) == ["free", "effect take"]


def test_an_event_counts_only_where_it_can_be_fired() -> None:
    source = """
    skillset crane {
        resource brake { initial SET  extern SET -> LOOSE  extern LOOSE -> SET }
        resource key { initial OUT  extern OUT -> IN  extern IN -> OUT }
        event unlock { guard resource=(key == IN) effect { brake -> LOOSE } }
        skill lift { precondition { loose: resource=(brake == LOOSE) } result { success DONE } }
    }
    """
    bench = Bench(parse(source))
    assert ask(bench, "lift").failing[0].missing[0].events == ()
    bench.extern("key", "IN")
    assert ask(bench, "lift").failing[0].missing[0].events == ("unlock",)


def test_inputs_are_checked_when_they_are_given(bench: Bench) -> None:
    assert ask(bench, "move").ready
    assert list(ask(bench, "move", {"speed": 9.0}).inputs) == ["speed"]
    assert list(ask(bench, "move", {"sped": 1.0}).inputs) == ["sped"]


def test_a_precondition_on_a_missing_input_is_unchecked_without_inputs() -> None:
    source = """
    skillset crane {
        data { load: float64 [kg] period=1.0 }
        skill lift {
            input { most: float64 [kg] }
            precondition { light: data=(load < most) }
            result { success DONE }
        }
    }
    """
    bench = Bench(parse(source))
    bench.datum("load", 5.0)
    assert ask(bench, "lift") == SkillReady(skill="lift", ready=True, unchecked=("light",))
    assert not ask(bench, "lift", {}).ready
    assert ask(bench, "lift", {"most": 9.0}).ready
    (light,) = ask(bench, "lift", {"most": 1.0}).failing
    assert (light.data, light.inputs) == (("load",), ("most",))


def test_a_query_without_a_skill_is_about_all(bench: Bench) -> None:
    report = bench.core.ready_report(QueryReady(), bench.now)
    assert [each.skill for each in report.skills] == [skill.name for skill in RIG.skills]


def test_a_query_changes_nothing(bench: Bench) -> None:
    before = (bench.core.last_step, dict(bench.core.states), bench.core.grants)
    for skill in RIG.skills:
        ask(bench, skill.name)
    assert (bench.core.last_step, dict(bench.core.states), bench.core.grants) == before


@pytest.mark.parametrize(
    ("query", "code"),
    [
        (QueryReady(skill="fly"), ErrorCode.UNKNOWN_NAME),
        (QueryReady(skill="move", schema="of another"), ErrorCode.SCHEMA_MISMATCH),
    ],
)
def test_a_query_that_does_not_fit_is_refused(bench: Bench, query: QueryReady, code: ErrorCode) -> None:
    with pytest.raises(RefusedError) as refused:
        bench.core.ready_report(query, bench.now)
    assert refused.value.code is code


@given(st.data())
def test_ready_agrees_with_starts_of_the_rig(data: st.DataObject) -> None:
    bench = Bench()
    externs = [(each.name, edge.target) for each in RIG.resources for edge in each.transitions if edge.extern]
    for number in range(data.draw(st.integers(1, 8), label="steps")):
        for resource, target in data.draw(st.lists(st.sampled_from(externs), max_size=2), label="extern"):
            try:
                bench.extern(resource, target)
            except RefusedError:
                continue
        if data.draw(st.booleans(), label="fresh"):
            bench.battery(data.draw(st.sampled_from([12.0, 50.0]), label="battery"))
        bench.now += data.draw(st.sampled_from([0.0, 1.0, 5.0]), label="pause")
        skill = data.draw(st.sampled_from([each.name for each in RIG.skills]), label="skill")
        ready = ask(bench, skill, {})
        busy = any(grant.skill.name == skill for grant in bench.core.grants)
        refused = isinstance(bench.begin(skill, f"g{number}"), NotReady)
        assert ready.ready is (not refused and not busy)


def test_a_query_after_a_restart_waits_for_the_data() -> None:
    """The resource manager cannot know yet whether the battery is charged, so it says neither yes nor no."""
    bench = Bench()
    bench.perform(bench.core.step(Resumed(), 0.0))
    with pytest.raises(RefusedError) as refused:
        ask(bench, "move", {})
    assert refused.value.code is ErrorCode.UNAVAILABLE
    assert ask(bench, "carry", {}).ready, "it names no datum"


def test_only_events_and_skills_that_bring_what_is_missing_are_named() -> None:
    source = """
    skillset crane {
        resource brake {
            state { SET LOOSE STUCK }
            initial SET
            extern SET -> LOOSE
            extern LOOSE -> SET
            extern * -> STUCK
        }
        resource lamp { initial OFF  extern OFF -> ON  extern ON -> OFF }
        event unlock { effect { brake -> LOOSE } }
        event jam { effect { brake -> STUCK } }
        event light { effect { lamp -> ON } }
        skill lift { precondition { loose: resource=(brake == LOOSE) } result { success DONE } }
    }
    """
    (brake,) = ask(Bench(parse(source)), "lift").failing[0].missing
    assert (brake.resource, brake.events, brake.skills, brake.extern) == ("brake", ("unlock",), (), ("LOOSE",))


def test_a_holder_has_taken_the_resource_and_can_bring_it_back() -> None:
    """`guard` runs and can park the arm, and `carry` could have taken it: neither holds it."""
    source = """
    skillset crane {
        resource arm { initial FREE  FREE -> USED  USED -> FREE }
        skill guard {
            effect { none {}  park: arm -> FREE }
            precondition { success none }
            interrupt { apply=park }
            result { success DONE: apply=none }
        }
        skill keep {
            effect { take: arm -> USED  lose: arm -> USED }
            precondition { free: resource=(arm == FREE)  success take }
            interrupt { apply=lose }
            result { success DONE: apply=lose }
        }
        skill lift { precondition { free: resource=(arm == FREE) } result { success DONE } }
    }
    """
    bench = Bench(parse(source))
    granted(bench.begin("guard", "g"))
    granted(bench.begin("keep", "k"))
    (arm,) = ask(bench, "lift").failing[0].missing
    assert (arm.state, arm.wanted, arm.holder) == ("USED", ("FREE",), None)


FITTED = """
    skillset crane {
        type Point { x: float64  y: float64 }
        data { load: float64 [kg] period=1.0 }
        resource lamp { initial OFF  extern OFF -> ON  extern ON -> OFF }
        skill lift {
            input { most: float64 [kg] in 0.0..9.0 = 1.0  target: Point  lamp: bool }
            precondition {
                light: data=(load < most)
                near: data=(target.x < 5.0)
                dark: resource=(lamp == OFF)
            }
            result { success DONE }
        }
    }
"""
GIVEN: dict[str, object] = {"most": 1.0, "target": {"x": 1.0, "y": 1.0}, "lamp": True}


@pytest.mark.parametrize(
    ("given", "inputs", "unchecked", "failing"),
    [
        ({}, [], (), []),
        ({"most": 99.0}, ["most"], (), []),
        ({"most": -1.0}, ["most"], (), ["light"]),
        ({"target": {"x": "far", "y": 1.0}}, ["target.x"], ("near",), []),
        ({"target": {"x": 9.0, "y": 1.0}}, [], (), ["near"]),
        ({"lamp": "lit"}, ["lamp"], (), []),
    ],
)
def test_only_checks_on_inputs_without_a_usable_value_are_left_out(
    given: dict[str, object], inputs: list[str], unchecked: tuple[str, ...], failing: list[str]
) -> None:
    """A value out of its range can still be compared. The resource `lamp` is not the input of that name."""
    bench = Bench(parse(FITTED))
    bench.datum("load", 0.5)
    ready = ask(bench, "lift", GIVEN | given)
    assert (list(ready.inputs), ready.unchecked, [each.name for each in ready.failing]) == (inputs, unchecked, failing)
