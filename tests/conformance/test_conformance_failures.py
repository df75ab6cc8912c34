"""Failures: processes that die, freeze and come back, and clients that do (rules 7, 8 and 10)."""

from __future__ import annotations

from conformance_system import System

from skillwing.services.bus import RunnableBus
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import Ending, GoalStatus, Lost, State


def test_a_new_manager_does_not_inherit_the_goal_of_the_old_one(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.replace("grip")
    assert isinstance(system.verdict(goal), Lost)
    system.until_states(arm="FREE")
    system.trigger("gripper", "OPEN")
    following, told = system.start("grip")
    assert isinstance(told, GoalStatus)
    system.until(lambda: system.state(following) is State.RUNNING, "the new manager to take a goal")


def test_a_new_manager_stands_by_what_the_old_one_has_answered(system: System) -> None:
    """A client that was told that a goal does not run can rely on it, although the same start comes again."""
    cold = system.run("grip", invalid="The jaws are cold.")
    running = system.run("grip", forever=True)
    busy, _ = system.start("grip")
    interrupted = new_goal_id()
    system.interrupt("grip", interrupted)
    system.start("grip", interrupted)
    told = {goal: system.end(goal) for goal in (cold, busy, interrupted)}
    assert [end.ending for end in told.values()] == [Ending.NOT_VALIDATED, Ending.BUSY, Ending.INTERRUPTED]
    system.replace("grip")
    assert isinstance(system.verdict(running), Lost)
    system.until_states(arm="FREE")
    for goal, end in told.items():
        assert outcome_of_another_start(system, goal).terminal == end
        assert State.DISPATCHING not in system.story(goal)


def outcome_of_another_start(system: System, goal: str) -> GoalStatus:
    """Start a goal of `grip` once more, and wait until the manager that is there now says that it runs or is over."""

    def status() -> GoalStatus:
        told = system.goal("grip", goal)
        assert isinstance(told, GoalStatus)
        return told

    system.start("grip", goal)
    system.until(lambda: status().state in (State.RUNNING, State.TERMINATED), f"what becomes of {goal}")
    return status()


def test_the_resource_manager_survives_kill_minus_9(system: System) -> None:
    system.trigger("part", "PRESENT")
    # A goal without guards on data: on a busy machine they may arrive too late after the restart, which is a violation.
    goal = system.run("look", forever=True)
    before = system.asked_states()
    system.stage.kill("resource_manager")
    assert system.asked_states(patience=0.0) is None
    system.stage.restart("resource_manager")
    after = system.asked_states()
    assert before is not None
    assert after is not None
    assert after.step >= before.step, "step numbers go on from the journal"
    assert after.states == before.states
    assert system.state(goal) is State.RUNNING
    system.stage.end_now("look", "SEEN")
    assert system.end(goal).success
    system.until_states(lamp="DARK")


def test_an_end_waits_for_a_resource_manager_that_is_away(system: System) -> None:
    goal = system.run("look", result="SEEN", delay=0.4)
    system.stage.kill("resource_manager")
    system.wait(0.5)
    assert system.terminals(goal) == [], "nobody has judged it yet"
    system.stage.restart("resource_manager")
    end = system.end(goal)
    assert (end.ending, end.result) == (Ending.SUCCEEDED, "SEEN")
    system.until_states(lamp="DARK")


def owner(system: System, name: str) -> RunnableBus:
    """A client that owns goals as long as it lives."""
    bus = system.stage.bus(name)
    bus.declare_alive(system.keys.alive(f"client/{name}"))
    bus.run_until(lambda: False, 0.1)
    return bus


def test_a_goal_whose_owner_is_gone_is_interrupted(system: System) -> None:
    pilot = owner(system, "pilot")
    goal, _ = system.start("grip", owner="client/pilot")
    system.until(lambda: system.state(goal) is State.RUNNING, "the goal to run")
    pilot.close()
    end = system.end(goal)
    assert end.ending is Ending.INTERRUPTED
    assert "pilot" in end.reason


def test_a_goal_runs_on_for_the_grace_of_its_owner(system: System) -> None:
    pilot = owner(system, "pilot")
    goal, _ = system.start("grip", owner="client/pilot", owner_grace=3.0)
    system.until(lambda: system.state(goal) is State.RUNNING, "the goal to run")
    pilot.close()
    system.wait(2.0)
    assert system.state(goal) is State.RUNNING
    assert system.end(goal).ending is Ending.INTERRUPTED


def test_a_goal_whose_owner_is_back_within_its_grace_runs_on(system: System) -> None:
    pilot = owner(system, "pilot")
    goal, _ = system.start("grip", owner="client/pilot", owner_grace=3.0)
    system.until(lambda: system.state(goal) is State.RUNNING, "the goal to run")
    pilot.close()
    system.wait(2.0)
    back = owner(system, "pilot")
    system.wait(3.0)
    assert system.state(goal) is State.RUNNING
    back.close()
    assert system.end(goal).ending is Ending.INTERRUPTED


def test_a_goal_that_is_to_continue_outlives_its_owner(system: System) -> None:
    pilot = owner(system, "pilot")
    goal, _ = system.start("look", owner="client/pilot")
    other, _ = system.start("grip", owner="client/pilot")
    system.until(lambda: system.state(other) is State.RUNNING, "the goals to run")
    pilot.close()
    assert system.end(other).ending is Ending.INTERRUPTED
    system.wait(0.2)
    assert system.state(goal) is State.RUNNING


def test_a_goal_without_owner_needs_nobody(system: System) -> None:
    goal = system.run("grip", forever=True)
    owner(system, "passer-by").close()
    system.wait(1.5)
    assert system.state(goal) is State.RUNNING
