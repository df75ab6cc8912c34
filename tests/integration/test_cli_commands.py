"""The commands against a running system of real processes, whose skills are mocked."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import psutil
import pytest
from command_line import Command

from skillwing.bt_missions.library import find_mission
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Sample
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.history.files import read_records
from skillwing.services.mocking.system import mock_processes
from skillwing.services.processes.launcher import Launcher
from skillwing.services.processes.run_state import announced, read_run_state, write_run_state
from skillwing.services.protocol import FireExtern, Keys, ResourceStep, decode, encode
from skillwing.services.recording.recorder import RECORDING_FILE
from skillwing.services.terminal.connection import connect
from skillwing.services.terminal.exit_codes import FAILED, NO_SYSTEM, OK, REFUSED, USAGE

pytestmark = pytest.mark.slow

RUNNING = {"data_manager", "resource_manager", "skill/takeoff", "skill/goto", "skill/lidar_mapping"}
PATIENCE = 60.0


@pytest.fixture(scope="module")
def system(runtime: Path) -> Iterator[Launcher]:
    (script := runtime / "short.mock.toml").write_text("[skill.goto]\ndelay = 0.1\n", encoding="utf-8")
    specs = [spec for spec in mock_processes(ROBOT, scripts=(script,)) if spec.name in RUNNING]
    with Launcher("m600", "m600", runtime / "run", clock="wall") as launcher:
        launcher.start(specs)
        with announced(ROBOT, launcher.endpoint, launcher.run_dir, clock="wall", mock=True):
            yield launcher


@pytest.fixture
def ready(system: Launcher, skillwing: Command) -> Command:
    """Command line of a robot with authority and a home point, on the ground, with no running goal."""
    skillwing("interrupt", "lidar_mapping")
    transitions = {"SDK_authority": "AVAILABLE", "homepoint_status": "VALID", "flight_status": "ON_GROUND"}
    for resource, state in transitions.items():
        assert skillwing("trigger", resource, state).code == OK
    return skillwing


# --- goals -----------------------------------------------------------------------------------------------------------


def test_a_skill_is_started_and_followed_to_its_end(ready: Command) -> None:
    said = ready("start", "takeoff", "height=5", "speed=1", "--follow")
    assert said.code == OK
    assert "RUNNING" in said.out
    assert "S_AT_ALTITUDE" in said.out.splitlines()[-1]


def test_without_following_a_start_returns_once_the_skill_runs(ready: Command) -> None:
    said = ready("start", "takeoff", "height=5", "--json")
    assert said.code == OK
    assert said.json["state"] == "RUNNING"
    assert said.json["terminal"] is None
    goal = said.json["goal_id"]
    assert ready("start", "takeoff", "height=5").code == REFUSED
    followed = ready("interrupt", goal, "--json")
    assert followed.json["goal_id"] == goal
    assert followed.json["terminal"]["ending"] == "IT"
    assert followed.code == OK


def test_structures_are_typed_in_short(ready: Command) -> None:
    assert ready("trigger", "flight_status", "IN_AIR").code == OK
    assert ready("start", "goto", "target=10,5,4", "--follow").code == OK
    assert ready("start", "goto", "target.x=1", "target.y=2", "target.z=3", "--follow").code == OK


def test_a_running_goal_gets_new_inputs(ready: Command) -> None:
    assert ready("trigger", "flight_status", "IN_AIR").code == OK
    assert ready("script", "goto", "result=ARRIVED", "delay=60").code == OK
    assert ready("modify", "goto", "speed=1").code == FAILED
    assert ready("start", "goto", "target=10,5,4").code == OK
    said = ready("modify", "goto", "target=1,2,3", "speed=1", "--json")
    assert (said.code, said.json["revision"]) == (OK, 1)
    assert ready("modify", said.json["goal_id"], "speed=2").out.endswith("modification 2.\n")
    refused = ready("modify", "goto", "speed=99")
    assert refused.code == REFUSED
    assert "`speed` is 99 m/s" in refused.error
    assert ready("modify", "goto", "sped=1").code == USAGE
    assert ready("modify", "goto").code == USAGE
    assert ready("interrupt", "goto").code == OK
    assert ready("script", "goto", "--reset").code == OK


def test_out_of_range_is_refused_with_a_sentence(ready: Command) -> None:
    said = ready("start", "takeoff", "height=500", "speed=1")
    assert said.code == REFUSED
    assert "NV" in said.out
    assert "`height` is 500 m; it has to lie between 1 and 50 m." in said.out


def test_not_ready_names_every_failing_precondition(ready: Command) -> None:
    assert ready("trigger", "SDK_authority", "UNAVAILABLE").code == OK
    assert ready("trigger", "homepoint_status", "INVALID").code == OK
    said = ready("start", "takeoff")
    assert said.code == REFUSED
    assert "SDK_authority is UNAVAILABLE" in said.out
    assert "homepoint_status is INVALID" in said.out


def test_ready_says_what_is_missing_and_starts_nothing(ready: Command) -> None:
    assert ready("trigger", "SDK_authority", "UNAVAILABLE").code == OK
    said = ready("ready", "takeoff", "height=5")
    assert said.code == FAILED
    assert "takeoff is not ready." in said.out
    assert "SDK_authority is UNAVAILABLE" in said.out
    assert ready("trigger", "SDK_authority", "AVAILABLE").code == OK
    assert ready("ready", "takeoff", "height=5").out == "takeoff is ready.\n"
    assert ready("ready", "takeoff", "height=500").code == FAILED
    assert ready("ready", "takeoff", "height=high").code == USAGE
    assert ready("ready", "fly").code == USAGE
    answer = ready("ready", "takeoff", "--json").json
    assert [(each["skill"], each["ready"]) for each in answer["skills"]] == [("takeoff", True)]


def test_ready_without_a_skill_is_a_table_of_all(ready: Command) -> None:
    said = ready("ready")
    assert said.code == OK
    assert "takeoff" in said.out
    assert "No manager of it runs;" in next(line for line in said.out.splitlines() if line.startswith("hover"))


def test_a_skill_whose_manager_does_not_run_is_not_started(ready: Command) -> None:
    said = ready("start", "hover", "duration=1")
    assert said.code == FAILED
    assert "No manager of `hover` runs." in said.error


def test_an_invariant_ends_a_goal_that_is_followed(ready: Command, system: Launcher) -> None:
    assert ready("trigger", "lidar_status", "OK").code == OK
    command = [sys.executable, "-m", "skillwing.services.terminal.cli", "start", "lidar_mapping", "--follow"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert any("RUNNING" in line for line in process.stdout)
        assert ready("trigger", "lidar_status", "FAILED").code == OK
        assert process.wait(PATIENCE) == FAILED
        assert "RI" in process.stdout.read()


def test_ctrl_c_interrupts_the_goal_that_is_followed(ready: Command, system: Launcher) -> None:
    assert ready("trigger", "lidar_status", "OK").code == OK
    command = [sys.executable, "-m", "skillwing.services.terminal.cli", "start", "lidar_mapping", "--follow"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert any("RUNNING" in line for line in process.stdout)
        psutil.Process(process.pid).send_signal(2)
        assert process.wait(PATIENCE) == FAILED
        assert "IT" in process.stdout.read()
    goals = {goal["skill"]: goal for goal in ready("status", "--json").json["goals"]}
    assert goals["lidar_mapping"]["terminal"]["ending"] == "IT"


def test_interrupting_what_does_not_run_says_so(ready: Command) -> None:
    said = ready("interrupt", "goto")
    assert said.code == FAILED
    assert "No goal of `goto` is running." in said.error


# --- what the robot is doing -----------------------------------------------------------------------------------------


def test_status_shows_processes_goals_and_resources(ready: Command) -> None:
    status = ready("status", "--json").json
    assert {name for name, process in status["processes"].items() if process["state"] == "runs"} == RUNNING
    assert status["processes"]["skill/land"]["state"] == "down"
    assert status["resources"]["SDK_authority"] == "AVAILABLE"
    said = ready("status")
    assert said.code == FAILED, "some do not run"
    assert "skill/land" in said.out
    assert "SDK_authority" in said.out
    assert "in the air" not in said.out


def test_a_drone_left_in_the_air_is_reported(ready: Command) -> None:
    assert ready("trigger", "flight_status", "IN_AIR").code == OK
    assert "m600 is in the air, and nobody commands it. End that with `skillwing start land`" in ready("status").out
    left = ready("status", "--json").json["unattended"]
    assert (left["state"], left["ends_with"]) == ("IN_AIR", "land")
    found = {finding["about"]: finding for finding in ready("doctor", "--json").json["findings"]}
    assert "nobody commands it" in found["unattended"]["what"]


def test_resources_and_data(ready: Command) -> None:
    assert ready("resources", "--json").json["states"]["homepoint_status"] == "VALID"
    assert "homepoint_status" in ready("resources").out
    readings = ready("data", "--json").json
    assert {reading["name"] for reading in readings} == {item.name for item in ROBOT.load_skillset().data}
    battery = ready("data", "battery", "--json").json
    assert battery == {"name": "battery", "value": None, "t": None, "age": None, "stale": True}
    assert "never received" in ready("data", "battery").out


def test_a_transition_that_only_skills_may_take_is_refused(ready: Command) -> None:
    said = ready("trigger", "axes_authority", "USED")
    assert said.code == REFUSED
    assert "no extern transition" in said.error


def test_a_transition_that_the_robot_takes_back_is_no_success(ready: Command, system: Launcher) -> None:
    def put_back(sample: Sample) -> None:
        changes = decode(sample.payload, ResourceStep).changes
        if ("SDK_authority", "UNAVAILABLE") in [(change.subject, change.after) for change in changes]:
            report = FireExtern(resource="SDK_authority", target="AVAILABLE", source="bridge")
            bridge.ask(keys.resource_extern, encode(report), lambda answer: None)

    state = read_run_state("m600")
    assert state is not None
    keys = Keys("m600")
    bridge = ZenohBus("bridge", "m600", system.endpoint)
    bridge.subscribe(keys.resource_steps, put_back, events=True)
    over = threading.Event()
    robot = threading.Thread(target=bridge.run_until, args=(over.is_set,))
    robot.start()
    write_run_state(msgspec.structs.replace(state, mock=False))
    try:
        said = ready("trigger", "SDK_authority", "UNAVAILABLE")
        kept = ready("trigger", "homepoint_status", "INVALID")
    finally:
        write_run_state(state)
        over.set()
        bridge.post(lambda: None)
        robot.join()
        bridge.close()
    assert said.code == REFUSED
    assert "the robot reports AVAILABLE" in said.error
    assert said.out == ""
    assert kept.code == OK


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["start", "takeof"], "did you mean `takeoff`?"),
        (["start", "takeoff", "heigth=5"], "did you mean `height`?"),
        (["start", "takeoff", "height=abc"], "it takes a finite number"),
        (["start", "goto"], "`target` is missing"),
        (["data", "bateri"], "What exists: "),
        (["trigger", "SDK_autority", "AVAILABLE"], "did you mean `SDK_authority`?"),
        (["trigger", "SDK_authority", "GONE"], "`AVAILABLE`"),
        (["interrupt", "landd"], "did you mean `land`?"),
        (["up", "--robot", "m601"], "did you mean `m600`?"),
        (["strt"], "did you mean `start`?"),
    ],
)
def test_a_typing_error_is_answered_with_what_exists(ready: Command, words: list[str], sentence: str) -> None:
    said = ready(*words)
    assert said.code == USAGE
    assert sentence in said.error
    assert "Traceback" not in said.error


# --- missions ---------------------------------------------------------------------------------------------------------


def test_a_second_mission_is_refused_while_one_is_there(ready: Command, system: Launcher) -> None:
    """A mission that still waits for the robot counts too, as here. It counts no more when its process has ended."""
    assert ready("trigger", "SDK_authority", "UNAVAILABLE").code == OK
    mission = find_mission("mapping")
    first = MissionNode(mission, load(ROBOT.skillset), mission.read_options({}), rescue_goal=ROBOT.rescue_goal)
    bus = ZenohBus("first", "m600", system.endpoint)
    try:
        first.attach(bus)
        assert bus.run_until(lambda: "SDK_authority" in first.status.text, PATIENCE)
        said = ready("mission", "run", "inspection")
    finally:
        bus.close()
    assert said.code == REFUSED
    assert said.error.startswith("Mission mapping runs here already. Wait until it has ended, or abort it with ")
    deadline = time.monotonic() + PATIENCE
    with connect() as connection:
        while MissionNode.name in connection.alive():
            assert time.monotonic() < deadline


def test_without_a_launcher_no_mission_runs_on_board(ready: Command) -> None:
    said = ready("mission", "run", "mapping", "--on-board")
    assert said.code == FAILED
    assert said.error.startswith("No launcher of this robot runs missions. Start the robot with `skillwing up`")


# --- up and down -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["status", "resources", "ready", "data", "down"])
def test_without_a_system_commands_say_how_to_start_one(
    command: str, skillwing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    said = skillwing(command)
    assert said.code == NO_SYSTEM
    assert "skillwing up" in said.error


def test_up_and_down_leave_nothing_behind(skillwing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    said = skillwing("up", "--mock", "-dr", "m600", "--run-dir", str(tmp_path / "run"))
    assert said.code == OK, said.error
    state = read_run_state("m600")
    assert state is not None
    processes = psutil.Process(state.pid).children()
    assert len(processes) == len(mock_processes(ROBOT)) + 2  # and router and recorder
    shown = skillwing("status", "--json").json["processes"].values()
    assert {process["state"] for process in shown} == {"runs"}
    again = skillwing("up", "--mock")
    assert again.code == FAILED
    assert "runs already" in again.error
    assert skillwing("down").code == OK
    assert psutil.wait_procs(processes, timeout=PATIENCE)[1] == []
    assert read_run_state("m600") is None
    assert read_records(tmp_path / "run")
    assert (tmp_path / "run" / RECORDING_FILE).stat().st_size > 0
