"""A refusal has the failed part of its preconditions as its cause, or the request if no record shows that part."""

from __future__ import annotations

from itertools import product
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
from skillwing.services.history.history import History
from skillwing.services.history.refusal_causes import refusal_causes
from skillwing.services.history.report import make_report
from skillwing.services.history.wording import chain_text
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import GoalStatus, RecordKind, State
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


def test_a_value_that_is_on_no_record_leaves_who_asked(crane: SkillsetInProcess) -> None:
    crane.set_data(load=10.0)
    assert refused(crane, "lift").causes == ["lift NR"]


def test_what_never_changed_leaves_who_asked() -> None:
    crane = SkillsetInProcess(CRANE, states={"brake": "OPEN"}, data={"load": 1.0})
    assert refused(crane, "lift").causes == ["lift NR"]


def test_the_chain_consists_of_records_that_name_each_other(crane: SkillsetInProcess) -> None:
    """The chain stays complete in a part of the history without its causes, and needs the right skillset."""
    crane.start_skill("lift").assert_running()
    crane.run(2.0)
    record = refused(crane, "turn").handle.record
    chain = crane.history.chain(record)
    assert [each.id for each in chain[:-1]] == [each.cause for each in chain[1:]]
    part = crane.history.part(crane.now() - 1.0)
    assert chain_text(part.chain(record)) == chain_text(chain)
    for stranger in (None, Skillset("crane")):
        assert chain_text(History.of(crane.history.records, (), stranger).chain(record)) == "turn NR"


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
    arm = {(RecordKind.RESOURCE, "arm")}
    assert refusal_causes(eager, "reach", {"arm": "BROKEN", "lamp": "OFF"}, ()) == arm
    assert refusal_causes(eager, "reach", {"arm": "FREE", "lamp": "OFF"}, ()) == frozenset()


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
    found = refusal_causes(Skillset("k", resources=RESOURCES, skills=(skill,)), "s", states, ())
    assert bool(found) != evaluate(guard, Environment(resources=states))
    if found:
        would_do = {
            (RecordKind.RESOURCE, name)
            for name, state in product(states, "ABC")
            if evaluate(guard, Environment(resources={**states, name: state}))
        }
        assert found == would_do or not would_do
