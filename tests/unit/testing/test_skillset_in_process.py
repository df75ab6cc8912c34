"""A whole skillset on the bench: hooks where there are some, mocks for the rest; and the fixtures."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lifter import COMMAND, LIFTER, POSITION, Done, Go, Lift, Position

from skillwing.dsl.model import Resource, Transition
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.testing import SkillsetInProcess, SkillTest
from skillwing.services.testing.context import extern_way

pytest_plugins = ["pytester", "skillwing.services.testing.fixtures"]
READY = {"states": {"power": "ON"}, "data": {"load": 1.0}}


def test_mocks_play_the_skills_without_hooks() -> None:
    script = MockScript(skills={"ring": (MockRun(delay=7.0),)})
    robot = SkillsetInProcess(LIFTER, [Lift], script=script, **READY)
    robot.layer.answer(COMMAND, Go, Done())
    bell, lift = robot.start_skill("ring"), robot.start_skill("lift", height=1.0)
    robot.layer.publish(POSITION, Position(height=1.0))
    lift.assert_ended("S_UP", within=1.0)
    bell.assert_running()
    bell.assert_ended("S_RUNG", within=8.0)
    assert set(robot.hooks) == {"lift"}


def test_without_mocks_nobody_answers_for_the_other_skills() -> None:
    robot = SkillsetInProcess(LIFTER, [Lift], mocks=False, **READY)
    robot.send_start("ring").assert_ended("LOST")


def test_the_resource_manager_can_die_too() -> None:
    robot = SkillsetInProcess(LIFTER, **READY)
    robot.kill("resource_manager")
    robot.send_start("lift", height=1.0).assert_ended("ERROR", reason="resource manager does not answer")
    robot.restart("resource_manager")
    robot.run(3.0)
    robot.start_skill("lift", height=1.0).assert_ended("S_UP")


def test_with_jitter_the_same_seed_gives_the_same_story() -> None:
    def story(seed: int) -> str:
        robot = SkillsetInProcess(LIFTER, seed=seed, jitter=0.01, **READY)
        robot.start_skill("lift", height=1.0).assert_ended("S_UP")
        return robot.story()

    assert story(1) == story(1)
    assert story(1) != story(2)


def test_fixtures_close_what_they_made(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest
        from lifter import COMMAND, LIFTER, Done, Go, Lift

        pytest_plugins = ["skillwing.services.testing.fixtures"]
        seen = []

        def test_uses_them(skill_test, skillset_in_process):
            seen.append(skill_test(LIFTER, Lift, states={"power": "ON"}, data={"load": 1.0}))
            seen[0].layer.answer(COMMAND, Go, Done())
            seen[0].start(height=1.0).assert_running()
            seen.append(skillset_in_process(LIFTER))

        def test_finds_them_closed():
            assert seen[0].hooks["lift"].current is None
            for bench in seen:
                with pytest.raises(LookupError):
                    bench.kill("resource_manager")
        """
    )
    pytester.runpytest_inprocess("-p", "no:cacheprovider").assert_outcomes(passed=2)


def test_a_fixture_is_called_like_its_class(skill_test: Callable[..., SkillTest]) -> None:
    skill_test(LIFTER, Lift, **READY).start(height=99.0).assert_ended("NV")


STATES = ("A", "B", "C", "D", "E")
EDGES = st.lists(st.builds(Transition, st.sampled_from(STATES), st.sampled_from(STATES), st.booleans()), max_size=12)


@given(edges=EDGES, source=st.sampled_from(STATES), target=st.sampled_from(STATES))
def test_a_way_is_made_of_extern_transitions_and_none_is_shorter(
    edges: list[Transition], source: str, target: str
) -> None:
    resource = Resource("r", STATES, "A", tuple(edges))
    reached, rounds = {source}, 0
    while target not in reached:
        further = reached | {edge.target for edge in edges if edge.extern and edge.source in reached}
        if further == reached:
            assert extern_way(resource, source, target) is None
            return
        reached, rounds = further, rounds + 1
    way = extern_way(resource, source, target)
    assert way is not None
    assert len(way) == rounds
    assert all(resource.allows(here, there, extern=True) for here, there in zip((source, *way), way, strict=False))
