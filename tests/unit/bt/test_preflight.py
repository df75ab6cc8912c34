"""All problems of a mission are listed before the flight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest
from fake_interface import SKILLSET, FakeMission
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success
from py_trees.common import Status
from py_trees.decorators import Repeat, Retry, SuccessIsRunning

from skillwing.bt_missions.checking.mission_check import require_fit
from skillwing.bt_missions.checking.preflight import preflight, tree_problems
from skillwing.bt_missions.leaves.conditions import DataCompare, ResourceIs, Sign
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees, Progress
from skillwing.bt_missions.mission.problems import FaultyMissionError
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.subtrees.composites import alongside, first_that_works, in_order
from skillwing.dsl.model import ArrayType, DataItem, EnumType, Field, ScalarType, StructType


def problems(*leaves: Behaviour) -> list[str]:
    return [found.text for found in tree_problems([in_order("tree", *leaves)], SKILLSET)]


def test_a_tree_that_fits_has_no_problem(mission: FakeMission) -> None:
    outcomes = {"S_ARRIVED": Status.SUCCESS, "S_BLOCKED": Status.SUCCESS, "N_BLOCKED": Status.FAILURE}
    assert not problems(
        SkillAction("go", mission.context, "go", {"speed": 2.0}, outcomes=outcomes),
        SkillAction("turn", mission.context, "turn", {"speed": lambda: 1.0}),
        ResourceIs("camera?", mission.context, "camera", "OK", "FAILED"),
    )


def test_all_problems_are_listed_at_once(mission: FakeMission) -> None:
    found = problems(
        SkillAction("a", mission.context, "gi"),
        SkillAction("b", mission.context, "go", {"sped": 1.0, "height": lambda: 3.0}),
        SkillAction("c", mission.context, "go", {"speed": 500.0}),
        SkillAction("d", mission.context, "go", outcomes={"S_ARIVED": Status.SUCCESS}),
        ResourceIs("e", mission.context, "camera", "BROKEN"),
        ResourceIs("f", mission.context, "kamera", "OK"),
        DataCompare("g", mission.context, "battery", ">", 1.0),
    )
    expected = {
        "a": ["no skill `gi`"],
        "b": ["sped", "height"],
        "c": ["speed"],
        "d": ["S_ARIVED", "S_BLOCKED, and the leaf"],
        "e": ["BROKEN"],
        "f": ["kamera"],
        "g": ["battery"],
    }
    for leaf, wanted in expected.items():
        about = [problem for problem in found if problem.startswith(f"Leaf `{leaf}`")]
        assert len(about) == len(wanted), about
        for part in wanted:
            assert any(part in problem for problem in about)


class Needy(Mission):
    name = "needy"
    summary = "Needs what there is not."
    needs = MappingProxyType({"camera": ("OK",), "axes": ("IDLE",), "wings": ("OUT",)})

    def build(self, context: MissionContext, options: MissionOptions) -> MissionTrees:
        return MissionTrees(Success("flown"), Success("safe"), Progress)


def test_the_needs_of_a_mission_are_checked_too_and_have_the_place_of_its_class(mission: FakeMission) -> None:
    needy = Needy()
    found = preflight(needy, needy.build(mission.context, MissionOptions()), mission.context)
    line = next(
        n for n, text in enumerate(Path(__file__).read_text().splitlines(), 1) if text.startswith("class Needy")
    )
    assert [(each.place, each.text.split("`")[1]) for each in found] == [
        (f"{__file__}:{line}", "IDLE"),
        (f"{__file__}:{line}", "wings"),
    ]


def test_a_branch_after_one_that_cannot_fail_is_never_reached(mission: FakeMission) -> None:
    go, turn = (SkillAction(skill, mission.context, skill) for skill in ("go", "turn"))
    found = problems(first_that_works("choose", in_order("always", Success("yes")), go, turn))
    assert found == ["Branch `go` of `choose` is never reached: `always` cannot fail."]


def test_a_step_after_one_that_cannot_succeed_is_never_reached(mission: FakeMission) -> None:
    look, go = (SkillAction(skill, mission.context, skill) for skill in ("look", "go"))
    assert problems(look, go) == ["Branch `go` of `tree` is never reached: `look` cannot succeed."]


def test_outcomes_decide_what_a_skill_can_end_with(mission: FakeMission) -> None:
    look = SkillAction("look", mission.context, "look", outcomes={"S_NO_DATA": Status.SUCCESS})
    assert not problems(look, SkillAction("go", mission.context, "go"))


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_resource_that_is_taken_twice_in_parallel_is_reported(mission: FakeMission, wrapped: bool) -> None:
    go, turn = (SkillAction(skill, mission.context, skill) for skill in ("go", "turn"))
    found = problems(alongside("both", go, until=in_order("later", turn) if wrapped else turn))
    assert found == ["Under `both` both `go` and `turn` take axes, at the same time."]


def test_a_skill_that_would_run_twice_at_once_is_reported(mission: FakeMission) -> None:
    one, other, go = (SkillAction(skill, mission.context, skill) for skill in ("look", "look", "go"))
    found = problems(alongside("both", one, in_order("later", other), until=go))
    assert found == ["Under `both` skill `look` would run twice at the same time; a second one is BUSY."]


@pytest.mark.parametrize(
    "endless", [Repeat("rounds", Success("well"), -1), SuccessIsRunning("rounds", Success("well"))]
)
def test_what_comes_after_an_endless_loop_is_never_reached(mission: FakeMission, endless: Behaviour) -> None:
    go = SkillAction("go", mission.context, "go")
    assert problems(endless, go) == ["Branch `go` of `tree` is never reached: `rounds` cannot succeed."]


def test_what_is_tried_again_can_succeed_only_if_it_can_at_once(mission: FakeMission) -> None:
    look, go = (SkillAction(skill, mission.context, skill) for skill in ("look", "go"))
    assert problems(Retry("again", look, 3), go) == ["Branch `go` of `tree` is never reached: `again` cannot succeed."]


MEASURED = replace(
    SKILLSET,
    data=(
        DataItem("position", StructType("Position", (Field("x", ScalarType("float64")),))),
        DataItem("mode", EnumType("Mode", ("SLOW", "FAST"))),
        DataItem("lit", ScalarType("bool")),
        DataItem("note", ScalarType("string")),
        DataItem("ranges", ArrayType(ScalarType("float64"), None)),
    ),
)


@pytest.mark.parametrize(
    ("datum", "sign", "value", "problem"),
    [
        ("position.x", "<", 3.0, None),
        ("position.x", "==", 3, None),
        ("mode", "==", "SLOW", None),
        ("lit", "!=", True, None),
        ("note", "==", "abc", None),
        ("position.q", ">", "abc", "There is no field `q` of `position`. What exists: `x`."),
        ("position.x", ">", "abc", "`position.x` is a number, and `abc` is none"),
        ("position.x", "==", True, "`position.x` is a number, and `True` is none"),
        ("position.x.y", "==", 1.0, "`position.x` is a finite number, and has no field `y`"),
        ("position", "==", 1.0, "`position` has the fields `x`; compare one of them"),
        ("mode", "==", "SLO", "`mode` is one of `SLOW` and `FAST`, and never `SLO`"),
        ("mode", "<", "FAST", "`mode` has no order; compare it by `==` or `!=`, not `<`"),
        ("lit", "==", "on", "`lit` is `true` or `false`, and never `on`"),
        ("note", "==", 1.0, "`note` is text, and `1.0` is none"),
        ("ranges", "==", 1.0, "`ranges` is a list, which cannot be compared"),
    ],
)
def test_a_comparison_fits_the_type_of_its_datum(
    mission: FakeMission, datum: str, sign: Sign, value: float | str | bool, problem: str | None
) -> None:
    leaf = DataCompare("far?", mission.context, datum, sign, value)
    assert [each.text for each in tree_problems([leaf], MEASURED)] == ([f"Leaf `far?`: {problem}"] if problem else [])


def test_skills_that_share_nothing_may_run_in_parallel(mission: FakeMission) -> None:
    look, go = (SkillAction(skill, mission.context, skill) for skill in ("look", "go"))
    assert not problems(alongside("both", look, until=go))


def test_a_mission_that_is_flown_on_another_robot_is_refused_with_both_names() -> None:
    with pytest.raises(FaultyMissionError) as refused:
        require_fit(MISSION, {"": RobotModel(SKILLSET)}, MISSION.read_options({}))
    first, *problems = str(refused.value).splitlines()
    assert first == f"Mission `mapping` does not fit `{SKILLSET.name}`, which is what runs here:"
    assert problems == [str(problem) for problem in refused.value.problems]
