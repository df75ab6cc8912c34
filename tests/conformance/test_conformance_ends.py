"""Every way in which a goal can end, and what its terminal answer carries."""

from __future__ import annotations

from conformance_system import System

from skillwing.services.protocol import Ending, GoalStatus, Lost, State

RUN = [State.VALIDATING, State.DISPATCHING, State.RUNNING]


def test_s_a_result_that_held_is_a_success_with_its_output(system: System) -> None:
    system.trigger("part", "PRESENT")
    goal = system.run("grip", result="GRIPPED", delay=0.3, output={"width": 0.04})
    assert system.states["arm"] == "TAKEN"
    end = system.end(goal)
    assert (end.ending, end.result, end.success) == (Ending.SUCCEEDED, "GRIPPED", True)
    assert end.output == {"width": 0.04}
    assert system.states["arm"] == "FREE"
    assert system.story(goal) == [*RUN, State.TERMINATED]


def test_s_a_failure_that_held_is_no_success(system: System) -> None:
    end = system.end(system.run("grip", result="MISSED", delay=0.0, output={"width": 0.0}))
    assert (end.ending, end.result, end.success) == (Ending.SUCCEEDED, "MISSED", False)


def test_n_a_postcondition_that_does_not_hold_frees_the_resources_all_the_same(system: System) -> None:
    end = system.end(system.run("grip", result="GRIPPED", delay=0.0, output={"width": 0.0}))
    assert (end.ending, end.result, end.success) == (Ending.NOT_HELD, "GRIPPED", False)
    assert "part" in end.reason
    assert system.states["arm"] == "FREE"


def test_n_an_effect_that_cannot_apply_is_loud_and_not_half_applied(system: System) -> None:
    """ONERA's generated nodes drop such an effect, and still answer success."""
    system.trigger("table", "MID")
    goal = system.run("raise_table", forever=True)
    system.trigger("table", "LOW")
    system.stage.end_now("raise_table", "RAISED")
    end = system.end(goal)
    assert (end.ending, end.result, end.success) == (Ending.NOT_HELD, "RAISED", False)
    assert "table" in end.reason
    assert (system.states["lamp"], system.states["table"]) == ("LIT", "LOW"), "neither of its two transitions"


def test_nv_an_input_out_of_range_is_refused_by_name(system: System) -> None:
    goal, told = system.start("grip", inputs={"force": 99.0})
    assert isinstance(told, GoalStatus)
    end = system.end(goal)
    assert (end.ending, end.failing) == (Ending.NOT_VALIDATED, ("force",))
    assert end.reason
    assert State.DISPATCHING not in system.story(goal)


def test_nv_the_skill_itself_may_say_no(system: System) -> None:
    end = system.end(system.run("grip", invalid="The jaws are cold."))
    assert (end.ending, end.reason) == (Ending.NOT_VALIDATED, "The jaws are cold.")
    assert system.states["arm"] == "FREE"


def test_nr_every_failing_precondition_is_named_with_its_reason(system: System) -> None:
    """Aerostack2 #420: a rejection carries no reason."""
    system.run("push", forever=True)
    system.trigger("door", "AJAR")
    system.set_pressure(1.5)
    goal, _ = system.start("grip")
    end = system.end(goal)
    assert (end.ending, set(end.failing)) == (Ending.NOT_READY, {"free", "safe", "fed"})
    for subject in ("arm", "door", "pressure"):
        assert subject in end.reason
    assert system.causes(goal) == ["door AJAR", "grip NOT_READY", "grip NR"], "the latest change of what it needs"


def test_ri_a_violated_invariant_ends_the_goal_and_names_the_cause(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.trigger("door", "AJAR")
    end = system.end(goal)
    assert (end.ending, end.invariant, end.subject) == (Ending.INVARIANT_VIOLATED, "safe", "door")
    assert (system.states["arm"], system.states["gripper"]) == ("FREE", "CLOSED"), "its violation effect"
    assert system.causes(goal) == ["door AJAR", "grip.safe VIOLATED", "grip RI"]


def test_it_an_interrupt_ends_when_the_skill_confirms_it(system: System) -> None:
    """Nav2 and Aerostack2 map a cancelled goal to success."""
    goal = system.run("grip", forever=True, stop_delay=0.1)
    system.interrupt("grip", goal)
    end = system.end(goal)
    assert (end.ending, end.forced, end.success) == (Ending.INTERRUPTED, False, False)
    assert system.story(goal) == [*RUN, State.INTERRUPTING, State.TERMINATED]


def test_it_an_interrupt_that_nobody_confirms_is_forced(system: System) -> None:
    """ONERA's generated nodes wait for ever."""
    goal = system.run("grip", forever=True, stop_delay="never")
    before = system.bus.now()
    system.interrupt("grip", goal)
    end = system.end(goal)
    assert (end.ending, end.forced) == (Ending.INTERRUPTED, True)
    assert system.bus.now() - before >= system.skillset.skill("grip").interrupt.timeout
    assert system.states["arm"] == "FREE"


def test_it_a_goal_past_its_deadline_is_interrupted(system: System) -> None:
    end = system.end(system.run("push", forever=True))
    assert (end.ending, end.forced) == (Ending.INTERRUPTED, False)
    assert "deadline" in end.reason


def test_busy_answers_the_new_id_and_leaves_the_running_goal_alone(system: System) -> None:
    """ONERA's generated nodes answer the running goal's id: its client thinks it over, the new one hears nothing."""
    running = system.run("grip", forever=True)
    goal, _ = system.start("grip")
    end = system.end(goal)
    assert (end.ending, end.running_goal) == (Ending.BUSY, running)
    assert (system.state(running), system.terminals(running)) == (State.RUNNING, [])


def test_error_a_skill_that_fails_ends_with_its_lost_effect_and_lives_on(system: System) -> None:
    end = system.end(system.run("grip", error="The motor is gone.", delay=0.1))
    assert end.ending is Ending.ERROR
    assert "The motor is gone." in end.reason
    assert (system.states["arm"], system.states["gripper"]) == ("FREE", "CLOSED"), "its lost effect"
    assert system.end(system.run("push", result="PUSHED", delay=0.0)).success


def test_lost_a_manager_that_dies_loses_its_goal(system: System) -> None:
    """rclcpp #2241, executive_smach #69: no callback ever comes."""
    goal = system.run("grip", forever=True)
    system.stage.kill("skill/grip")
    assert isinstance(system.verdict(goal), Lost)
    assert (system.states["arm"], system.states["gripper"]) == ("FREE", "CLOSED"), "its lost effect"
    if system.stage.apart:
        assert system.end(system.run("push", result="PUSHED", delay=0.0)).success, "others go on"


def test_lost_a_manager_that_hangs_in_a_hook_loses_its_goal(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.stage.hang("grip")
    verdict = system.verdict(goal)
    assert isinstance(verdict, Lost)
    assert "silent" in verdict.reason
    assert system.states["arm"] == "FREE"


def test_lost_a_manager_that_freezes_loses_its_goal_and_learns_of_it_when_it_wakes_up(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.stage.freeze("skill/grip")
    assert isinstance(system.verdict(goal), Lost)
    assert system.states["arm"] == "FREE"
    other = system.run("push", result="PUSHED", delay=0.6) if system.stage.apart else None
    system.stage.thaw("skill/grip")
    assert system.end(goal).ending is Ending.LOST
    status = next(each for each in system.statuses if each.goal_id == goal and each.terminal is not None)
    verdict = system.verdict(goal)
    assert (status.cause, status.after_step) == (verdict.record, verdict.step), "however it has learned of it"
    if other is not None:
        assert system.end(other).success, "what the old manager still says takes nothing from its successor in the arm"
