"""Refusals word for word: a sentence for the problem, a sentence for the remedy, and every problem of one kind.

The fixture in `conftest.py` requires sentences of all refusals. These tests require the right ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from rig import RIG, Bench, granted
from skill_desk import Desk, interrupting, running

from skillwing.dsl import parse
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.skill_actions import Hook
from skillwing.services.protocol import (
    BeginGoal,
    Ending,
    EndKind,
    ErrorCode,
    GoalStatus,
    ModifyGoal,
    NotReady,
    RecordOutcome,
    Terminal,
)

TUNED = parse(
    """
    skillset tuned {
        skill move {
            input {
                speed: float64 [m/s] in 0.1..3.0 = 1.0 modifiable
                height: float64 [m] in 0.5..9.0 = 1.0 modifiable
                label: string = "a"
            }
            effect { none {} }
            precondition { success none }
            interrupt { apply=none timeout=2.0 }
            result { success DONE: apply=none }
        }
    }
    """
)
FIXED = parse(
    """
    skillset fixed {
        skill move {
            input { speed: float64 = 1.0 }
            effect { none {} }
            precondition { success none }
            interrupt { apply=none timeout=2.0 }
            result { success DONE: apply=none }
        }
    }
    """
)
TWO_BAD_INPUTS = (
    "`speed` is 99 m/s; it has to lie between 0.1 and 3 m/s. `height` is 0 m; it has to lie between 0.5 and 9 m."
)


def running_of(skillset: Any) -> Desk:
    desk = Desk(skillset)
    desk.start(schema=skillset.schema_hash)
    desk.validated()
    desk.granted()
    desk.dispatched()
    return desk


def modify(desk: Desk, inputs: dict[str, Any], **fields: Any) -> None:
    known = {"goal_id": "g", "request_id": "m1", "client": "test", "schema": RIG.schema_hash, "cause": None}
    desk.step(ModifyGoal(inputs=inputs, **(known | fields)))


def refused(ask: Callable[[], object]) -> tuple[str, str]:
    """The problem and the remedy of a refusal."""
    with pytest.raises(RefusedError) as refusal:
        ask()
    return refusal.value.message, refusal.value.help


def test_a_refusal_without_a_remedy_has_none() -> None:
    assert RefusedError(ErrorCode.UNKNOWN_NAME, "There is no `x`.", known=("y",)).reply.help == ""


# --- requests that come too late, or from elsewhere ------------------------------------------------------------------


def test_a_late_request_is_told_by_how_much_and_whether_it_may_come_again() -> None:
    """A start needs another id: this one may already be an interrupted goal's."""
    desk = running()
    desk.now = 3.0
    assert refused(lambda: desk.start("late", deadline=1.5)) == (
        "The start of `move` came 1.5 s after its deadline.",
        "Start again with another goal id if it is still wanted.",
    )
    assert refused(lambda: modify(desk, {"speed": 2.0}, deadline=1.5)) == (
        "The modification of `move` came 1.5 s after its deadline.",
        "Ask again if it is still wanted.",
    )


def test_a_sender_with_another_version_of_the_skillset_reads_both() -> None:
    foreign = "0123456789abcdef and more, of any length"
    message, help = refused(lambda: Desk().start(schema=foreign))
    assert message == f"The sender has version {foreign[:16]} of `rig`, this process has {RIG.schema_hash}."
    assert help == "Start both from the same .skillset file."


# --- new inputs ------------------------------------------------------------------------------------------------------


def test_every_wrong_input_of_a_modification_is_named() -> None:
    desk = running_of(TUNED)
    ask = {"speed": 99.0, "height": 0.0}
    told = refused(lambda: modify(desk, ask, schema=TUNED.schema_hash))
    assert told == (TWO_BAD_INPUTS, "The goal keeps its own.")


def test_every_input_that_a_modification_changes_is_on_record() -> None:
    desk = running_of(TUNED)
    modify(desk, {"speed": 2.0, "height": 3.0}, schema=TUNED.schema_hash)
    desk.validated()
    assert desk.core.status("g").text == "test modified `speed` to 2.0, `height` to 3.0"


def test_a_goal_of_fixed_inputs_cannot_be_modified() -> None:
    desk = running_of(FIXED)
    assert refused(lambda: modify(desk, {"speed": 2.0}, schema=FIXED.schema_hash)) == (
        "The skillset calls no input of `move` modifiable.",
        "Start another goal.",
    )


def test_an_input_that_stays_leads_to_those_that_may_change() -> None:
    desk = running()
    with pytest.raises(RefusedError) as refusal:
        modify(desk, {"label": "b"})
    assert (refusal.value.message, refusal.value.help, refusal.value.known) == (
        "A goal of `move` keeps `label`.",
        "Modifiable inputs: `speed`.",
        ("speed",),
    )


def test_a_goal_that_is_ending_or_over_gets_no_new_inputs() -> None:
    desk = interrupting()
    again = "Start another one."
    assert refused(lambda: modify(desk, {"speed": 2.0})) == ("The goal is about to end.", again)
    desk.interrupted()
    desk.ended()
    assert refused(lambda: modify(desk, {"speed": 2.0})) == ("The goal is TERMINATED.", again)


def test_new_inputs_for_an_unknown_goal_are_no_matter_of_the_known_one() -> None:
    desk = running()
    with pytest.raises(RefusedError, match="`move` knows of no goal x") as refusal:
        modify(desk, {"speed": 2.0}, goal_id="x")
    assert refusal.value.code is ErrorCode.UNKNOWN_GOAL


def test_a_second_modification_waits_for_the_first() -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    later = refused(lambda: modify(desk, {"speed": 3.0}, request_id="m2"))
    assert later == ("The goal is RUNNING.", "Ask again when it runs.")
    undecided = refused(lambda: desk.core.modifications.require_accepted("m1"))
    assert undecided == ("The new inputs are still being validated.", "Ask again.")


@pytest.mark.parametrize(
    ("end", "answer"),
    [
        (lambda desk: desk.validated("Too windy."), ("Too windy.", "The goal keeps its own.")),
        (Desk.interrupt, ("The goal was ended before its new inputs counted.", "Start another one.")),
    ],
)
def test_a_modification_that_did_not_count_is_answered_with_the_reason(
    end: Callable[[Desk], None], answer: tuple[str, str]
) -> None:
    desk = running()
    modify(desk, {"speed": 2.0})
    end(desk)
    assert refused(lambda: desk.core.modifications.require_accepted("m1")) == answer


def test_a_modification_changes_neither_the_grant_nor_the_deadline_nor_the_count_of_silent_renewals() -> None:
    desk = running()
    before = (desk.core.renewal(), desk.core.next_tick())
    modify(desk, {"speed": 2.0})
    assert (desk.core.renewal(), desk.core.next_tick()) == before
    desk.validated()
    assert desk.hooks[-1] is Hook.MODIFY
    assert (desk.core.renewal(), desk.core.next_tick()) == before


# --- wrong inputs of a start, outputs, and local outcomes ------------------------------------------------------------


def test_every_wrong_input_of_a_start_is_named() -> None:
    desk = Desk(TUNED)
    desk.start(inputs={"speed": 99.0, "height": 0.0}, schema=TUNED.schema_hash)
    desk.outcome_committed()
    assert (desk.terminal().reason, desk.terminal().failing) == (TWO_BAD_INPUTS, ("speed", "height"))
    bench = Bench(TUNED)
    message = refused(lambda: bench.begin("move", "g", speed=99.0, height=0.0))
    assert message == (f"The inputs do not fit `move`: {TWO_BAD_INPUTS}", "Send what the skillset declares.")


def test_inputs_that_cannot_be_sent_name_no_input() -> None:
    desk = Desk()
    desk.start(inputs={"label": "\udc80"})
    desk.outcome_committed()
    assert (desk.terminal().ending, desk.terminal().failing) == (Ending.NOT_VALIDATED, ())


def test_every_wrong_output_is_named() -> None:
    desk = running()
    desk.terminated("DONE", {"distance": "far", "distanze": 3.0})
    desk.ended()
    assert desk.terminal().reason == (
        "The output of DONE does not fit the skillset: There is no field `distanze`; did you mean `distance`? "
        "`distance` is 'far'; it takes a finite number."
    )


def test_a_manager_may_give_four_outcomes_without_a_grant(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    request = RecordOutcome(
        goal_id="g",
        skill="move",
        terminal=Terminal(ending=Ending.LOST, reason="It is."),
        manager="skill/move",
        incarnation="one",
    )
    assert refused(lambda: bench.core.step(request, 0.0)) == (
        "A goal that was never granted cannot end with LOST, nor with anything that needs a run.",
        "Let `terminal` be BUSY, NV, IT or ERROR, without a result.",
    )


def test_an_outcome_of_which_no_record_is_known_names_none(bench: Bench) -> None:
    bench.attach("skill/move", "one")
    terminal = Terminal(ending=Ending.BUSY, reason="It runs another.")
    outcome = RecordOutcome(goal_id="g", skill="move", terminal=terminal, manager="skill/move", incarnation="one")
    assert bench.perform(bench.core.step(outcome, 0.0)).record == ""


# --- the resource manager --------------------------------------------------------------------------------------------


def test_an_end_with_a_result_needs_its_name(bench: Bench) -> None:
    token = granted(bench.begin("move", "g")).token
    assert refused(lambda: bench.end("move", "g", token, EndKind.RESULT)) == (
        "A goal that ends with a result needs the name of one.",
        "Name the `result` of `move` that it ended with.",
    )


@pytest.mark.parametrize(
    ("resource", "target", "help"),
    [
        ("axes", "USED", "From FREE only skills move it."),
        ("lamp", "LIT", "From OFF the functional layer can bring it to BROKEN."),
    ],
)
def test_a_transition_that_is_not_extern_leads_to_those_that_are(
    bench: Bench, resource: str, target: str, help: str
) -> None:
    assert refused(lambda: bench.extern(resource, target))[1] == help


def test_all_states_that_the_functional_layer_can_report_are_named() -> None:
    valve = parse(
        """
        skillset plant {
            resource valve {
                state { SHUT OPEN STUCK BROKEN }
                initial SHUT
                extern SHUT -> OPEN
                extern SHUT -> STUCK
                extern OPEN -> BROKEN
            }
        }
        """
    )
    assert refused(lambda: Bench(valve).extern("valve", "BROKEN")) == (
        "`valve` has no extern transition from SHUT to BROKEN.",
        "From SHUT the functional layer can bring it to OPEN or STUCK.",
    )


def test_every_failing_precondition_is_on_record_and_in_the_answer() -> None:
    bench = Bench()
    bench.extern("authority", "OFF")
    verdict = bench.begin("move", "g")
    assert isinstance(verdict, NotReady)
    reason = (
        "`authority == ON` does not hold: authority is OFF. "
        "`battery > 15.0` does not hold: battery is stale or was never published."
    )
    assert bench.published[-1].text == reason  # pyright: ignore[reportAttributeAccessIssue] - a Record
    desk = Desk()
    desk.start()
    desk.validated()
    assert isinstance(desk.asked.call, BeginGoal)
    desk.answer(verdict)
    assert (desk.terminal().reason, desk.terminal().failing) == (reason, ("authority", "charged"))


def test_every_wrong_part_of_a_datum_is_named() -> None:
    bench = Bench(
        parse(
            "skillset s { type P { x: int8  y: int8 }  data { at: P period=1.0 } skill go { "
            "precondition { near: data=(at.x < 5) } result { success DONE } } }"
        )
    )
    assert refused(lambda: bench.datum("at", {"x": "a", "y": "b"})) == (
        "`at.x` is 'a'; it takes a whole number (int8). `at.y` is 'b'; it takes a whole number (int8).",
        "Publish values of the type in the skillset.",
    )


def test_an_early_interrupt_is_the_reason_of_the_end() -> None:
    desk = Desk()
    help = refused(desk.interrupt)[1]
    assert help == "Should its start still arrive, it will end interrupted."
    desk.start()
    desk.outcome_committed()
    assert desk.terminal() == Terminal(ending=Ending.INTERRUPTED, reason="It was interrupted before it started.")
    assert isinstance(desk.actions[-1], GoalStatus)
