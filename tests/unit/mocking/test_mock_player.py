"""The run that each goal takes."""

from __future__ import annotations

from collections import Counter

from skillwing.dsl import parse
from skillwing.services.mocking import Choices, InputDelay, MockRun, MockScript
from skillwing.services.mocking.fitting import fit_run, fit_script
from skillwing.services.mocking.player import SkillPlayer

TWO = parse("""
skillset two {
    skill a { input { x: float64 } output { y: float64 in 1.0..2.0  z: float64 }
              progress=0.5 { left: float64  note: string }
              result { success GOOD  failure BAD } }
    skill b { result { success GOOD  failure BAD } }
    skill c { result { failure BAD } }
}
""")


def player(script: MockScript, skill: str = "a") -> SkillPlayer:
    fitted = fit_script(script, TWO)
    return SkillPlayer(TWO.skill(skill), fitted.skills[skill], fitted.seed)


def taken(skills: SkillPlayer, number: int) -> list[str]:
    return [skills.take().run.text for _ in range(number)]


GOOD, BAD = MockRun(result="GOOD"), MockRun(result="BAD")


def test_runs_follow_one_another_and_the_last_repeats() -> None:
    assert taken(player(MockScript(skills={"a": (BAD, GOOD)})), 4) == ["BAD", "GOOD", "GOOD", "GOOD"]


def test_a_skill_without_runs_succeeds_or_runs_on() -> None:
    assert player(MockScript()).take().run.text == "GOOD"
    assert player(MockScript(), "c").take().run.how == "forever"


def test_a_look_ahead_uses_nothing_up() -> None:
    mocks = player(MockScript(skills={"a": Choices((MockRun(delay=(0.0, 9.0)), BAD))}, seed=3))
    seen = mocks.peek()
    assert mocks.peek() is seen
    assert mocks.take() is seen


def test_a_delay_from_an_input_is_that_of_the_goal() -> None:
    by_input = MockRun(delay=InputDelay("x"))
    mocks = player(MockScript(skills={"a": (by_input,)}))
    assert [mocks.take({"x": x}).delay for x in (2.5, 0.0, -1.0)] == [2.5, 0.0, 0.0]


def test_choices_are_drawn_by_weight_and_seed() -> None:
    choices = Choices((MockRun(result="GOOD", weight=3.0), BAD))
    first = taken(player(MockScript(skills={"a": choices}, seed=1)), 400)
    assert first == taken(player(MockScript(skills={"a": choices}, seed=1)), 400)
    assert first != taken(player(MockScript(skills={"a": choices}, seed=2)), 400)
    assert 240 < Counter(first)["GOOD"] < 360


def test_skills_draw_independently_of_one_another() -> None:
    script = MockScript(skills={"a": Choices((GOOD, BAD)), "b": Choices((GOOD, BAD))}, seed=1)
    assert taken(player(script, "a"), 40) != taken(player(script, "b"), 40)


def test_delays_are_drawn_between_their_bounds() -> None:
    mocks = player(MockScript(skills={"a": (MockRun(delay=(1.0, 2.0)),)}))
    delays = [mocks.take().delay for _ in range(50)]
    assert all(1.0 <= delay <= 2.0 for delay in delays)
    assert len(set(delays)) > 40


def test_what_is_given_for_the_next_goals_comes_first() -> None:
    mocks = player(MockScript(skills={"a": (GOOD,)}))
    mocks.peek()
    bad = fit_run(BAD, TWO.skill("a"), lambda problem: None)
    mocks.give_next(bad)
    mocks.give_next(bad)
    assert [run.text for run in mocks.given] == ["BAD", "BAD"]
    assert taken(mocks, 3) == ["BAD", "BAD", "GOOD"]


def test_always_lasts_until_the_script_restarts() -> None:
    mocks = player(MockScript(skills={"a": (BAD, GOOD)}))
    mocks.give_always(fit_run(GOOD, TWO.skill("a"), lambda problem: None))
    assert taken(mocks, 2) == ["GOOD", "GOOD"]
    mocks.reset()
    assert taken(mocks, 2) == ["BAD", "GOOD"]


def test_outputs_and_feedback_that_are_left_out_are_valid() -> None:
    run = MockRun(output={"z": {"input": "x"}}, progress={"left": {"from": 2.0, "to": 0.0}})
    mocks = player(MockScript(skills={"a": (run,)}))
    planned = mocks.take()
    assert mocks.output(planned.run, {"x": 7.0}) == {"y": 1.0, "z": 7.0}
    assert mocks.feedback(planned, {"x": 7.0}, 0.5, 0) == {"left": 1.0, "note": ""}
    assert player(MockScript(), "b").output(planned.run, {}) is None
