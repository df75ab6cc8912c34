"""The generated `interface.py` against mocked managers in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from lift_robot import MockedLift

from skillwing.dsl.model import UnknownNameError
from skillwing.services.client.outcome import GoalFailedError
from skillwing.services.client.sync import Client
from skillwing.services.errors import InvalidInputError, RefusedError, TimedOutError
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import Ending, ErrorCode, State

Generated = Callable[[str], Any]


class Rig:
    """The lift, its generated modules, and the client made from them."""

    def __init__(self, generated: Generated, *runs: MockRun) -> None:
        self.system = MockedLift(MockScript(skills={"go": runs} if runs else {}))
        self.types, self.mocks = generated("types"), generated("mocks")
        self.lift = generated("interface").Lift(Client(self.system.bus, self.system.interface))

    def go(self, **options: Any) -> Any:
        return self.lift.go(place=self.types.Place(floor=3), **options)


def test_a_goal_ends_with_a_typed_outcome(generated: Generated) -> None:
    types, mocks = generated("types"), generated("mocks")
    output = types.GoOutputs(stopped_at=types.Place(floor=3, load=types.Load.CRATE))
    rig = Rig(generated, mocks.GoMock.ended_ARRIVED(output, delay=2.0))
    outcome = rig.go().wait()
    assert outcome.result == "ARRIVED"
    assert outcome.succeeded and outcome.require_success() is outcome
    assert outcome.output == output


def test_a_result_that_did_not_hold_is_none(generated: Generated) -> None:
    outcome = Rig(generated, generated("mocks").GoMock.ended_STUCK()).go().wait()
    assert (outcome.ending, outcome.result, outcome.terminal.result) == (Ending.NOT_HELD, None, "STUCK")
    with pytest.raises(GoalFailedError, match="N_STUCK") as failure:
        outcome.require_success()
    assert failure.value.outcome is outcome


def test_waiting_may_be_given_up_and_the_goal_goes_on(generated: Generated) -> None:
    rig = Rig(generated, MockRun(delay=5.0))
    goal = rig.go()
    with pytest.raises(TimedOutError, match="`go`"):
        goal.wait(timeout=1.0)
    assert goal.state is State.RUNNING and not goal.done
    assert goal.wait().succeeded


def test_an_interrupted_goal_is_no_success(generated: Generated) -> None:
    rig = Rig(generated, MockRun(forever=True))
    goal = rig.go()
    goal.interrupt()
    outcome = goal.wait()
    assert (outcome.ending, outcome.succeeded, outcome.result) == (Ending.INTERRUPTED, False, None)


def test_ctrl_c_interrupts_the_goal(generated: Generated, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(generated, MockRun(forever=True))
    goal = rig.go()
    run_until = rig.system.bus.run_until

    def pressed(done: Callable[[], bool], timeout: float | None = None) -> bool:
        monkeypatch.undo()
        run_until(lambda: goal.handle.state is State.RUNNING, 1.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(rig.system.bus, "run_until", pressed)
    with pytest.raises(KeyboardInterrupt):
        goal.wait()
    assert goal.handle.terminal is not None and goal.handle.terminal.ending is Ending.INTERRUPTED
    assert rig.lift.resources.motor.state == "FREE"


def test_ctrl_c_counts_even_if_the_connection_is_lost_meanwhile(
    generated: Generated, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(generated, MockRun(forever=True))
    goal = rig.go()

    def closed(done: Callable[[], bool], timeout: float | None = None) -> bool:
        return False

    def pressed(done: Callable[[], bool], timeout: float | None = None) -> bool:
        monkeypatch.setattr(rig.system.bus, "run_until", closed)
        raise KeyboardInterrupt

    monkeypatch.setattr(rig.system.bus, "run_until", pressed)
    with pytest.raises(KeyboardInterrupt):
        goal.wait()


def test_feedback_comes_typed_until_the_end(generated: Generated) -> None:
    types, mocks = generated("types"), generated("mocks")
    rig = Rig(generated, mocks.GoMock.ended_ARRIVED(feedback=types.GoFeedback(level=1.5), delay=1.9))
    goal = rig.go()
    assert list(goal.feedback()) == [types.GoFeedback(level=1.5)] * 3
    assert goal.wait().succeeded


def test_wrong_inputs_are_reported_at_once(generated: Generated) -> None:
    with pytest.raises(InvalidInputError, match="speed"):
        Rig(generated).go(speed="fast")


def test_a_missing_input_does_not_hide_one_out_of_range(generated: Generated) -> None:
    rig = Rig(generated)
    with pytest.raises(InvalidInputError) as caught:
        rig.system.interface.start("go", {"speed": 99.0})
    assert set(caught.value.problems) == {"place", "speed"}


def test_resources_are_read_awaited_and_driven(generated: Generated) -> None:
    rig = Rig(generated, MockRun(delay=1.0))
    motor, power = rig.lift.resources.motor, rig.lift.resources.power
    goal = rig.go()
    assert motor.wait_for("USED") == "USED"
    power.trigger("OFF")
    assert power.wait_for("ON", "OFF", timeout=1.0) == "OFF"
    outcome = goal.wait()
    assert (outcome.ending, outcome.terminal.invariant) == (Ending.INVARIANT_VIOLATED, "on")
    assert motor.state == "FREE"
    with pytest.raises(TimedOutError, match="`power` in ON"):
        power.wait_for("ON", timeout=0.5)
    with pytest.raises(RefusedError):
        motor.trigger("USED")


def test_events_are_fired_where_their_guard_holds(generated: Generated) -> None:
    rig = Rig(generated)
    rig.lift.events.blackout()
    assert rig.lift.resources.power.wait_for("OFF", timeout=1.0) == "OFF"
    with pytest.raises(RefusedError):
        rig.lift.events.blackout()


def test_data_are_read_and_awaited(generated: Generated) -> None:
    rig = Rig(generated)
    assert rig.lift.data.level.wait_for(lambda level: level >= 0.0, timeout=2.0) == 0.0
    reading = rig.lift.data.level.read()
    assert (reading.value, reading.stale) == (0.0, False)
    with pytest.raises(TimedOutError, match="`level`"):
        rig.lift.data.level.wait_for(lambda level: level > 100.0, timeout=1.0)


def test_a_skill_without_results_runs_until_interrupted(generated: Generated) -> None:
    rig = Rig(generated)
    goal = rig.lift.shine()
    goal.interrupt()
    assert goal.wait().ending is Ending.INTERRUPTED


def test_a_script_of_mocks_is_typed_by_skill(generated: Generated) -> None:
    mocks = generated("mocks")
    script = mocks.script(go=[mocks.GoMock.refused("full"), mocks.GoMock.failed("jammed"), mocks.GoMock.lost()], seed=4)
    assert script.seed == 4
    assert script.skills == {"go": [MockRun(invalid="full"), MockRun(error="jammed"), MockRun(crash=True)]}
    rig = Rig(generated, *script.skills["go"][:2])
    assert [rig.go().wait().ending for _ in range(2)] == [Ending.NOT_VALIDATED, Ending.ERROR]


def test_a_script_asks_whether_a_skill_may_start(generated: Generated) -> None:
    rig = Rig(generated, MockRun(forever=True))
    place = rig.types.Place(floor=3)
    assert rig.lift.ready("go").ready
    assert rig.lift.ready("go", {"place": place}).ready
    assert "speed" in rig.lift.ready("go", {"place": place, "speed": 9.0}).inputs
    goal = rig.go()
    rig.system.bus.run_until(lambda: goal.handle.state is State.RUNNING, 10.0)
    busy = rig.lift.ready("go", {"place": place})
    assert not busy.ready
    assert busy.running is not None and busy.running.goal_id == goal.id
    (free,) = busy.failing
    assert free.missing[0].holder == busy.running
    with pytest.raises(InvalidInputError):
        rig.lift.ready("go", {})
    with pytest.raises(UnknownNameError):
        rig.lift.ready("fly")


def test_a_running_goal_takes_new_inputs(generated: Generated) -> None:
    rig = Rig(generated, MockRun(delay=5.0, output={"stopped_at": {"input": "place"}}))
    goal = rig.go()
    goal.modify(place=rig.types.Place(floor=7), speed=0.5)
    outcome = goal.wait()
    assert outcome.output.stopped_at == rig.types.Place(floor=7)


def test_new_inputs_out_of_range_are_refused_and_the_goal_goes_on(generated: Generated) -> None:
    goal = Rig(generated, MockRun(delay=5.0)).go()
    with pytest.raises(RefusedError, match="speed") as refused:
        goal.modify(speed=99.0)
    assert refused.value.code is ErrorCode.BAD_REQUEST
    assert goal.wait().succeeded
    with pytest.raises(RefusedError, match="has ended"):
        goal.modify(speed=1.0)


def test_only_modifiable_inputs_can_be_modified(generated: Generated) -> None:
    rig = Rig(generated, MockRun(delay=5.0))
    goal = rig.go()
    with pytest.raises(RefusedError, match="keeps `loud`"):
        goal.modify_inputs({"loud": True})
    with pytest.raises(TypeError):
        goal.modify(loud=True)
    assert not hasattr(rig.lift.shine(), "modify")
