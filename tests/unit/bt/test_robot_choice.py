"""Robot that a command of missions is about."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skillwing.bt_missions.cli.mission_robots import chosen_robots
from skillwing.bt_missions.cli.on_board import known_mission, make_request
from skillwing.bt_missions.cli.robot_choice import choose_robot
from skillwing.bt_missions.library import find_draft
from skillwing.services.client.connection import find_target
from skillwing.services.errors import InvalidOptionError, SeveralSystemsError
from skillwing.services.processes.run_state import RunState, started, write_run_state
from skillwing.services.robot import UnknownRobotError
from skillwing.services.terminal.cli import app

SKILLSET = "skillset rover { skill go { result { success DONE } } }"
TWO_ROBOTS = """<root BTCPP_format="4" main_tree_to_execute="both">
  <BehaviorTree ID="both">
    <Sequence>
      <go robot="drone"/>
      <go robot="second"/>
    </Sequence>
  </BehaviorTree>
  <TreeNodesModel>
    <SubTree ID="both"><MetadataFields><Metadata robots="drone second"/></MetadataFields></SubTree>
  </TreeNodesModel>
</root>
"""


@pytest.fixture
def two_rovers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two systems that run here, by their run states."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("SKILLWING_CONNECT", raising=False)
    file = tmp_path / "rover.skillset"
    file.write_text(SKILLSET, encoding="utf-8")
    for name in ("first", "second"):
        write_run_state(
            RunState(
                robot=name,
                endpoint="tcp/127.0.0.1:1",
                skillset=str(file),
                clock="wall",
                pid=os.getpid(),
                pid_started=started(os.getpid()) or "",
                run_dir=str(tmp_path),
            )
        )


@pytest.mark.usefixtures("two_rovers")
def test_of_several_systems_one_has_to_be_chosen_in_the_words_of_every_command() -> None:
    with pytest.raises(SeveralSystemsError) as by_others:
        find_target()
    with pytest.raises(SeveralSystemsError) as by_missions:
        choose_robot(None)
    assert str(by_missions.value) == str(by_others.value)
    assert choose_robot("second").skillset.name == "rover"


@pytest.mark.usefixtures("two_rovers")
def test_an_unknown_robot_is_answered_with_those_that_run_too() -> None:
    with pytest.raises(UnknownRobotError, match=r"did you mean `second`|`first`, `second`"):
        choose_robot("secnd")
    with pytest.raises(UnknownRobotError, match="`first`, `second`, `m600`"):
        choose_robot("zzz")


@pytest.mark.usefixtures("two_rovers")
def test_only_the_robots_of_a_mission_that_are_not_found_have_to_be_named(tmp_path: Path) -> None:
    file = tmp_path / "hop.xml"
    file.write_text(TWO_ROBOTS, encoding="utf-8")
    mission = find_draft(str(file))
    assert chosen_robots(mission, ["drone=first"], None).keys() == {"drone", "second"}
    with pytest.raises(InvalidOptionError) as refused:
        chosen_robots(mission, [], None)
    assert str(refused.value) == (
        "Mission `both` is for the robots `drone` and `second`. `drone` was not found. Name it: `--robot drone=NAME`."
    )


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["drone=first", "second=first"], "Robot `first` cannot be `drone` and `second` of the mission at once."),
        (["drone=first", "second"], "`--robot second` names none of `drone` and `second`. Only with --on-board"),
        (["first"], "Mission `both` is for the robots `drone` and `second`. Name them:"),
    ],
)
def test_robots_that_do_not_fit_the_words_are_refused(tmp_path: Path, words: list[str], sentence: str) -> None:
    file = tmp_path / "hop.xml"
    file.write_text(TWO_ROBOTS, encoding="utf-8")
    arguments = ["mission", "run", str(file), *(part for word in words for part in ("--robot", word))]
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, InvalidOptionError)
    assert str(result.exception).startswith(sentence)


def test_a_tree_file_runs_on_board_under_the_name_of_its_tree(tmp_path: Path) -> None:
    file = tmp_path / "hop.xml"
    file.write_text(TWO_ROBOTS, encoding="utf-8")
    request = make_request(str(file), {}, {}, "1", known_mission(str(file)))
    assert request.mission == "both"
    assert request.tree == TWO_ROBOTS
    assert make_request("mapping", {}, {}, "1", None).mission == "mapping"
