"""A mission that may end in the air is reported before its flight."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Failure, Success
from py_trees.decorators import FailureIsSuccess, Inverter, Repeat, Retry, SuccessIsFailure, SuccessIsRunning

from skillwing.bt_missions.checking.mission_check import offline_context
from skillwing.bt_missions.checking.rescue_check import rescue_problems
from skillwing.bt_missions.drone.flight import land_where_it_is, or_pause, rescue, unless_the_pilot_flies
from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.placeholder import PlaceholderNode
from skillwing.bt_missions.leaves.readings import LatestReading
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.subtrees.composites import OnEnding, alongside, first_that_works, guarded, in_order
from skillwing.bt_missions.subtrees.decorators import Deadline, Delay, RepeatUntil, RunOnce
from skillwing.bt_missions.subtrees.flow_control import IfThenElse, SequenceWithMemory, ValueSwitch
from skillwing.dsl import parse
from skillwing.m600.robot import ROBOT
from skillwing.services.rescue_goal import RescueGoal

M600 = ROBOT.load_skillset()
assert ROBOT.rescue_goal is not None
GROUND = ROBOT.rescue_goal
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


def battery() -> LatestReading:
    return LatestReading(DRONE, "battery")


def problems(tree: Behaviour, safe: Behaviour | None = None) -> list[str]:
    return [text for _, text in rescue_problems(tree, safe or rescue(DRONE), M600, GROUND)]


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
        handled(SequenceWithMemory("by steps", [skill("takeoff"), skill("goto"), skill("land")])),
        ValueSwitch("by battery", "1", ("1",), [handled(flight(skill("land"))), skill("stream")]),
        IfThenElse("if up", flight(skill("goto")), land_where_it_is(DRONE), land_where_it_is(DRONE)),
        handled(flight(RunOnce("once", skill("goto")), Delay("later", DRONE, 2.0, skill("land")))),
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
        (IfThenElse("if up", flight(), skill("land")), "when `takeoff` fails"),
        (IfThenElse("if up", flight(), skill("land"), skill("hover")), "after `hover`"),
        (ValueSwitch("by value", "1", ("1",), [flight(), Success("well")]), "after `takeoff`"),
        # The battery falls in the flight: the other child takes over there.
        (ValueSwitch("by value", battery(), ("1",), [handled(flight(skill("land"))), Success("well")]), "after `well`"),
        # In the second round, only the third step is run.
        (
            Retry("again", SequenceWithMemory("by steps", [skill("takeoff"), skill("goto"), Failure("ill")]), 2),
            "when one of `takeoff`, `goto` and `ill` fails",
        ),
        (
            Repeat("twice", handled(flight(RunOnce("once", skill("land")))), 2),
            "after `once`",
        ),
        (Delay("later", DRONE, 9.0, flight(skill("land"))), "when `takeoff` fails"),
    ],
    ids=lambda each: each.name if isinstance(each, Behaviour) else "",
)
def test_a_mission_that_may_end_in_the_air_is_reported_with_the_reason(tree: Behaviour, makers: str) -> None:
    assert any(f"The mission may end in the air {makers}." in problem for problem in problems(tree)), problems(tree)


def test_a_rescue_has_to_land_whatever_fails_of_it() -> None:
    tree = handled(flight(skill("land")))
    assert problems(tree, Success("safe")) == ["The rescue may end in the air after `safe`. Let it run `land`."]
    slow = in_order("first home", skill("return_home"), land_where_it_is(DRONE))
    assert "when `return_home` fails" in problems(tree, slow)[0]
    assert problems(tree, PlaceholderNode("rescue")) == []
    assert problems(in_order("ground", skill("stream")), Success("safe")) == [], "it is never needed in the air"


CRANE = parse(
    """
    skillset crane {
        resource load { initial LOWERED  extern LOWERED -> RAISED  extern RAISED -> SWINGING  extern SWINGING -> RAISED
                        extern RAISED -> LOWERED }
        skill lift { precondition { low: resource=(load == LOWERED) } result { success UP } }
        skill swing { precondition { high: resource=(load != LOWERED) } result { success DONE } }
        skill lower { result { success DOWN } }
        skill carry { input { to: int32  by: int32  slowly: bool = true } result { success DOWN } }
    }
    """,
    "crane.skillset",
)
LOWERED = RescueGoal(
    resource="load",
    state="LOWERED",
    away={"RAISED": "under load", "SWINGING": "swinging"},
    skill="lower",
    left_by=("lift",),
    reached="without load",
    action="lowering",
)
YARD = offline_context(CRANE)


def crane(*skills: str, safe: Behaviour | None = None) -> list[str]:
    tree = in_order("lift it", *(SkillAction(name, YARD, name) for name in skills))
    return [text for _, text in rescue_problems(tree, safe, CRANE, LOWERED)]


def test_another_robot_is_asked_in_its_own_words() -> None:
    assert crane("lift", "swing", safe=SkillAction("lower", YARD, "lower")) == [
        "The mission may end under load or swinging when one of `lift` and `swing` fails. "
        "Put it into a Fallback that runs `lower` then.",
        "The mission may end under load or swinging after `swing`. Let it run `lower`.",
    ]
    assert crane("lower") == []


def test_a_mission_that_leaves_the_rescue_goal_needs_a_rescue() -> None:
    (text,) = (each for each in crane("lift", "lower") if "rescue" in each)
    assert text == (
        "The mission has no rescue, and `lift` brings the robot away from its rescue goal (`load` LOWERED). "
        "Add a tree `rescue`, which runs when somebody aborts."
    )


@pytest.mark.parametrize(("states", "ends"), [(("RAISED",), 2), (("RAISED", "SWINGING"), 1), (("LOWERED",), 1)])
def test_a_condition_decides_by_the_place_only_if_it_names_all_states_away(states: tuple[str, ...], ends: int) -> None:
    asked = in_order("up", SkillAction("lift", YARD, "lift"), ResourceIs("where?", YARD, "load", *states))
    found = [text for _, text in rescue_problems(asked, None, CRANE, LOWERED)]
    assert sum("`where?`" in text for text in found) == ends, found


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"resource": "lode"}, "There is no resource `lode`"),
        ({"skill": "drop"}, "There is no skill `drop`"),
        ({"left_by": ("lifft",)}, "There is no skill `lifft`; did you mean `lift`?"),
        ({"away": {"UP": "up"}}, "There is no state `UP` of `load`"),
        ({"skill": "carry"}, "`carry` cannot be a rescue, because it needs its inputs `to` and `by`."),
        ({}, None),
    ],
)
def test_a_goal_that_the_skillset_does_not_have_is_a_problem(changed: dict[str, Any], problem: str | None) -> None:
    found = list(msgspec.structs.replace(LOWERED, **changed).problems(CRANE))
    assert len(found) == (problem is not None)
    assert problem is None or found[0].startswith(problem[:20]), found


def test_the_goal_of_the_m600_fits_its_skillset() -> None:
    assert list(GROUND.problems(M600)) == []


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
        st.builds(lambda tree: Repeat("again", tree, 2), below),
        st.builds(lambda tree: Delay("later", DRONE, 9.0, tree), below),
        st.builds(lambda tree: RunOnce("once", tree), below),
        st.builds(lambda some: SequenceWithMemory("from there", some), many),
        st.builds(lambda *three: IfThenElse("choice", *three), below, below, below),
        st.builds(lambda one, other: ValueSwitch("by value", battery(), ("1",), [one, other]), below, below),
    )


@given(st.recursive(LEAVES, _grown, max_leaves=8))
def test_whatever_a_mission_does_a_landing_in_the_end_settles_it(tree: Behaviour) -> None:
    tried = FailureIsSuccess("tried", tree)
    assert problems(in_order("at last", tried, land_where_it_is(DRONE))) == []


@pytest.mark.parametrize(("state", "may"), [("AVAILABLE", True), ("UNAVAILABLE", False), (None, False)])
def test_who_has_not_the_authority_cannot_land(state: str | None, may: bool) -> None:
    assert GROUND.is_possible(M600, {} if state is None else {"SDK_authority": state}) is may
