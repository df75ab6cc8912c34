"""Promises on resources: grants, invariants, transitions and data (rules 2, 3 and 4)."""

from __future__ import annotations

from conformance_system import System

from skillwing.services.bus import Answer
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import Ending, ErrorCode, ErrorReply, ResourceStates, State, encode


def test_of_two_goals_at_the_same_time_one_gets_the_arm(system: System) -> None:
    goals = {"grip": new_goal_id(), "push": new_goal_id()}
    answers: list[Answer] = []
    for skill, goal in goals.items():
        system.bus.ask(system.keys.start(skill), encode(system.start_of(skill, goal)), answers.append)
    decided = (State.RUNNING, State.TERMINATED)
    system.until(lambda: all(system.state(goal) in decided for goal in goals.values()), "both to be decided")
    refused = [goal for goal in goals.values() if any(end.ending is Ending.NOT_READY for end in system.terminals(goal))]
    assert len(refused) == 1
    assert system.end(refused[0]).failing == ("free",)


def test_a_goal_holds_its_resources_from_the_grant_to_the_end(system: System) -> None:
    goal = system.run("push", result="PUSHED", delay=0.3)
    assert system.states["arm"] == "TAKEN"
    refused, _ = system.start("grip")
    assert system.end(refused).failing == ("free",)
    system.end(goal)
    following = system.run("grip", forever=True)
    assert system.state(following) is State.RUNNING


def test_invariants_are_judged_from_the_top_until_nothing_is_violated(system: System) -> None:
    """ONERA's generated nodes overwrite their `changed` flag, and stop one violation too early."""
    look = system.run("look", forever=True)
    grip = system.run("grip", forever=True)
    answer = system.trigger("door", "AJAR")
    assert isinstance(answer, ResourceStates)
    assert (answer.states["arm"], answer.states["lamp"]) == ("FREE", "DARK"), "in the same step"
    assert system.end(grip).invariant == "safe"
    assert system.end(look).invariant == "steady", "the violated grip snapped the gripper shut"
    assert system.causes(look)[0] == "door AJAR"


def test_the_answer_to_a_transition_holds_everything_that_it_broke(system: System) -> None:
    system.run("grip", forever=True)
    before = system.asked_states()
    answer = system.trigger("door", "AJAR")
    assert before is not None
    assert isinstance(answer, ResourceStates)
    assert answer.step == before.step + 1, "the door and what the violated grip did are one step"
    assert (answer.states["door"], answer.states["arm"], answer.states["gripper"]) == ("AJAR", "FREE", "CLOSED")


def test_a_datum_out_of_bounds_violates(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.set_pressure(0.5)
    end = system.end(goal)
    assert (end.ending, end.invariant, end.subject) == (Ending.INVARIANT_VIOLATED, "fed", "pressure")


def test_a_guard_on_a_stale_datum_does_not_hold(system: System) -> None:
    goal = system.run("grip", forever=True)
    system.stop_pressure()
    end = system.end(goal)
    assert (end.ending, end.invariant) == (Ending.INVARIANT_VIOLATED, "fed")
    refused, _ = system.start("grip")
    assert system.end(refused).failing == ("fed",)
    assert system.reading().stale


def test_the_robot_takes_extern_transitions_only(system: System) -> None:
    refused = system.trigger("arm", "TAKEN")
    assert isinstance(refused, ErrorReply)
    assert (refused.code, system.states["arm"]) == (ErrorCode.NOT_ALLOWED, "FREE")
    assert refused.help


def test_a_transition_that_the_model_has_not_is_refused_with_those_it_has(system: System) -> None:
    refused = system.trigger("table", "HIGH")
    assert isinstance(refused, ErrorReply)
    assert (refused.code, refused.known) == (ErrorCode.NOT_ALLOWED, ("MID",))


def test_unknown_names_are_refused_with_the_known_ones(system: System) -> None:
    for refused, known in ((system.trigger("dor", "SHUT"), "door"), (system.trigger("door", "OPEN"), "AJAR")):
        assert isinstance(refused, ErrorReply)
        assert refused.code is ErrorCode.UNKNOWN_NAME
        assert known in refused.known


def test_naming_the_present_state_changes_nothing(system: System) -> None:
    before = system.asked_states()
    assert isinstance(system.trigger("door", "SHUT"), ResourceStates)
    after = system.asked_states()
    assert before is not None
    assert after is not None
    assert (after.step, after.states) == (before.step, before.states)


def test_an_event_is_all_of_its_transitions_or_none(system: System) -> None:
    system.trigger("part", "PRESENT")
    refused = system.fire("cleared")
    assert isinstance(refused, ErrorReply)
    assert (refused.code, system.states["part"]) == (ErrorCode.NOT_ALLOWED, "PRESENT"), "its guard asks for a door ajar"
    system.trigger("door", "AJAR")
    assert isinstance(system.fire("cleared"), ResourceStates)
    assert (system.states["part"], system.states["door"]) == ("ABSENT", "SHUT")
