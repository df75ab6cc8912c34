"""Guards that speak of inputs, of data, and of parts of them."""

from __future__ import annotations

import pytest
from gate import Gate
from rig import granted

from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import Ended, ErrorCode, NotReady, Violated


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
    assert gate.chain(violated.record) == ["lift.plain VIOLATED"]


def test_exactly_the_data_that_a_guard_speaks_of_are_followed() -> None:
    """Be it that of an event, a precondition, an invariant or a result; an input's name stands for the input."""
    gate = Gate()
    assert gate.core.data.names == ("wind", "load", "at", "permit", "heat")
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
