"""A skill whose body is a tree over other skills, on the real managers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from skillwing.bt_missions.tree_skill.checks import ring_through, tree_skill_problems
from skillwing.bt_missions.tree_skill.hooks import TreeHooks
from skillwing.bt_missions.xml.document import TreeFileError
from skillwing.bt_missions.xml.tree_file import read_tree_file
from skillwing.dsl import parse
from skillwing.services.errors import InvalidOptionError
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.protocol import State
from skillwing.services.testing import SkillsetInProcess

TEXT = """
skillset forklift {
    type Pose { x: float64 [m]  y: float64 [m] }
    resource wheels { initial PARKED  PARKED -> DRIVING  DRIVING -> PARKED }
    resource fork { initial IDLE  IDLE -> MOVING  MOVING -> IDLE  IDLE -> RESERVED  RESERVED -> IDLE }
    skill drive {
        input { target: Pose }
        effect { roll: wheels -> DRIVING  park: wheels -> PARKED }
        precondition { parked: resource=(wheels == PARKED)  success roll }
        interrupt { apply=park }
        lost { apply=park }
        result { success ARRIVED: apply=park  failure BLOCKED: apply=park }
    }
    skill pick {
        effect { move: fork -> MOVING  still: fork -> IDLE }
        precondition { free: resource=(fork == IDLE)  success move }
        interrupt { apply=still }
        lost { apply=still }
        result { success LIFTED: apply=still  failure MISSED: apply=still }
    }
    skill fetch {
        progress=0.5 { rack: Pose }
        input { rack: Pose }
        output { rack: Pose }
        result { success FETCHED  failure LEFT }
    }
    skill greedy {
        effect { reserve: fork -> RESERVED  free: fork -> IDLE }
        precondition { free: resource=(fork == IDLE)  success reserve }
        result { success DONE: apply=free }
    }
}
"""
FORKLIFT = parse(TEXT, "forklift.skillset")
FETCH = """<root BTCPP_format="4" main_tree_to_execute="fetch">
  <BehaviorTree ID="fetch">
    <Sequence name="fetch">
      <drive target="{rack}"/>
      <pick/>
      <drive name="back" target="0,0"/>
    </Sequence>
  </BehaviorTree>
</root>
"""
RACK = {"x": 5.0, "y": 2.0}


class Pose(msgspec.Struct, frozen=True):
    x: float
    y: float


class FetchInputs(msgspec.Struct, frozen=True):
    rack: Pose


@pytest.fixture
def fetch(tmp_path: Path) -> type[TreeHooks]:
    (tmp_path / "forklift.skillset").write_text(TEXT)
    (tmp_path / "fetch.xml").write_text(FETCH)

    class FetchManager(TreeHooks):
        skill = "fetch"
        Inputs = Outputs = Feedback = FetchInputs
        skillset_file = tmp_path / "forklift.skillset"
        tree_file = tmp_path / "fetch.xml"

    return FetchManager


def forklift(fetch: type[TreeHooks], **runs: MockRun) -> SkillsetInProcess:
    return SkillsetInProcess(FORKLIFT, [fetch], script=MockScript(skills={name: (run,) for name, run in runs.items()}))


def test_the_skill_runs_its_tree_and_ends_with_its_first_success(fetch: type[TreeHooks]) -> None:
    robot = forklift(fetch)
    goal = robot.start_skill("fetch", rack=RACK)
    robot.run(0.6)
    assert goal.progress == FetchInputs(Pose(5.0, 2.0))
    robot.assert_states(wheels="DRIVING")
    goal.assert_ended("S_FETCHED", within=10.0)
    assert goal.terminal.output == {"rack": RACK}
    robot.assert_states(wheels="PARKED", fork="IDLE")


def test_a_failure_of_the_tree_is_a_failure_of_the_skill(fetch: type[TreeHooks]) -> None:
    robot = forklift(fetch, pick=MockRun(result="MISSED"))
    goal = robot.start_skill("fetch", rack=RACK)
    goal.assert_ended("S_LEFT", within=10.0)
    assert goal.terminal.reason == "The skill ended with LEFT: pick ended S_MISSED: The skill ended with MISSED."


def test_an_interrupt_halts_the_tree_and_waits_for_its_skills(fetch: type[TreeHooks]) -> None:
    robot = forklift(fetch, drive=MockRun(delay=60.0, stop_delay=2.0))
    goal = robot.start_skill("fetch", rack=RACK)
    robot.run(1.0)
    goal.interrupt()
    robot.run(1.0)
    assert goal.state is State.INTERRUPTING, "its drive brakes"
    robot.assert_states(wheels="DRIVING")
    goal.assert_ended("IT", within=3.0)
    robot.assert_states(wheels="PARKED")
    assert "fetch interrupted it.  <- fetch INTERRUPTING" in robot.story()
    robot.start_skill("fetch", rack=RACK)
    robot.run(1.0)
    robot.assert_states(wheels="DRIVING")


def test_goals_of_a_skill_end_with_its_manager(fetch: type[TreeHooks]) -> None:
    robot = forklift(fetch, drive=MockRun(delay=60.0))
    robot.start_skill("fetch", rack=RACK)
    robot.run(1.0)
    robot.close()


def test_a_tree_that_does_not_fit_is_refused_with_all_problems(fetch: type[TreeHooks]) -> None:
    fetch.tree_file.write_text(FETCH.replace("{rack}", "{rak}").replace("<pick/>", "<pik/>"))
    with pytest.raises(TreeFileError) as caught:
        forklift(fetch)
    assert [problem.text.partition(";")[0] for problem in caught.value.problems] == [
        "`target` reads `{rak}`, which nothing fills",
        "There is no node `pik`",
    ]


@pytest.mark.parametrize(
    ("success", "failure", "problem"),
    [
        ("NOPE", None, "`success` of `FetchManager` is `NOPE`, which is no success of `fetch`; there is `FETCHED`."),
        ("FETCHD", None, "`success` of `FetchManager` is `FETCHD`, which is no success of `fetch`; did you mean `FETC"),
        ("LEFT", "LEFT", "`success` of `FetchManager` is `LEFT`, which is no success of `fetch`; there is `FETCHED`."),
        (None, "FETCHED", "`failure` of `FetchManager` is `FETCHED`, which is no failure of `fetch`; there is `LEFT`."),
    ],
)
def test_a_result_that_the_skill_does_not_have_is_refused_before_a_goal(
    fetch: type[TreeHooks], success: str | None, failure: str | None, problem: str
) -> None:
    fetch.success, fetch.failure = success, failure
    with pytest.raises(InvalidOptionError) as caught:
        forklift(fetch)
    assert str(caught.value).startswith(problem)


def test_a_named_result_ends_the_goal(fetch: type[TreeHooks]) -> None:
    fetch.success, fetch.failure = "FETCHED", "LEFT"
    forklift(fetch).start_skill("fetch", rack=RACK).assert_ended("S_FETCHED", within=10.0)


def problems(folder: Path, tree: str, skill: str) -> list[str]:
    file = folder / "tree.xml"
    file.write_text(FETCH.replace("<pick/>", tree))
    return [problem.text for problem in tree_skill_problems(read_tree_file(file), FORKLIFT, skill)]


def test_a_tree_must_not_start_its_own_skill(tmp_path: Path) -> None:
    (text,) = problems(tmp_path, '<fetch rack="1,1"/>', "fetch")
    assert text == "Leaf `fetch`: the tree of `fetch` starts `fetch` itself, which is busy. Remove it."


def test_a_resource_that_the_skill_holds_cannot_be_taken_by_its_tree(tmp_path: Path) -> None:
    found = problems(tmp_path, "<pick/>", "greedy")
    assert "Leaf `pick`: `greedy` holds `fork` already, which `pick` takes. Let only one of them take it." in found


def test_a_ring_of_trees_is_found(tmp_path: Path) -> None:
    def tree(leaf: str) -> Any:
        file = tmp_path / f"{len(list(tmp_path.iterdir()))}.xml"
        file.write_text(FETCH.replace("<pick/>", leaf))
        return read_tree_file(file)

    ring = ring_through("fetch", {"fetch": tree("<greedy/>"), "greedy": tree('<fetch rack="1,1"/>')}, FORKLIFT)
    assert ring == ["fetch", "greedy", "fetch"]
    assert ring_through("fetch", {"fetch": tree("<greedy/>"), "greedy": tree("<pick/>")}, FORKLIFT) == []
