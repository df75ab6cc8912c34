"""Causes of refusals: what makes the preconditions fail, or the request if no record shows that."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig import Bench, granted

from skillwing.dsl import parse
from skillwing.dsl.expressions import (
    And,
    Comparison,
    Environment,
    Expression,
    Implies,
    Name,
    NamedValue,
    Not,
    Or,
    evaluate,
)
from skillwing.dsl.model import Precondition, Predicate, Resource, Skill, Skillset
from skillwing.services.core.causes import preventing_resources
from skillwing.services.history.history import History
from skillwing.services.history.report import make_report
from skillwing.services.history.wording import chain_text
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import GoalStatus, NotReady, Record, RecordKind, State, Violated
from skillwing.services.report.rendering import as_markdown
from skillwing.services.testing import GoalUnderTest, SkillsetInProcess

CRANE = parse(
    """
    skillset crane {
        data { load: float64 period=1.0 }
        resource power { initial OFF  extern OFF -> ON  extern ON -> OFF }
        resource brake { initial CLOSED  extern CLOSED -> OPEN  extern OPEN -> CLOSED }
        resource arm { state { FREE USED BROKEN }  initial FREE  FREE -> USED  USED -> FREE  extern * -> BROKEN }
        skill lift {
            effect { take: arm -> USED  release: arm -> FREE }
            precondition {
                loose: resource=(power == ON and brake == OPEN)
                light: data=(load < 9.0)
                success take
            }
            interrupt { apply=release }
            result { success UP: apply=release }
        }
        skill turn {
            effect { take: arm -> USED  release: arm -> FREE }
            precondition { free: resource=(arm == FREE)  success take }
            interrupt { apply=release }
            result { success TURNED: apply=release }
        }
    }
    """
)


@pytest.fixture
def crane() -> SkillsetInProcess:
    script = MockScript(skills={"lift": (MockRun(forever=True),)})
    return SkillsetInProcess(CRANE, states={"power": "ON", "brake": "OPEN"}, data={"load": 1.0}, script=script)


def refused(crane: SkillsetInProcess, skill: str) -> GoalUnderTest[Any, Any]:
    goal = crane.send_start(skill)
    goal.assert_ended("NR")
    return goal


def test_a_resource_that_another_skill_holds_leads_to_that_skill(crane: SkillsetInProcess) -> None:
    crane.start_skill("lift").assert_running()
    assert refused(crane, "turn").causes == ["lift GRANTED", "arm USED", "turn NR"]


def test_of_a_precondition_only_the_failing_part_is_reported(crane: SkillsetInProcess) -> None:
    """The brake has changed since, and is as it should be."""
    crane.trigger("power", "OFF")
    crane.trigger("brake", "CLOSED")
    crane.trigger("brake", "OPEN")
    assert refused(crane, "lift").causes == ["power OFF", "lift NR"]


def test_of_several_missing_states_the_latest_change_is_reported(crane: SkillsetInProcess) -> None:
    crane.trigger("power", "OFF")
    crane.trigger("brake", "CLOSED")
    assert refused(crane, "lift").causes == ["brake CLOSED", "lift NR"]


def test_a_datum_that_nobody_publishes_any_more_is_reported(crane: SkillsetInProcess) -> None:
    crane.stop_data("load")
    crane.run(4.0)
    assert refused(crane, "lift").causes == ["load STALE", "lift NR"]


def test_a_value_that_is_too_large_is_reported(crane: SkillsetInProcess) -> None:
    crane.set_data(load=10.0)
    assert refused(crane, "lift").causes == ["load 10.0", "lift NR"]


def test_a_resource_is_reported_before_a_datum(crane: SkillsetInProcess) -> None:
    crane.trigger("power", "OFF")
    crane.set_data(load=10.0)
    assert refused(crane, "lift").causes == ["power OFF", "lift NR"]


def test_what_never_changed_leaves_the_request() -> None:
    crane = SkillsetInProcess(CRANE, states={"brake": "OPEN"}, data={"load": 1.0})
    assert refused(crane, "lift").causes == ["lift NR"]


def test_the_chain_consists_of_records_that_name_each_other(crane: SkillsetInProcess) -> None:
    """The chain stays complete in a part of the history without its causes, and needs no skillset."""
    crane.start_skill("lift").assert_running()
    crane.run(2.0)
    record = refused(crane, "turn").handle.record
    chain = crane.history.chain(record)
    assert [each.id for each in chain[:-1]] == [each.cause for each in chain[1:]]
    part = crane.history.part(crane.now() - 1.0)
    assert chain_text(part.chain(record)) == chain_text(chain)
    assert chain_text(History.of(crane.history.records).chain(record)) == chain_text(chain)


def test_the_report_tells_it(crane: SkillsetInProcess) -> None:
    crane.start_skill("lift").assert_running()
    goal = refused(crane, "turn")
    ended = GoalStatus(
        goal_id=goal.id, skill="turn", state=State.TERMINATED, t=0.0, terminal=goal.terminal, record=goal.handle.record
    )
    history = History.of(crane.history.records, [ended], CRANE)
    report = as_markdown(make_report(history, mission="none"), history)
    assert "| NR | `arm == FREE` does not hold: arm is USED. | arm USED <- lift GRANTED |" in report


def test_a_start_effect_that_cannot_be_applied_counts() -> None:
    eager = parse(
        """
        skillset eager {
            resource arm { state { FREE USED BROKEN }  initial FREE  FREE -> USED  USED -> FREE  extern * -> BROKEN }
            resource lamp { initial OFF  OFF -> ON  ON -> OFF }
            skill reach {
                effect { take { arm -> USED  lamp -> ON }  release { arm -> FREE  lamp -> OFF } }
                precondition { success take }
                interrupt { apply=release }
                result { success DONE: apply=release }
            }
        }
        """
    )
    reach = eager.skill("reach")
    for state, blocked in (("BROKEN", {"arm"}), ("FREE", set[str]())):
        assert preventing_resources(eager, reach, Environment(resources={"arm": state, "lamp": "OFF"})) == blocked


MIXED = parse(
    """
    skillset mixed {
        data { load: float64 period=1.0  wind: float64 period=1.0 }
        resource door { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT }
        resource key { initial IN  extern IN -> OUT  extern OUT -> IN }
        resource lock { state { FREE HELD BROKEN }  initial FREE  FREE -> HELD  extern * -> BROKEN }
        resource lid { initial SHUT  extern SHUT -> OPEN  extern OPEN -> SHUT }
        skill both {
            input { fast: bool = true  most: float64 = 9.0 }
            precondition {
                calm: data=(fast and load < most and wind < 5.0)
                locked: resource=(key == IN and door == SHUT)
            }
            result { success DONE }
        }
        skill either {
            precondition { light: data=(load < 9.0 or wind < 5.0)  shut: resource=(door == SHUT or lid == SHUT) }
            result { success DONE }
        }
        skill hold {
            effect { none {} }
            precondition { success none }
            invariant { light: data=(load < 9.0) violation=none }
            result { success DONE: apply=none }
        }
        skill take {
            effect { take: lock -> HELD }
            precondition { light: data=(load < 9.0)  success take }
            result { success DONE }
        }
        skill three {
            precondition { all: resource=(door == SHUT and key == IN and lid == SHUT) }
            result { success DONE }
        }
        skill one_or_two {
            precondition { some: resource=(door == SHUT or key == IN and lid == SHUT) }
            result { success DONE }
        }
        skill two_or_two {
            precondition { some: resource=(door == SHUT and lock == FREE or key == IN and lid == SHUT) }
            result { success DONE }
        }
    }
    """
)


@pytest.mark.parametrize(
    ("skill", "changes", "data", "inputs", "cause"),
    [
        ("both", ["door OPEN", "key OUT", "key IN"], {}, {}, "door OPEN"),
        ("both", ["door OPEN", "key OUT", "lid OPEN"], {"load": 20.0}, {"fast": False}, "key OUT"),
        ("both", ["key OUT", "key IN"], {"wind": 7.0}, {}, "wind 7.0"),
        ("both", ["key OUT", "key IN"], {"load": None}, {}, "load STALE"),
        ("both", ["key OUT", "key IN"], {}, {"fast": False}, None),
        ("both", [], {}, {"most": 0.5}, "load 1.0"),
        ("either", ["lid OPEN", "door OPEN", "key OUT"], {"load": 20.0, "wind": 7.0}, {}, "door OPEN"),
        ("either", ["door OPEN"], {"load": 20.0, "wind": 7.0}, {}, "load 20.0"),
        ("either", ["door OPEN"], {"wind": None}, {}, "wind STALE"),
        ("take", ["lock BROKEN"], {}, {}, "lock BROKEN"),
        ("take", ["lock BROKEN"], {"load": 20.0}, {}, "load 20.0"),
        ("three", ["door OPEN", "key OUT", "lid OPEN", "lid SHUT"], {}, {}, "key OUT"),
        ("one_or_two", ["door OPEN", "key OUT", "lid OPEN"], {}, {}, "door OPEN"),
        ("two_or_two", ["door OPEN", "key OUT", "lid OPEN", "lock BROKEN"], {}, {}, "lock BROKEN"),
    ],
)
def test_each_side_of_a_guard_is_judged_with_the_present_values(
    skill: str, changes: list[str], data: dict[str, float | None], inputs: dict[str, Any], cause: str | None
) -> None:
    bench = Bench(MIXED)
    for name, value in ({"load": 1.0, "wind": 1.0} | data).items():
        if value is not None:
            bench.datum(name, value)
    for change in changes:
        bench.extern(*change.split())
    verdict = bench.begin(skill, "g", cause=f"skill/{skill}#1", **inputs)
    assert isinstance(verdict, NotReady)
    assert bench.chain(verdict.record) == [*filter(None, [cause]), f"{skill} NOT_READY"]


def test_a_datum_that_also_breaks_an_invariant_has_one_record_in_a_step() -> None:
    bench = Bench(MIXED)
    bench.datum("load", 1.0)
    granted(bench.begin("hold", "g1"))
    bench.now = 3.0
    verdict = bench.begin("take", "g2", cause="skill/take#1")
    assert isinstance(verdict, NotReady)
    [violated] = bench.of(Violated)
    assert bench.chain(verdict.record) == ["load STALE", "take NOT_READY"]
    assert bench.chain(violated.record) == ["load STALE", "hold.light VIOLATED"]
    [datum] = bench.of(Record, lambda record: record.kind is RecordKind.DATA)
    assert datum.text == "`load < 9.0` does not hold: load is stale or was never published."


RESOURCES = tuple(Resource(name, ("A", "B", "C"), "A", ()) for name in ("x", "y", "z"))
COMPARISONS = st.builds(
    Comparison,
    st.sampled_from(["==", "!="]),
    st.sampled_from([Name(each.name, "resource") for each in RESOURCES]),
    st.sampled_from([NamedValue(state) for state in "ABC"]),
)
GUARDS: st.SearchStrategy[Expression] = st.recursive(
    COMPARISONS,
    lambda inner: st.one_of(st.builds(Not, inner), *(st.builds(kind, inner, inner) for kind in (And, Or, Implies))),
    max_leaves=5,
)


@settings(max_examples=50)
@given(GUARDS, st.fixed_dictionaries({each.name: st.sampled_from("ABC") for each in RESOURCES}))
def test_there_is_an_obstacle_exactly_where_the_guard_fails(guard: Expression, states: dict[str, str]) -> None:
    """The causes are exactly the resources of which one change would be enough, if there are any."""
    skill = Skill("s", preconditions=Precondition((Predicate("guard", "resource", guard),)))
    found = preventing_resources(
        Skillset("k", resources=RESOURCES, skills=(skill,)), skill, Environment(resources=states)
    )
    assert bool(found) != evaluate(guard, Environment(resources=states))
    if found:
        would_do = {
            name
            for name, state in product(states, "ABC")
            if evaluate(guard, Environment(resources={**states, name: state}))
        }
        assert found == would_do or not would_do
