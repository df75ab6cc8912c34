"""Missions on board, with real processes: the command that has started one may end, and the mission goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from command_line import Command
from running_system import goal_runs, process_id, until

from skillwing.bt_missions.cli.watch import ask_latest_status
from skillwing.services.errors import RefusedError
from skillwing.services.history.files import read_records
from skillwing.services.history.history import History
from skillwing.services.history.wording import headline
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.protocol import Ending, ErrorCode, MissionPhase, MissionStatus, Record, StartMission, encode
from skillwing.services.terminal.connection import System, connect
from skillwing.services.terminal.exit_codes import FAILED, INTERRUPTED, OK, REFUSED, USAGE

pytestmark = pytest.mark.slow

PATIENCE = 40.0
CLI = (sys.executable, "-m", "skillwing.services.terminal.cli")
ROBOT = "hopper"
SKILLSET = """
skillset hopper {
    skill takeoff { input { height: float64  speed: float64 }  result { success DONE } }
    skill hover { input { duration: float64 }  interrupt { }  result { success DONE } }
    skill land { result { success DONE } }
}
"""
SCRIPT = """
[skill.takeoff]
delay = 1.0
[skill.hover]
delay = 600.0
[skill.land]
delay = 1.0
"""
TREE = """
<root BTCPP_format="4" main_tree_to_execute="hop">
  <BehaviorTree ID="hop">
    <Fallback>
      <Sequence><takeoff height="5" speed="1"/>{middle}<land/></Sequence>
      <land/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="rescue"><land/></BehaviorTree>
</root>
"""
HOPS = """
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionOptions, MissionTrees


class Options(MissionOptions):
    seconds: float = 1.0


class Hops(Mission):
    name = "hops"
    summary = "Hover."
    Options = Options

    def build(self, context, options):
        return MissionTrees(SkillAction("hover", context, "hover", {"duration": options.seconds}))


MISSION = Hops()
"""
"""A mission that is installed on the robot."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for `PYTHONPATH` with the mission HOPS, as a package manager installs it."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "hops.py").write_text(HOPS, encoding="utf-8")
    described = folder / "hops-1.0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text("Metadata-Version: 2.1\nName: hops\nVersion: 1.0\n", encoding="utf-8")
    (described / "entry_points.txt").write_text("[skillwing.missions]\nhops = hops:MISSION\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def run_dir(runtime: Path, installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A mocked robot of three skills, whose `hover` lasts until it is interrupted."""
    del runtime
    folder = tmp_path_factory.mktemp("on-board")
    (folder / "hopper.skillset").write_text(SKILLSET, encoding="utf-8")
    (folder / "hopper.mock.toml").write_text(SCRIPT, encoding="utf-8")
    words = ("mock", str(folder / "hopper.skillset"), "--run-dir", str(folder / "run"))
    process = subprocess.Popen(
        [*CLI, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONPATH": str(installed)},
    )
    assert process.stdout is not None
    try:
        said = next((line for line in process.stdout if "Start a skill" in line or "did not start" in line), "")
        assert "Start a skill" in said
        yield folder / "run"
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)


@pytest.fixture(autouse=True)
def no_mission_is_left(run_dir: Path) -> Iterator[None]:
    """A test that fails leaves no mission to the next one."""
    del run_dir
    yield
    for mission in mission_processes():
        with suppress(psutil.NoSuchProcess):
            mission.kill()
    until(lambda: process_id(ROBOT, "mission") is None, "the launcher to forget the mission")


@pytest.fixture
def tree(tmp_path: Path) -> Callable[..., str]:
    def write(middle: str = '<hover duration="500"/>', name: str = "patrol") -> str:
        file = tmp_path / f"{name}.xml"
        file.write_text(TREE.format(middle=middle), encoding="utf-8")
        return str(file)

    return write


def mission_processes() -> list[psutil.Process]:
    """Processes of missions that the launcher has started: it announces them only at its next check."""
    state = read_run_state(ROBOT)
    children = [] if state is None else psutil.Process(state.pid).children()
    return [child for child in children if "mission" in _words(child)]


def _words(process: psutil.Process) -> list[str]:
    """The command line of a process; empty for one that has ended."""
    with suppress(psutil.NoSuchProcess):  # such as a zombie
        return process.cmdline()
    return []


def follow(*words: str) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [*CLI, "mission", "run", *words, "--on-board"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )


def read_until(process: subprocess.Popen[str], text: str) -> str:
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line)
        if text in line:
            break
    assert text in lines[-1], "".join(lines)
    return "".join(lines)


def test_the_command_ends_and_the_mission_goes_on_until_it_is_aborted(
    run_dir: Path, skillwing: Command, tree: Callable[..., str]
) -> None:
    command = follow(tree())
    read_until(command, "hover")
    command.send_signal(signal.SIGINT)
    said, _ = command.communicate(timeout=PATIENCE)
    assert command.returncode == INTERRUPTED
    assert "The mission goes on on board. `skillwing mission abort` ends it." in said
    second = skillwing("mission", "run", "hops", "--on-board")
    assert second.code == REFUSED
    assert second.error.startswith("Mission hop runs here already.")
    on_the_ground = skillwing("mission", "run", tree())
    assert on_the_ground.code == REFUSED
    shown = skillwing("status", "--json").json
    assert shown["processes"]["mission"]["state"] == "runs"
    assert shown["mission"]["mission"] == "hop"
    assert "it can be aborted" in skillwing("mission", "pause").error, "the mission itself answers"
    mission = psutil.Process(process_id(ROBOT, "mission"))
    assert skillwing("mission", "abort").code == OK
    psutil.wait_procs([mission], timeout=PATIENCE)
    until(lambda: process_id(ROBOT, "mission") is None, "the launcher to forget the mission")
    assert "mission" not in skillwing("status", "--json").json["processes"]
    assert (run_dir / "trees" / "hop.xml").is_file()


def test_a_mission_that_does_not_fit_is_refused_with_its_problems_and_starts_nothing(
    run_dir: Path, skillwing: Command, tree: Callable[..., str]
) -> None:
    before = len(read_records(run_dir))
    here = skillwing("mission", "run", tree("<hoover/>", "wrong"), "--on-board")
    assert here.code == USAGE
    assert "did you mean `hover`?" in here.error
    there = skillwing("mission", "run", "hops", "--on-board", "second=1")
    assert there.code == USAGE
    assert "There is no option `second` of `hops`; did you mean `seconds`?" in there.error
    assert "Traceback" not in there.error
    unknown = skillwing("mission", "run", "nosuch", "--on-board")
    assert unknown.code == USAGE
    assert "There is no mission `nosuch`." in unknown.error
    assert "mission check" not in unknown.error
    news = read_records(run_dir)[before:]
    assert not [record for record in news if record.kind == "goal"]


def test_a_python_file_is_refused_before_anything_is_asked(skillwing: Command) -> None:
    said = skillwing("mission", "run", "my_mission.py", "--on-board")
    assert said.code == USAGE
    assert "Its mission has to be installed on the robot." in said.error


def test_a_mission_on_board_ends_its_command_and_the_launcher_tells_its_result_to_those_who_missed_it(
    run_dir: Path, tree: Callable[..., str]
) -> None:
    del run_dir
    command = follow(tree(""))
    said, _ = command.communicate(timeout=PATIENCE)
    assert command.returncode == OK, said
    assert "SUCCEEDED" in said
    statuses: list[MissionStatus] = []
    with connect(ROBOT, wait_for_clock=False) as system:
        ask_latest_status(system, statuses.append)
        assert system.bus.run_until(lambda: bool(statuses), PATIENCE)
    assert (statuses[0].mission, statuses[0].phase) == ("hop", "SUCCEEDED")


def test_a_mission_whose_process_is_killed_is_over_for_its_watchers_and_its_goals_end(
    run_dir: Path, skillwing: Command, tree: Callable[..., str]
) -> None:
    command = follow(tree())
    read_until(command, "hover")
    os.kill(until(lambda: process_id(ROBOT, "mission"), "the mission's process"), signal.SIGKILL)
    said, _ = command.communicate(timeout=PATIENCE)
    assert command.returncode == FAILED
    assert "its process has ended: mission was killed by SIGKILL." in said

    def end() -> Record | None:
        records = reversed(read_records(run_dir))
        return next((each for each in records if each.subject == "hover" and "is gone" in each.text), None)

    record = until(end, "the goals of the mission to end")
    chain = History.of(read_records(run_dir)).chain(record.id)
    assert (headline(chain[0]), chain[0].source) == ("mission KILLED", "launcher")
    assert skillwing("start", "land", "--follow").code == OK, "for those who come next"


def test_the_loss_of_a_killed_manager_names_its_exit_as_its_cause(
    run_dir: Path, skillwing: Command, tree: Callable[..., str]
) -> None:
    command = follow(tree())
    read_until(command, "hover")
    # A mission shows a skill before its goal has a grant, which alone can be lost.
    until(lambda: goal_runs(skillwing, ROBOT, "hover"), "the goal to run")
    os.kill(until(lambda: process_id(ROBOT, "skill/hover"), "the manager"), signal.SIGKILL)
    said, _ = command.communicate(timeout=PATIENCE)
    assert command.returncode == OK, "the tree lands after the loss of `hover`: " + said

    def lost() -> Record | None:
        records = reversed(read_records(run_dir))
        source, label = "resource_manager", Ending.LOST
        return next((each for each in records if each.source == source and each.after == label), None)

    record = until(lost, "the loss")
    chain = History.of(read_records(run_dir)).chain(record.id)
    exits = [each for each in read_records(run_dir) if each.source == "launcher"]
    assert headline(chain[0]) == "skill/hover KILLED", (record, exits)
    assert chain[0].text == "skill/hover was killed by SIGKILL."
    until(lambda: skillwing("status").code == OK, "the manager to run again")


def being_started(system: System, request: StartMission) -> bool:
    """Ask for the start of a mission; False while that of the test before has its place.

    It keeps its place for a moment after the end of its process, in case its last status is late.
    """
    with pytest.raises(RefusedError) as refused:
        system.ask(system.keys.mission_start, request, MissionStatus)
    if refused.value.code is ErrorCode.NOT_ALLOWED:
        assert "runs here already" in refused.value.message
        return False
    assert "is being started" in refused.value.message
    return True


def test_a_mission_on_board_whose_process_is_still_starting_refuses_one_on_the_ground(
    run_dir: Path, skillwing: Command, tree: Callable[..., str]
) -> None:
    """The launcher answers for the mission before its process has an alive token."""
    del run_dir
    file = Path(tree())
    request = StartMission(request_id="early", mission="patrol", client="cli", tree=file.read_text(encoding="utf-8"))
    with connect(ROBOT, wait_for_clock=False) as system:
        until(lambda: being_started(system, request), "the place of the mission before to be free")
        [started] = mission_processes()
        started.suspend()
        try:
            on_the_ground = skillwing("mission", "run", str(file))
        finally:
            started.resume()
        assert on_the_ground.code == REFUSED
        assert on_the_ground.error.startswith("Mission patrol runs here already.")
    until(lambda: skillwing("mission", "abort").code == OK, "the mission to begin")
    until(lambda: process_id(ROBOT, "mission") is None, "the launcher to forget the mission")


def test_a_mission_on_the_ground_that_began_meanwhile_gives_no_answer_to_the_request(
    run_dir: Path, tree: Callable[..., str]
) -> None:
    """The other mission here does not look for missions, as if both had looked at the same moment."""
    del run_dir
    request = StartMission(
        request_id="both", mission="patrol", client="cli", tree=Path(tree("<hoover/>")).read_text(encoding="utf-8")
    )
    with connect(ROBOT, wait_for_clock=False) as system:
        until(lambda: being_started(system, request), "the place of the mission before to be free")
        out = system.bus.advertise(system.keys.mission_status, events=True)
        token = system.bus.declare_alive(system.keys.alive("mission"))
        other = MissionStatus(mission="ground", phase=MissionPhase.SUCCEEDED, t=1.0, text="done")
        out.put(encode(other))

        def refused() -> RefusedError | None:
            try:
                system.ask(system.keys.mission_start, request, MissionStatus)
            except RefusedError as error:
                return None if error.code is ErrorCode.UNAVAILABLE else error
            raise AssertionError("another mission's token answered the request")

        assert "There is no node `hoover`" in until(refused, "the refusal").message
        token.cancel()
