"""One skill on the bench: context, goals, assertions and what they say when they fail."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from lifter import COMMAND, ENDED, LIFTER, POSITION, Done, Go, Lift, LiftFeedback, LiftInputs, LiftOutputs, Position

from skillwing.dsl.model import UnknownNameError
from skillwing.services.core.refusal import RefusedError
from skillwing.services.errors import InvalidInputError
from skillwing.services.testing import ContextError, SkillTest


def bench() -> SkillTest[LiftInputs, LiftOutputs, LiftFeedback]:
    test = SkillTest(LIFTER, Lift, states={"power": "ON"}, data={"load": 10.0})
    test.layer.answer(COMMAND, Go, Done())
    return test


# --- goals -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("inputs", [LiftInputs(height=2.0), {"height": 2.0}])
def test_inputs_are_taken_in_every_form(inputs: LiftInputs | dict[str, float]) -> None:
    test = bench()
    goal = test.start(inputs)
    goal.assert_running()
    assert test.layer.asked(COMMAND, Go) == [Go(goal_id=goal.id, height=2.0)]


def test_outputs_and_feedback_have_their_types() -> None:
    test = bench()
    goal = test.start(height=2.0)
    test.layer.publish(POSITION, Position(height=0.5))
    test.run(1.0)
    assert goal.progress == LiftFeedback(left=1.5)
    assert goal.feedback == [LiftFeedback(left=1.5)] * 2
    test.layer.publish(POSITION, Position(height=2.0))
    terminal = goal.assert_ended("S_UP", success=True, output=LiftOutputs(height=2.0))
    assert (goal.done, goal.terminal, goal.output) == (True, terminal, LiftOutputs(height=2.0))
    assert test.layer.heard(ENDED) == [b"S_UP"], "what `on_ended` sends has arrived"


def test_wrong_inputs_are_the_tests_mistake_and_wrong_ranges_the_goals_end() -> None:
    test = bench()
    with pytest.raises(InvalidInputError, match="height"):
        test.start(height="high")
    with pytest.raises(UnknownNameError, match="did you mean `height`"):
        test.start(heigth=1.0)
    test.start(height=99.0).assert_ended("NV", failing=["height"])


def test_sent_it_is_not_under_way_yet() -> None:
    test = bench()
    goal = test.send(height=2.0)
    assert goal.state is None
    with pytest.raises(AssertionError, match="should be running; it is SENT"):
        goal.assert_running()
    goal.interrupt().assert_ended("IT")


def test_a_killed_manager_is_replaced_by_one_that_knows_nothing() -> None:
    test = bench()
    hooks = test.hooks["lift"]
    goal = test.start(height=2.0)
    test.kill()
    goal.assert_ended("LOST")
    test.assert_states(hoist="FREE", within=2.0)
    test.restart()
    assert test.hooks["lift"] is not hooks
    test.start(height=2.0).assert_running()


def test_closing_ends_what_runs_in_good_order() -> None:
    with bench() as test:
        test.start(height=2.0)
        hooks = test.hooks["lift"]
    assert hooks.current is None
    assert test.layer.heard(ENDED) == []
    test.close()


def test_hooks_may_be_made_by_any_callable() -> None:
    made: list[Lift] = []

    def make() -> Lift:
        made.append(Lift())
        return made[-1]

    test = SkillTest(LIFTER, make)
    assert test.hooks["lift"] is made[0]
    assert len(made) == 1
    already_made: Any = Lift()
    with pytest.raises(TypeError, match="Give the class, or a function"):
        SkillTest(LIFTER, already_made)


# --- the context -----------------------------------------------------------------------------------------------------


def test_initial_states_can_be_set_for_every_resource() -> None:
    test = SkillTest(LIFTER, Lift, states={"power": "ON", "hoist": "USED"}, data={"load": 10.0})
    assert dict(test.states) == {"power": "ON", "hoist": "USED"}
    test.start(height=1.0).assert_ended("NR", failing=["free"])


def test_afterwards_they_go_the_way_of_the_functional_layer() -> None:
    test = SkillTest(LIFTER, Lift)
    test.set_states(power="ON")
    assert [record.after for record in test.history.records if record.subject == "power"] == ["BOOTING", "ON"]
    test.set_states(power="ON")
    with pytest.raises(ContextError, match=r"cannot bring `hoist` from FREE to USED\. Start a skill that does"):
        test.set_states(power="OFF", hoist="USED")
    assert test.states["power"] == "ON", "nothing was moved"


def test_a_context_that_does_not_fit_is_reported_at_once_and_completely() -> None:
    with pytest.raises(ContextError) as caught:
        SkillTest(LIFTER, Lift, states={"powr": "ON", "hoist": "FLEE"})
    assert ["did you mean `power`" in caught.value.problems[0], "`FREE`" in caught.value.problems[1]] == [True, True]
    with pytest.raises(ContextError, match=r"`load` is 'heavy'.*There is no datum `lode`"):
        SkillTest(LIFTER, Lift, data={"load": "heavy", "lode": 1.0})
    test = bench()
    with pytest.raises(ContextError, match="did you mean `BOOTING`"):
        test.assert_states(power="BOTING")


def test_data_stay_fresh_until_they_are_stopped() -> None:
    test = bench()
    test.run(30.0)
    assert not test.reading("load").stale
    assert test.reading("height").stale, "nobody has published it"
    test.set_data(load=150.0)
    test.start(height=1.0).assert_ended("NR", failing=["light"])
    test.stop_data("load")
    test.run(1.6)
    assert test.reading("load").stale
    test.set_data(load=1.0)
    test.run(30.0)
    assert not test.reading("load").stale


def test_triggers_and_events_are_those_of_the_model() -> None:
    test = SkillTest(LIFTER, Lift)
    with pytest.raises(RefusedError, match="no extern transition from OFF to ON"):
        test.trigger("power", "ON")
    with pytest.raises(RefusedError, match="cannot happen now"):
        test.fire("blackout")
    with pytest.raises(UnknownNameError, match="did you mean `blackout`"):
        test.fire("blckout")
    test.set_states(power="ON")
    test.fire("blackout")
    test.assert_states(power="OFF")


# --- what a failure says ---------------------------------------------------------------------------------------------


def failure_of(test: SkillTest[LiftInputs, LiftOutputs, LiftFeedback]) -> str:
    goal = test.start(height=2.0)
    test.run(1.0)
    test.fire("blackout")
    with pytest.raises(AssertionError) as caught:
        goal.assert_ended("S_UP", output={"height": 2.0})
    assert goal.causes == ["power OFF", "lift.power VIOLATED", "lift RI"]
    return str(caught.value)


def test_the_wrong_end_tells_the_whole_story() -> None:
    story = failure_of(bench())
    for part in (
        "The goal of `lift` should have ended S_UP; it ended RI; `output` should be {'height': 2.0}, it is None.",
        "Its reason: `power == ON` does not hold: power is OFF.",
        "It was started as lift(height=2.0).",
        "It has fed back last: LiftFeedback(left=2.0)",
        "hoist       USED -> FREE               effect release of lift  <- lift.power VIOLATED",
        "    power OFF\n    hoist FREE\n    load = 10.0, 0.0",
        "fl/hoist/command  Go(v=2, goal_id='goal-1', height=2.0)",
        "fl/hoist/ended  the latest of 1 publications",
    ):
        assert part in story


def test_the_same_test_tells_the_same_story() -> None:
    assert failure_of(bench()) == failure_of(bench())


def test_a_goal_that_does_not_end_says_what_it_does_instead() -> None:
    goal = bench().start(height=2.0)
    with pytest.raises(AssertionError, match="has not ended within 5 s; it is RUNNING"):
        goal.assert_ended("S_UP", within=5.0)
    with pytest.raises(AssertionError, match="is RUNNING, not over"):
        _ = goal.terminal


def test_a_hook_that_raises_is_named() -> None:
    test = bench()
    goal = test.start(height=2.0)
    test.layer.publish(POSITION, Position(height=-1.0))
    goal.assert_ended("ERROR", reason="ValueError: below the ground")
    with pytest.raises(AssertionError, match="without an output"):
        _ = goal.output
    with pytest.raises(AssertionError, match=r"should be running; it is TERMINATED: ERROR\. .*below the ground"):
        goal.assert_running()


def test_nothing_fed_back_is_a_failure_of_its_own() -> None:
    with pytest.raises(AssertionError, match="has not fed anything back"):
        _ = bench().start(height=2.0).progress


def test_what_cannot_be_asserted_is_no_failure_but_a_mistake() -> None:
    goal = bench().start(height=2.0)
    with pytest.raises(UnknownNameError, match="did you mean `S_UP`"):
        goal.assert_ended("UP")
    with pytest.raises(TypeError, match=r"has no \['reasons'\]"):
        goal.assert_ended("S_UP", reasons="")


def test_every_attribute_counts() -> None:
    test = bench()
    goal = test.start(height=2.0)
    test.layer.publish(POSITION, Position(height=3.0))
    goal.assert_ended("S_UP", output={"height": pytest.approx(3.0)}, failing=[], reason="")
    cases: list[dict[str, Any]] = [
        {"output": LiftOutputs(height=2.0)},
        {"failing": ["power"]},
        {"reason": "luck"},
        {"forced": True},
    ]
    for wrong in cases:
        with pytest.raises(AssertionError, match=f"`{next(iter(wrong))}` should be"):
            goal.assert_ended("S_UP", **wrong)


def test_states_that_are_not_there_and_conditions_that_never_hold() -> None:
    test = bench()
    with pytest.raises(AssertionError, match=r"`hoist` should be USED, it is FREE\.\nWhat happened"):
        test.assert_states(hoist="USED", power="ON")
    with pytest.raises(AssertionError, match="Waited 3 s in vain for the moon"):
        test.run_until(lambda: False, 3.0, "the moon")


def test_a_failed_assertion_names_the_states_and_data_of_the_skills_conditions() -> None:
    test = SkillTest(LIFTER, Lift, states={"power": "ON"})
    with pytest.raises(AssertionError) as caught:
        test.start(height=2.0).assert_running()
    said = str(caught.value)
    assert "Its conditions and effects are on: hoist FREE; power ON; load never received." in said
    test.set_data(load=120.0)
    with pytest.raises(AssertionError, match=r"are on: hoist FREE; power ON; load = 120\.0, 0\.\d\d s old\.") as caught:
        test.start(height=2.0).assert_ended("S_UP")
    assert "    height never received" in str(caught.value), "the story has all data"


def test_a_long_story_ends_with_what_happened_last() -> None:
    test = bench()
    for _ in range(20):
        test.set_states(power="OFF")
        test.set_states(power="ON")
    assert "... 21 earlier changes" in test.story()
    assert "load FRESH" not in test.story()


def test_unknown_nodes_are_named() -> None:
    test = bench()
    for call in (lambda: test.kill("skill/lfit"), lambda: test.restart("skill/lfit")):
        with pytest.raises(UnknownNameError, match="did you mean `skill/lift`"):
            call()


def test_structs_as_data_are_taken_too() -> None:
    class Pose(msgspec.Struct):
        x: float

    with pytest.raises(ContextError, match="`load` is"):
        SkillTest(LIFTER, Lift, data={"load": Pose(x=1.0)})
