"""The table of the M600 names what exists."""

from __future__ import annotations

import json

import pytest

from skillwing.bt_missions.library import find_mission
from skillwing.dsl import UnknownNameError
from skillwing.m600.robot import OF_THE_RUN, OPTIONS, ROBOT, SHARING
from skillwing.services.errors import InvalidOptionError
from skillwing.services.managers.hooks import SkillHooks
from skillwing.services.options import imported
from skillwing.services.recording.options import RecorderOptions
from skillwing.services.robot import ProcessSpec, find_robot
from skillwing.sim_mujoco.world.kinds import KINDS

SKILLSET = ROBOT.load_skillset()
RUN = {"seed": 3, "speed": 2.0, "faults": [{"sensor": "zed", "kind": "blackout", "at": 60.0}], "run_dir": "/tmp/x"}
PROCESSES = (*ROBOT.functional_layer(RUN), *ROBOT.managers(), *ROBOT.observers(RUN))


def test_is_installed_under_its_name() -> None:
    assert find_robot("m600") is ROBOT


@pytest.mark.parametrize("spec", PROCESSES, ids=lambda spec: spec.name)
def test_every_process_has_a_factory_and_options_that_survive_json(spec: ProcessSpec) -> None:
    assert callable(imported({"factory": spec.factory}, "factory"))
    assert json.loads(json.dumps(spec.options)) == spec.options


def test_every_skill_has_a_manager() -> None:
    assert {skill.name for skill in SKILLSET.skills} == set(ROBOT.hooks)


def test_what_publishes_data_are_skills_and_data_of_the_skillset() -> None:
    assert set(ROBOT.published_by) <= {item.name for item in SKILLSET.data}
    assert {skill for skills in ROBOT.published_by.values() for skill in skills} <= set(ROBOT.hooks)


@pytest.mark.parametrize("skill", sorted(ROBOT.hooks))
def test_the_hooks_are_those_of_their_skill(skill: str) -> None:
    hooks = imported({"hooks": ROBOT.hooks[skill]}, "hooks")
    assert issubclass(hooks, SkillHooks)
    assert hooks.skill == skill


def test_the_simulator_gets_the_run_it_was_asked_for() -> None:
    (sim,) = (spec for spec in PROCESSES if spec.name == "sim")
    assert sim.options == {"seed": 3, "factor": 2.0, "faults": RUN["faults"]}


def test_who_knows_the_site_gets_the_one_that_is_simulated_and_what_is_said_of_it_counts_first() -> None:
    run = {"seed": 3, "world": "village"}
    site = {"site": {"seed": 3, "kind": "village"}}
    told = {spec.name: spec.options for spec in ROBOT.functional_layer(run)}
    assert (told["sim"], told["guidance"], told["mapping"]) == ({"seed": 3, "world": "village"}, site, site)
    fence = {"low": [0.0, 0.0, 0.0], "high": [9.0, 9.0, 9.0]}
    told = {spec.name: spec.options for spec in ROBOT.functional_layer(run | {"fence": fence, "bounds": fence})}
    assert (told["guidance"], told["mapping"]) == (site | {"geofence": fence}, site | fence)
    assert told["sim"] == {"seed": 3, "world": "village", "geofence": fence}


@pytest.mark.parametrize("option", OF_THE_RUN)
def test_options_of_the_run_are_valid_and_reach_no_process_of_the_functional_layer(option: str) -> None:
    assert ROBOT.functional_layer({option: "something"}) == ROBOT.functional_layer({})


@pytest.mark.parametrize("option", sorted(set(OPTIONS) - set(OF_THE_RUN) - {"bounds", "link", *SHARING}))
def test_every_option_reaches_a_process(option: str) -> None:
    given_options = [spec.options for spec in ROBOT.functional_layer({option: "something"})]
    assert any("something" in options.values() for options in given_options)


def test_an_option_that_no_process_takes_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="no option `turbulense` of `m600`; did you mean `turbulence`"):
        ROBOT.functional_layer({"seed": 3, "turbulense": 3.0})


@pytest.mark.parametrize("kind", KINDS)
def test_missions_get_the_facts_of_the_chosen_world(kind: str) -> None:
    told = ROBOT.mission_options({"seed": 3, "world": kind})
    assert set(told) == ({"mapping", "inspection"} if kind == "inspection" else {"mapping"})
    for mission, options in told.items():
        find_mission(mission).read_options(options)


def test_without_a_choice_missions_know_the_courtyard_and_an_unknown_world_is_refused() -> None:
    assert ROBOT.mission_options({"seed": 3}) == {}
    known, told = find_mission("mapping"), ROBOT.mission_options({"world": "courtyard"})
    assert known.read_options(told["mapping"]) == known.read_options({})
    with pytest.raises(InvalidOptionError, match="known are courtyard"):
        ROBOT.mission_options({"world": "moon"})


@pytest.mark.parametrize(
    ("asked", "viewer"),
    [({}, "none"), ({"viewer": "spawn"}, "spawn"), ({"viewer_url": "rerun+http://host:9876/proxy"}, "connect")],
)
def test_the_recorder_shows_the_run_where_it_was_asked_to(asked: dict[str, str], viewer: str) -> None:
    (recorder,) = ROBOT.observers({"run_dir": "/tmp/x", **asked})
    assert RecorderOptions(**recorder.options).viewer == viewer


def test_without_a_run_directory_nobody_looks_on() -> None:
    assert ROBOT.observers({"seed": 3}) == ()
