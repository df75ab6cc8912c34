"""The table of the M600 names what exists."""

from __future__ import annotations

import json

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.options import imported
from skillwing.services.robot import ProcessSpec, find_robot
from skillwing.services.telemetry.recorder_options import RecorderOptions

SKILLSET = ROBOT.load_skillset()
OPTIONS = {"seed": 3, "speed": 2.0, "faults": [{"sensor": "zed", "kind": "blackout", "at": 60.0}], "run_dir": "/tmp/x"}
PROCESSES = (*ROBOT.functional_layer(OPTIONS), *ROBOT.managers(), *ROBOT.observers(OPTIONS))


def test_is_installed_under_its_name() -> None:
    assert find_robot("m600") is ROBOT


@pytest.mark.parametrize("spec", PROCESSES, ids=lambda spec: spec.name)
def test_every_process_has_a_factory_and_options_that_survive_json(spec: ProcessSpec) -> None:
    assert callable(imported({"factory": spec.factory}, "factory"))
    assert json.loads(json.dumps(spec.options)) == spec.options


def test_every_skill_has_a_manager() -> None:
    assert {skill.name for skill in SKILLSET.skills} == set(ROBOT.hooks)


@pytest.mark.parametrize("skill", sorted(ROBOT.hooks))
def test_the_hooks_are_those_of_their_skill(skill: str) -> None:
    hooks = imported({"hooks": ROBOT.hooks[skill]}, "hooks")
    assert issubclass(hooks, SkillHooks)
    assert hooks.skill == skill


def test_the_simulator_gets_the_run_it_was_asked_for() -> None:
    (sim,) = (spec for spec in PROCESSES if spec.name == "sim")
    assert sim.options == {"seed": 3, "factor": 2.0, "faults": OPTIONS["faults"]}


@pytest.mark.parametrize(
    ("asked", "viewer"),
    [({}, "none"), ({"viewer": "spawn"}, "spawn"), ({"viewer_url": "rerun+http://host:9876/proxy"}, "connect")],
)
def test_the_recorder_shows_the_run_where_it_was_asked_to(asked: dict[str, str], viewer: str) -> None:
    (recorder,) = ROBOT.observers({"run_dir": "/tmp/x", **asked})
    assert RecorderOptions(**recorder.options).viewer == viewer


def test_without_a_run_directory_nobody_looks_on() -> None:
    assert ROBOT.observers({"seed": 3}) == ()
