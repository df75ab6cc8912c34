"""Promises on the question whether a skill may start: it starts nothing, and agrees with starts (rule 2)."""

from __future__ import annotations

from conformance_system import System

from skillwing.services.protocol import Ending, ErrorCode, ErrorReply, SkillReady


def one(system: System, skill: str, inputs: dict[str, object] | None = None) -> SkillReady:
    """The readiness of one skill."""
    answer = system.ready(skill, inputs)
    assert not isinstance(answer, ErrorReply)
    (ready,) = answer
    return ready


def test_a_skill_that_may_start_is_ready_and_the_question_changes_nothing(system: System) -> None:
    before, latest = system.asked_states(), system.goal("grip", None)
    assert one(system, "grip", {}) == SkillReady(skill="grip", ready=True)
    after = system.asked_states()
    assert before is not None and after is not None
    assert (before.step, before.states) == (after.step, after.states)
    assert system.goal("grip", None) == latest


def test_the_answer_names_what_a_refused_start_names(system: System) -> None:
    system.trigger("door", "AJAR")
    system.stop_pressure()
    system.until(lambda: system.reading().stale, "a stale pressure")
    goal = system.run("push", forever=True)
    ready = one(system, "grip", {})
    refused, _ = system.start("grip")
    assert system.end(refused).ending is Ending.NOT_READY
    assert not ready.ready
    assert tuple(check.name for check in ready.failing) == system.end(refused).failing
    holders = {missing.resource: missing.holder for check in ready.failing for missing in check.missing}
    assert holders["door"] is None
    assert holders["arm"] is not None
    assert (holders["arm"].skill, holders["arm"].goal_id) == ("push", goal)


def test_a_skill_that_runs_is_not_ready(system: System) -> None:
    goal = system.run("look", forever=True)
    running = one(system, "look").running
    assert running is not None
    assert (running.goal_id, one(system, "look").ready) == (goal, False)


def test_what_would_make_it_ready_is_named(system: System) -> None:
    system.trigger("door", "AJAR")
    (safe,) = one(system, "grip", {}).failing
    (door,) = safe.missing
    assert (door.state, door.wanted, door.extern) == ("AJAR", ("SHUT",), ("SHUT",))
    assert door.events == ("cleared",)


def test_inputs_are_checked_if_they_are_given(system: System) -> None:
    assert one(system, "grip").ready
    assert list(one(system, "grip", {"force": 99.0}).inputs) == ["force"]


def test_without_a_skill_the_answer_is_about_all(system: System) -> None:
    answer = system.ready("")
    assert not isinstance(answer, ErrorReply)
    assert [each.skill for each in answer] == [skill.name for skill in system.skillset.skills]


def test_a_question_about_an_unknown_skill_is_refused(system: System) -> None:
    answer = system.ready("juggle")
    assert isinstance(answer, ErrorReply)
    assert (answer.code, "grip" in answer.known) == (ErrorCode.UNKNOWN_NAME, True)


def test_a_question_of_another_skillset_is_refused(system: System) -> None:
    answer = system.ready("grip", schema="another")
    assert isinstance(answer, ErrorReply)
    assert answer.code is ErrorCode.SCHEMA_MISMATCH
