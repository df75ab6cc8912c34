"""A launcher's node: the exit of a process is the cause of the losses that follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from skillwing.dsl import parse
from skillwing.services.access.certificate_watch import CertificateWatch
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import RobotAccess
from skillwing.services.bus import Answer, Refused
from skillwing.services.bus.inprocess import InProcessNetwork, SentMessage
from skillwing.services.bus.reading import message_reader
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.mocking import MockRun, MockScript
from skillwing.services.names import LAUNCHER, MISSION
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.launcher_node import MISSIONS_KEPT, LauncherNode
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import ErrorCode, Keys, NodesExited, Record, StartMission, encode
from skillwing.services.robot import ProcessSpec, Robot
from skillwing.services.testing import SkillsetInProcess
from skillwing.services.wire.channel import Role

SKILLSET = parse(
    """
    skillset rover {
        resource wheels { initial PARKED  PARKED -> DRIVING  DRIVING -> PARKED }
        skill drive {
            effect { roll: wheels -> DRIVING  park: wheels -> PARKED }
            precondition { parked: resource=(wheels == PARKED)  success roll }
            interrupt { apply=park }
            result { success ARRIVED: apply=park }
        }
    }
    """
)
KEYS = Keys(SKILLSET.name)
ROBOT = Robot(name="rover", skillset=Path("rover.skillset"), hooks={})
DRIVE = "skill/drive"


@dataclass
class NoLauncher:
    """A launcher that starts nothing."""

    states: tuple[ProcessState, ...] = ()
    run_dir: Path = Path("run")

    def launch(self, spec: ProcessSpec, log: str) -> None:
        raise AssertionError(f"{spec.name} is not to be started, with the log {log}")

    def forget(self, name: str) -> None:
        raise AssertionError(f"{name} is not to be forgotten")


@dataclass
class LogWriter:
    """A launcher whose processes write a log and do nothing else."""

    run_dir: Path
    states: tuple[ProcessState, ...] = ()

    def launch(self, spec: ProcessSpec, log: str) -> None:
        file = self.run_dir / "logs" / f"{log}.log"
        file.parent.mkdir(exist_ok=True)
        file.write_text(spec.options["mission"], encoding="utf-8")

    def forget(self, name: str) -> None:
        pass


def test_the_files_of_the_latest_missions_on_board_stay(tmp_path: Path) -> None:
    network = InProcessNetwork()
    node = LauncherNode(LogWriter(tmp_path), ROBOT, SKILLSET.name, {})
    network.attach(node)
    station = network.bus("station")
    for number in range(1, MISSIONS_KEPT + 6):
        request = StartMission(
            request_id=str(number), mission="hop", client="cli", tree="<root/>" if number % 2 else ""
        )
        station.ask(KEYS.mission_start, encode(request), lambda answer: None)
        network.run_for(1.0)
        node.take_exit(ProcessExit(MISSION, pid=number, exit_code=1, signal=None, log=()))
    kept = range(6, MISSIONS_KEPT + 6)
    logs = {path.name for path in (tmp_path / "logs").iterdir()}
    assert logs == {f"mission-{number}.log" for number in kept}
    trees = {path.name for path in (tmp_path / "trees").iterdir()}
    assert trees == {f"hop-{number}.xml" for number in kept if number % 2}


def killed(process: str) -> ProcessExit:
    return ProcessExit(process, pid=1, exit_code=None, signal=9, log=())


@pytest.mark.parametrize(("process", "nodes"), [(DRIVE, ()), ("managers", (DRIVE, "skill/other"))])
def test_the_loss_of_a_killed_manager_comes_of_its_exit(process: str, nodes: tuple[str, ...]) -> None:
    """Several managers may share a process, which then has another name."""
    robot = SkillsetInProcess(SKILLSET, script=MockScript(skills={"drive": (MockRun(forever=True),)}))
    node = LauncherNode(NoLauncher((ProcessState(name=process, nodes=nodes),)), ROBOT, SKILLSET.name, {})
    robot.network.attach(node)
    robot.run(1.0)
    goal = robot.start_skill("drive")
    goal.assert_running()
    robot.kill(DRIVE)
    assert node.take_exit(killed(process))
    robot.run(5.0)
    goal.assert_ended("LOST")
    assert goal.causes[0] == f"{process} KILLED"


def test_an_exit_is_told_with_its_record_and_the_nodes_of_the_process() -> None:
    network = InProcessNetwork()
    exits: list[NodesExited] = []
    network.bus("resource_manager").subscribe(KEYS.exits, message_reader(NodesExited, exits.append))
    node = LauncherNode(NoLauncher(), ROBOT, SKILLSET.name, {})
    network.attach(node)
    said: list[SentMessage] = []
    network.tap = said.append
    network.run_for(2.0)
    assert node.take_exit(killed(DRIVE))
    network.run_for(1.0)
    [exited] = exits
    assert (exited.nodes, exited.t) == ((DRIVE,), 2.0)
    assert exited.record.startswith("launcher~")
    assert [each.key for each in said if each.what == "put"] == [KEYS.timeline, KEYS.exits]


def test_a_resource_manager_reads_no_records_of_others(caplog: pytest.LogCaptureFixture) -> None:
    """A busy timeline costs it nothing, since exits have a key of their own. Who reads an unreadable record logs it."""
    network = InProcessNetwork()
    network.attach(ResourceManagerNode(SKILLSET))
    timeline = network.bus("mission").advertise(KEYS.timeline)
    network.run_for(1.0)
    timeline.put(b"no record")
    network.run_for(1.0)
    assert caplog.records == []
    network.bus("recorder").subscribe(KEYS.timeline, message_reader(Record, lambda record: None))
    timeline.put(b"no record")
    network.run_for(1.0)
    assert len(caplog.records) == 1


def test_a_mission_on_board_does_not_start_before_a_certificate_ends(tmp_path: Path) -> None:
    store = KeyStore.init(tmp_path / "keys", [], days=1)
    store.add_robot(RobotAccess("rover", "rover", {LAUNCHER: Role.LAUNCHER}))
    network = InProcessNetwork()
    watch = CertificateWatch(store.folder, "rover", [])
    network.attach(LauncherNode(NoLauncher(), ROBOT, SKILLSET.name, {}, watch))
    answers: list[Answer] = []
    request = StartMission(request_id="1", mission="patrol", client="alice")
    network.bus("client").ask(KEYS.mission_start, encode(request), answers.append)
    network.run_for(1.0)
    [refused] = answers
    assert isinstance(refused, Refused)
    assert refused.error.code is ErrorCode.NOT_ALLOWED
    assert "It might end during the mission" in refused.error.message
    assert refused.error.help.startswith("Renew it with `skillwing keys add-robot ")
