"""The generated `aio.py` against mocked managers in virtual time, which passes whenever the event loop is idle."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any
from unittest.mock import patch

import pytest
from lift_robot import MockedLift

from skillwing.dsl.model import UnknownNameError
from skillwing.services.bus import Bus, Handle, RunnableBus, Sample
from skillwing.services.client import interface as interface_module
from skillwing.services.client.aio import Client
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.errors import InvalidInputError, RefusedError, SkillwingError
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import MAX_MESSAGE_BYTES, Ending, ErrorCode, Keys, ProtocolError

Generated = Callable[[str], Any]
Scenario = Callable[[Any, Any], Coroutine[Any, Any, None]]
LONGEST = 60.0
"""Virtual seconds after which a scenario has failed."""


def play(generated: Generated, scenario: Scenario, *runs: MockRun) -> None:
    """Run `scenario(lift, types)` on an event loop that shares its thread with the network."""

    async def main() -> None:
        system = MockedLift(MockScript(skills={"go": runs} if runs else {}))
        client = Client(system.bus, system.interface)
        task = asyncio.ensure_future(scenario(generated("aio").Lift(client), generated("types")))
        while not task.done() and system.network.now() < LONGEST:
            system.network.run_for(0.01)
            for _ in range(4):  # what was handed over wakes waiters, who ask for something
                await asyncio.sleep(0)
        assert task.done(), "the scenario came to no end"
        await task

    asyncio.run(main())


def test_awaiting_a_goal_gives_its_outcome(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        outcome = await lift.go(place=types.Place(floor=3))
        assert outcome.succeeded and outcome.result == "ARRIVED"
        assert isinstance(outcome.output, types.GoOutputs)

    play(generated, scenario)


def test_keys_without_the_right_fail_the_goal_and_not_the_connection(
    generated: Generated, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(bus: Bus, key: str) -> None:
        raise RefusedError(ErrorCode.DENIED, "`alice` is a viewer, who may not start skills.")

    async def scenario(lift: Any, types: Any) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(interface_module, "require_allowed", refuse)
            with pytest.raises(RefusedError, match="may not start skills"):
                await lift.go(place=types.Place(floor=3))
        assert (await lift.go(place=types.Place(floor=3))).succeeded

    play(generated, scenario)


def test_several_goals_run_at_once(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        first, second = await asyncio.gather(lift.go(place=types.Place(floor=1)), lift.go(place=types.Place(floor=2)))
        assert {first.ending, second.ending} == {Ending.SUCCEEDED, Ending.BUSY}

    play(generated, scenario)


def test_cancelling_the_task_interrupts_the_goal_and_waits_for_its_end(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        waiting = asyncio.ensure_future(goal.wait())
        await lift.resources.motor.wait_for("USED")
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        assert goal.done
        assert (await goal).ending is Ending.INTERRUPTED
        assert lift.resources.motor.state == "FREE"

    play(generated, scenario, MockRun(forever=True, stop_delay=1.0))


def test_cancelling_once_more_leaves_the_goal_alone(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        waiting = asyncio.ensure_future(goal.wait())
        await lift.resources.motor.wait_for("USED")
        waiting.cancel()
        await asyncio.sleep(0)
        waiting.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        assert not goal.done
        assert (await goal).terminal.forced

    play(generated, scenario, MockRun(forever=True, stop_delay="never"))


def test_a_cancelled_task_is_cancelled_even_if_the_connection_closes_meanwhile(generated: Generated) -> None:
    async def main() -> None:
        system = MockedLift(MockScript())
        client = Client(system.bus, system.interface)
        lift, types = generated("aio").Lift(client), generated("types")
        waiting = asyncio.ensure_future(lift.go(place=types.Place(floor=3)).wait())
        await asyncio.sleep(0)
        waiting.cancel()
        await asyncio.sleep(0)
        assert not waiting.done()
        client.close()
        with pytest.raises(asyncio.CancelledError):
            await waiting

    asyncio.run(main())


def test_cancelling_one_of_two_waiters_interrupts_the_goal_of_both(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        one, other = asyncio.ensure_future(goal.wait()), asyncio.ensure_future(goal.wait())
        await lift.resources.motor.wait_for("USED")
        one.cancel()
        assert (await other).ending is Ending.INTERRUPTED
        with pytest.raises(asyncio.CancelledError):
            await one

    play(generated, scenario, MockRun(forever=True))


def test_cancelling_one_who_only_looks_on_leaves_the_goal_running(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))

        async def look_on() -> None:
            async for _ in goal.feedback():
                pass

        looking = asyncio.ensure_future(look_on())
        await lift.resources.motor.wait_for("USED")
        looking.cancel()
        with pytest.raises(asyncio.CancelledError):
            await looking
        assert (await goal).succeeded

    play(generated, scenario, MockRun(delay=2.0))


def test_feedback_is_an_asynchronous_iterator(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        assert [feedback.level async for feedback in goal.feedback()] == [1.5, 1.5, 1.5]
        assert (await goal).succeeded

    mocks, types = generated("mocks"), generated("types")
    play(generated, scenario, mocks.GoMock.ended_ARRIVED(feedback=types.GoFeedback(level=1.5), delay=1.9))


def test_wrong_inputs_are_reported_before_anything_is_sent(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        with pytest.raises(InvalidInputError, match="speed"):
            lift.go(place=types.Place(floor=3), speed="fast")

    play(generated, scenario)


def test_resources_are_awaited_and_driven(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        assert await lift.resources.motor.wait_for("USED") == "USED"
        await lift.resources.power.trigger("OFF")
        assert await lift.resources.power.wait_for("OFF") == "OFF"
        assert (await goal).ending is Ending.INVARIANT_VIOLATED
        with pytest.raises(RefusedError):
            await lift.resources.motor.trigger("USED")
        with pytest.raises(UnknownNameError, match="did you mean `USED`"):
            await lift.resources.motor.trigger("USE")

    play(generated, scenario)


def test_events_are_fired(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        await lift.events.blackout()
        assert await lift.resources.power.wait_for("OFF") == "OFF"
        with pytest.raises(RefusedError):
            await lift.events.blackout()

    play(generated, scenario)


def test_data_are_read_and_awaited(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        assert await lift.data.level.wait_for(lambda level: level >= 0.0) == 0.0
        reading = await lift.data.level.read()
        assert (reading.value, reading.stale) == (0.0, False)

    play(generated, scenario)


def test_a_waiting_call_fails_when_the_connection_closes(generated: Generated) -> None:
    async def main() -> None:
        system = MockedLift(MockScript())
        client = Client(system.bus, system.interface)
        lift, types = generated("aio").Lift(client), generated("types")
        waiting = asyncio.ensure_future(lift.go(place=types.Place(floor=3)).wait())
        await asyncio.sleep(0)
        client.close()
        with pytest.raises(SkillwingError, match="Connect again"):
            await waiting

    asyncio.run(main())


def test_a_script_asks_whether_a_skill_may_start(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        assert (await lift.ready("go")).ready
        assert "speed" in (await lift.ready("go", {"place": types.Place(floor=3), "speed": 9.0})).inputs
        with pytest.raises(InvalidInputError):
            await lift.ready("go", {})
        with pytest.raises(UnknownNameError):
            await lift.ready("fly")

    play(generated, scenario)


def test_a_running_goal_takes_new_inputs(generated: Generated) -> None:
    async def scenario(lift: Any, types: Any) -> None:
        goal = lift.go(place=types.Place(floor=3))
        await goal.modify(place=types.Place(floor=7))
        with pytest.raises(RefusedError, match="speed"):
            await goal.modify(speed=99.0)
        with pytest.raises(InvalidInputError):
            await goal.modify(speed="fast")
        assert (await goal).output.stopped_at == types.Place(floor=7)

    play(generated, scenario, MockRun(delay=5.0, output={"stopped_at": {"input": "place"}}))


class BusWithoutSteps:
    """A bus on which each step of the resource manager gets lost: a reply with the states releases the statuses."""

    def __init__(self, bus: RunnableBus) -> None:
        self._bus = bus

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def subscribe(self, key_expression: str, on_sample: Callable[[Sample], None], **options: Any) -> Handle:
        lost = key_expression == Keys("lift").resource_steps
        return self._bus.subscribe(key_expression, (lambda sample: None) if lost else on_sample, **options)


def test_no_task_sees_a_goals_end_before_the_states_of_its_step(generated: Generated) -> None:
    """A task may run between any two calls that the loop was given."""

    async def main() -> None:
        system = MockedLift(MockScript(skills={"go": (MockRun(delay=0.5),)}))
        bus: Any = BusWithoutSteps(system.network.bus("script"))
        interface = SkillsetInterface(bus, system.skillset, client="script")
        assert system.network.run_until(lambda: interface.ready, 5.0)
        calls: list[tuple[Callable[..., object], tuple[Any, ...]]] = []
        seen: list[tuple[bool, str]] = []
        with patch.object(
            asyncio.get_running_loop(), "call_soon_threadsafe", lambda *call: calls.append((call[0], call[1:]))
        ):
            client = Client(bus, interface)
            lift = generated("aio").Lift(client)
            goal = lift.go(place=generated("types").Place(floor=3))
            system.network.run_for(5.0)
        for call, arguments in calls:
            call(*arguments)
            seen.append((goal.done, lift.resources.motor.state))
        assert (False, "USED") in seen
        assert {motor for done, motor in seen if done} == {"FREE"}

    asyncio.run(main())


def test_a_start_that_no_message_can_hold_leaves_nothing_behind() -> None:
    system = MockedLift(MockScript())
    with pytest.raises(ProtocolError):
        system.interface.start("shine", goal_id="g" * MAX_MESSAGE_BYTES)
    assert not system.interface._trackers
