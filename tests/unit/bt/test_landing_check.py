"""A mission that may end in the air is reported before its flight."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.decorators import FailureIsSuccess, Inverter, Repeat, Retry, SuccessIsFailure, SuccessIsRunning

from skillwing.bt_missions.checking.landing_check import landing_problems
from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.drone.flight import land_where_it_is, or_pause, rescue, unless_the_pilot_flies
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.placeholder import PlaceholderNode
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.leaves.takeoff_and_landing import may_land
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, guarded, in_order
from skillwing.bt_missions.subtrees.decorators import Deadline, RepeatUntil
from skillwing.dsl import load, parse

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
M600 = load(ROOT / "services/skillwing/m600/m600.skillset")
DRONE = offline_context(M600)


def skill(name: str) -> SkillAction:
    return SkillAction(name, DRONE, name)


def flight(*then: Behaviour) -> Behaviour:
    return in_order("flight", skill("takeoff"), *then)


def handled(tree: Behaviour) -> Behaviour:
    return first_that_works("or land", tree, SuccessIsFailure("not done", land_where_it_is(DRONE)))


def charged() -> Behaviour:
    return ResourceIs("charged?", DRONE, "battery_status", "NORMAL")


def granted() -> Behaviour:
    return ResourceIs("granted?", DRONE, "SDK_authority", "AVAILABLE")


def problems(tree: Behaviour, safe: Behaviour | None = None) -> list[str]:
    return [text for _, text in landing_problems(tree, safe or rescue(DRONE), M600)]


@pytest.mark.parametrize(
    "tree",
    [
        handled(flight(skill("goto"), skill("land"))),
        handled(guarded("flight", charged(), flight(skill("land")))),
        guarded("all", granted(), handled(flight(skill("goto"), skill("land")))),
        handled(flight(alongside("see", skill("lidar_depthmap"), until=skill("goto")), skill("land"))),
        handled(Deadline("in time", DRONE, 9.0, flight(or_pause(DRONE, skill("goto")), skill("land")))),
        unless_the_pilot_flies(DRONE, 9.0, handled(flight(skill("land")))),
        handled(
            flight(
                RepeatUntil("rounds", lambda: True, skill("goto")), Repeat("thrice", skill("hover"), 3), skill("land")
            )
        ),
        in_order("on the ground", skill("stream"), Failure("ill")),
        # Who lands when the drone is not on the ground needs no other way down.
        in_order("up and down", FailureIsSuccess("tried", flight(skill("goto"))), land_where_it_is(DRONE)),
        # It may have been the landing: what cannot be read is told of elsewhere.
        handled(flight(PlaceholderNode("lnd"))),
    ],
    ids=lambda tree: tree.name,
)
def test_a_mission_that_always_lands_has_no_problem(tree: Behaviour) -> None:
    assert problems(tree) == []


@pytest.mark.parametrize(
    ("tree", "makers"),
    [
        (flight(skill("goto"), skill("land")), "when one of `takeoff` and `goto` fails"),
        (handled(flight(skill("goto"))), "after `goto`"),
        (flight(skill("goto")), "after `goto`"),
        (guarded("all", charged(), handled(flight(skill("land")))), "when `charged?` fails"),
        (Deadline("in time", DRONE, 9.0, handled(flight(skill("land")))), "when `in time` fails"),
        (alongside("see", skill("stream"), until=handled(flight(skill("land")))), "when `stream` fails"),
        (first_that_works("or wait", flight(skill("land")), skill("hover")), "after `hover`"),
        (Inverter("not", in_order("up", FailureIsSuccess("tried", flight()))), "when `takeoff` fails"),
        (handled(flight(Retry("again", skill("goto"), 3), Success("well"))), "after `well`"),
        (flight(SuccessIsRunning("for ever", skill("hover"))), "when one of `takeoff` and `hover` fails"),
        (OnEnding("or", flight(skill("land")), ("NR",), skill("hover")), "when one of `takeoff` and `hover` fails"),
        (or_pause(DRONE, flight(skill("land"))), "when `takeoff` fails"),
        (flight(PlaceholderNode("lnd")), "when `takeoff` fails"),
    ],
    ids=lambda each: each.name if isinstance(each, Behaviour) else "",
)
def test_a_mission_that_may_end_in_the_air_is_reported_with_the_reason(tree: Behaviour, makers: str) -> None:
    assert any(f"The mission may end in the air {makers}." in problem for problem in problems(tree)), problems(tree)


def test_a_rescue_has_to_land_whatever_fails_of_it() -> None:
    tree = handled(flight(skill("land")))
    assert problems(tree, Success("safe")) == ["The rescue may end in the air after `safe`. Let it land the drone."]
    slow = in_order("first home", skill("return_home"), land_where_it_is(DRONE))
    assert "when `return_home` fails" in problems(tree, slow)[0]
    assert problems(tree, PlaceholderNode("rescue")) == []
    assert problems(in_order("ground", skill("stream")), Success("safe")) == [], "it is never needed in the air"


def test_a_robot_that_does_not_fly_is_not_asked() -> None:
    rover = parse("skillset rover { skill takeoff { result { DONE: } } }", "rover.skillset")
    leaf = SkillAction("takeoff", offline_context(rover), "takeoff")
    assert list(landing_problems(leaf, Success("safe"), rover)) == []


SKILLS = st.builds(skill, st.sampled_from(["takeoff", "land", "goto", "hover", "stream"]))
LEAVES = st.one_of(SKILLS, SKILLS, st.builds(charged), st.builds(granted), st.builds(lambda: Failure("ill")))


def _grown(below: st.SearchStrategy[Behaviour]) -> st.SearchStrategy[Behaviour]:
    many = st.lists(below, min_size=1, max_size=3)
    kinds: list[Callable[..., Behaviour]] = [in_order, first_that_works]
    return st.one_of(
        st.builds(lambda make, some: make("some", *some), st.sampled_from(kinds), many),
        st.builds(lambda guard, tree: guarded("guarded", guard, tree), below, below),
        st.builds(lambda one, until: alongside("beside", one, until=until), below, below),
        st.builds(lambda tree: Deadline("in time", DRONE, 9.0, tree), below),
        st.builds(lambda kind, tree: kind("turned", tree), st.sampled_from([Inverter, FailureIsSuccess]), below),
        st.builds(lambda tree: Retry("again", tree, 2), below),
    )


@given(st.recursive(LEAVES, _grown, max_leaves=8))
def test_whatever_a_mission_does_a_landing_in_the_end_settles_it(tree: Behaviour) -> None:
    tried = FailureIsSuccess("tried", tree)
    assert problems(in_order("at last", tried, land_where_it_is(DRONE))) == []


@pytest.mark.parametrize(("state", "may"), [("AVAILABLE", True), ("UNAVAILABLE", False), (None, False)])
def test_who_has_not_the_authority_cannot_land(state: str | None, may: bool) -> None:
    assert may_land(M600, {} if state is None else {"SDK_authority": state}) is may
