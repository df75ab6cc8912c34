"""Order of steps and statuses: a goal is shown after the states that it follows from (rule 11)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from conformance_system import PATIENCE, System

from skillwing.services.bus import Handle, RunnableBus, Sample
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.protocol import (
    Ending,
    GoalStatus,
    Keys,
    ResourceStates,
    ResourceStep,
    State,
    Violated,
)

AWAY = 3.0
"""Time after which a client has found the loss of a goal, and before which it shows one without its states [s]."""


def asked_states(system: System) -> ResourceStates:
    states = system.asked_states()
    assert states is not None, "nobody answers"
    return states


def steps_between(system: System, before: ResourceStates, number: int) -> list[ResourceStep]:
    """Wait for the steps from `before` up to `number`. They have to be of one epoch, each published once, in order."""

    def steps() -> list[ResourceStep]:
        return [step for step in system.steps if before.step < step.number <= number]

    system.until(lambda: len(steps()) >= number - before.step, f"the steps {before.step + 1} to {number}")
    assert [step.number for step in steps()] == list(range(before.step + 1, number + 1))
    assert {step.epoch for step in steps()} <= {before.epoch}
    return steps()


def states_after(system: System, before: ResourceStates, number: int) -> dict[str, str]:
    """States after a step: those before, with the changes of all steps in between."""
    states = dict(before.states)
    for step in steps_between(system, before, number):
        for change in step.changes:
            assert states[change.subject] == change.before
            states[change.subject] = change.after
    return states


def told(system: System, goal: str, state: State) -> GoalStatus:
    """Wait for the published status of a goal."""
    system.until(lambda: state in system.story(goal), f"{goal} to be {state}")
    return next(each for each in system.statuses if each.goal_id == goal and each.state is state)


def test_a_goal_names_the_step_that_granted_it_and_the_step_that_ended_it(system: System) -> None:
    before = asked_states(system)
    system.trigger("part", "PRESENT")
    goal = system.run("look", forever=True)
    system.trigger("door", "AJAR")
    system.stage.end_now("look", "SEEN")
    granted, ended = (told(system, goal, state).after_step for state in (State.DISPATCHING, State.TERMINATED))
    assert told(system, goal, State.RUNNING).after_step == granted
    lamps = [states_after(system, before, number)["lamp"] for number in (granted - 1, granted, ended - 1, ended)]
    assert lamps == ["DARK", "LIT", "LIT", "DARK"]
    assert states_after(system, before, granted) == {**before.states, "part": "PRESENT", "lamp": "LIT"}
    assert states_after(system, before, ended) == asked_states(system).states


def test_an_interrupted_goal_names_the_step_that_gave_its_resources_back(system: System) -> None:
    before = asked_states(system)
    goal = system.run("look", forever=True)
    system.trigger("door", "AJAR")
    system.interrupt("look", goal)
    assert system.end(goal).ending is Ending.INTERRUPTED
    ended = told(system, goal, State.TERMINATED).after_step
    assert [states_after(system, before, number)["lamp"] for number in (ended - 1, ended)] == ["LIT", "DARK"]


def test_a_violated_goal_names_the_step_of_the_change_that_ended_it(system: System) -> None:
    goal = system.run("grip", forever=True)
    before = asked_states(system)
    answer = system.trigger("door", "AJAR")
    assert isinstance(answer, ResourceStates)
    assert system.end(goal).ending is Ending.INVARIANT_VIOLATED
    status = told(system, goal, State.TERMINATED)
    assert status.after_step == answer.step
    (step,) = steps_between(system, before, answer.step)
    changes = [(change.subject, change.after) for change in step.changes]
    assert changes[0] == ("door", "AJAR"), "the change comes first, and then all that it has broken"
    assert set(changes[1:]) == {("arm", "FREE"), ("gripper", "CLOSED")}
    assert [(type(verdict), verdict.goal_id) for verdict in step.verdicts] == [(Violated, goal)]
    assert status.cause in {record.id for record in step.records}


def test_a_refused_goal_names_the_step_that_refused_it(system: System) -> None:
    system.trigger("door", "AJAR")
    before = asked_states(system)
    goal, _ = system.start("grip")
    assert system.end(goal).ending is Ending.NOT_READY
    status = told(system, goal, State.TERMINATED)
    step = steps_between(system, before, status.after_step)[-1]
    assert [(record.id, record.goal_id) for record in step.records] == [(status.cause, goal)]
    assert states_after(system, before, status.after_step) == before.states


def test_the_reply_to_a_change_names_its_step_and_has_its_states(system: System) -> None:
    before = asked_states(system)
    replies = [
        system.trigger("part", "PRESENT"),
        system.trigger("door", "AJAR"),
        system.fire("cleared"),
        system.trigger("door", "SHUT"),
    ]
    for number, reply in enumerate(replies[:3], before.step + 1):
        assert isinstance(reply, ResourceStates)
        assert (reply.step, reply.epoch) == (number, before.epoch)
        assert reply.states == states_after(system, before, number)
    cleared, unchanged = replies[2:]
    assert isinstance(cleared, ResourceStates)
    assert isinstance(unchanged, ResourceStates)
    assert (unchanged.step, unchanged.states) == (cleared.step, cleared.states), "the door was shut already"


def test_the_numbers_of_steps_go_on_after_kill_minus_9(system: System) -> None:
    # A goal without guards on data: on a busy machine they may arrive too late after the restart, which is a violation.
    goal = system.run("look", forever=True)
    granted = told(system, goal, State.RUNNING).after_step
    before = asked_states(system)
    system.stage.kill("resource_manager")
    system.stage.restart("resource_manager")
    after = asked_states(system)
    assert (after.step, after.epoch) == (before.step + 1, before.epoch), "the return is a step"
    answer = system.trigger("part", "PRESENT")
    assert isinstance(answer, ResourceStates)
    assert answer.step == after.step + 1
    system.stage.end_now("look", "SEEN")
    assert system.end(goal).success
    ended = told(system, goal, State.TERMINATED).after_step
    assert ended > answer.step > granted
    assert [states_after(system, after, number)["lamp"] for number in (ended - 1, ended)] == ["LIT", "DARK"]


class BusWithoutSteps:
    """A bus on which each published step gets lost, so that every status overtakes its step."""

    def __init__(self, bus: RunnableBus, keys: Keys) -> None:
        self._bus = bus
        self._keys = keys

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def subscribe(self, key_expression: str, on_sample: Callable[[Sample], None], **options: Any) -> Handle:
        lost = key_expression == self._keys.resource_steps
        return self._bus.subscribe(key_expression, (lambda sample: None) if lost else on_sample, **options)


def test_a_client_shows_no_status_before_the_states_that_it_follows_from(system: System) -> None:
    bus = system.stage.bus("watcher")
    without_steps: Any = BusWithoutSteps(bus, system.keys)
    watcher = SkillsetInterface(without_steps, system.skillset, client="watcher", owns_goals=True)
    shown: list[tuple[str, int, str]] = []
    try:
        assert bus.run_until(lambda: watcher.ready, PATIENCE)
        goal = watcher.start("look")

        def look() -> None:
            if goal.record is not None:
                shown.append((goal.record, watcher.step or 0, watcher.states["lamp"]))

        watcher.on_change(look)
        goal.on_change(lambda goal: look())
        assert bus.run_until(lambda: goal.state is State.RUNNING, PATIENCE)
        system.stage.end_now("look", "SEEN")
        assert bus.run_until(lambda: goal.done, PATIENCE)
    finally:
        bus.close()
    told(system, goal.goal_id, State.TERMINATED)
    follows = {status.record: status.after_step for status in system.statuses}
    assert [(record, step) for record, step, _ in shown if follows[record] > step] == []
    assert {record: lamp for record, _, lamp in shown}[goal.record or ""] == "DARK"


def test_a_client_shows_a_loss_of_its_own_after_the_release_of_what_the_goal_held(system: System) -> None:
    """Both managers are gone, so that the client finds the loss first. Nothing is released until one is back."""
    bus = system.stage.bus("watcher")
    watcher = SkillsetInterface(bus, system.skillset, client="watcher", owns_goals=True)
    shown: list[tuple[str, str]] = []
    try:
        assert bus.run_until(lambda: watcher.ready, PATIENCE)
        goal = watcher.start("look")
        assert bus.run_until(lambda: goal.state is State.RUNNING, PATIENCE)
        assert watcher.states["lamp"] == "LIT"
        goal.on_change(
            lambda goal: shown.append((goal.terminal.label if goal.terminal else "", watcher.states["lamp"]))
        )
        for process in ("resource_manager", "skill/look"):
            system.stage.kill(process)
        bus.run_until(lambda: goal.done, AWAY)
        assert shown == []
        system.stage.restart("resource_manager")
        assert bus.run_until(lambda: goal.done, PATIENCE)
    finally:
        system.stage.restart("skill/look")
        bus.close()
    assert shown == [("LOST", "DARK")]
