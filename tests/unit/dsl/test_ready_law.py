"""A law over random skillsets and states: `ready` says yes if and only if a start is granted."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import assume, given
from hypothesis import strategies as st
from skillset_strategies import skillsets

from law_settings import examples
from skillwing.dsl import parse
from skillwing.dsl.model import Precondition, Skillset
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.ids import RecordIds
from skillwing.services.protocol import BeginGoal, ErrorCode, NotReady, QueryReady


@examples(20)
@given(st.data(), skillsets())
def test_ready_says_yes_if_and_only_if_a_start_is_granted(data: st.DataObject, skillset: Skillset) -> None:
    assume(skillset.skills)
    found = {each.name: data.draw(st.sampled_from(each.states), label=each.name) for each in skillset.resources}
    core = ResourceCore(skillset, source="rm", new_record_id=RecordIds("rm"), found=found)
    for number in range(3):
        skill = data.draw(st.sampled_from(skillset.skills), label="skill")
        inputs = {each.name: each.default for each in skill.inputs if each.default is not None}
        (ready,) = core.ready_report(QueryReady(skill=skill.name, inputs=inputs), 0.0).skills
        busy = any(grant.skill is skill for grant in core.grants)
        assert (ready.running is not None) == busy
        begin = BeginGoal(
            goal_id=f"g{number}",
            skill=skill.name,
            inputs=inputs,
            manager="m",
            owner="test",
            schema=skillset.schema_hash,
        )
        try:
            step = core.step(begin, 0.0)
        except RefusedError as error:
            assert error.code is ErrorCode.BAD_REQUEST
            assert ready.inputs
            continue
        refused = isinstance(step.reply, NotReady)
        assert ready.ready is (not refused and not busy)
        assert bool(ready.failing) is refused
        if isinstance(step.reply, NotReady):
            own = {check.name: check.reason for check in ready.failing}
            assert own.items() <= step.reply.failing.items()


def test_an_effect_of_the_start_and_of_a_refusal_has_the_reason_of_the_refusal() -> None:
    """The law found it: the answer and the refused start told different sentences."""
    text = """
    skillset s {
        resource r { initial A  A -> B  extern A -> C  extern B -> A  extern C -> A }
        skill k {
            effect { take: r -> B }
            precondition { success take }
            interrupt { apply=take }
            result { DONE }
        }
    }
    """
    checked = parse(text, "s.skillset")
    skill = replace(checked.skill("k"), preconditions=Precondition(success="take", failure="take"))
    skillset = replace(checked, skills=(skill,))  # the checker refuses it, the managers do not
    core = ResourceCore(skillset, source="rm", new_record_id=RecordIds("rm"), found={"r": "C"})
    (ready,) = core.ready_report(QueryReady(skill="k"), 0.0).skills
    begin = BeginGoal(goal_id="g", skill="k", inputs={}, manager="m", owner="test", schema=skillset.schema_hash)
    reply = core.step(begin, 0.0).reply
    assert isinstance(reply, NotReady)
    assert reply.failing == {check.name: check.reason for check in ready.failing}
