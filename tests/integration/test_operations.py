"""Operations of a real system: processes that are started again, findings of `doctor`, the view of `top`, and ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from command_line import Command, Said
from pump import PUMP

from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.restart_policy import EXITS_IN_A_ROW
from skillwing.services.processes.run_state import RunState, read_run_state
from skillwing.services.terminal.exit_codes import FAILED, OK, REFUSED

pytestmark = pytest.mark.slow

PATIENCE = 60.0
POLL = 0.02
SCRIPT = "[skill.fill]\ndelay = 3600.0\n"


@pytest.fixture(scope="module", autouse=True)
def nobody_tells_robot_time_and_no_other_work_is_done() -> Iterator[None]:
    """Quiet surroundings: `doctor` need not listen for long, and says nothing about the load of the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("skillwing.services.diagnosis.examination.CLOCK_WATCH", 0.1)
        patch.setattr(os, "getloadavg", lambda: (0.0, 0.0, 0.0))
        yield


def serious(said: Said) -> set[str]:
    """Serious findings of a `doctor --json`."""
    return {finding["about"] for finding in said.json["findings"] if finding["serious"]}


@dataclass
class Pump:
    """A mocked pump that runs, with its skillset and its directory."""

    skillwing: Command
    skillset: Path
    run_dir: Path

    def state(self) -> RunState:
        state = read_run_state("pump")
        assert state is not None
        return state

    def process(self, name: str) -> ProcessState:
        return next(process for process in self.state().processes if process.name == name)

    def pid(self, name: str) -> int:
        pid = self.process(name).pid
        assert pid is not None
        return pid

    def said(self) -> str:
        """Output of `mock` so far."""
        return (self.run_dir / "logs" / "up.log").read_text(encoding="utf-8")

    def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, self.said()
            time.sleep(POLL)

    def doctor(self) -> Said:
        return self.skillwing("doctor", "--json")


@pytest.fixture(scope="module")
def pump(skillwing: Command, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pump]:
    folder = tmp_path_factory.mktemp("pump")
    pump = Pump(skillwing, folder / "pump.skillset", folder / "run")
    pump.skillset.write_text(PUMP, encoding="utf-8")
    (folder / "pump.mock.toml").write_text(SCRIPT, encoding="utf-8")
    said = skillwing("mock", str(pump.skillset), "--detach", "--no-record", "--run-dir", str(pump.run_dir))
    assert said.code == OK, said.error
    runner = psutil.Process(pump.state().pid)
    processes = [runner, *runner.children()]
    try:
        yield pump
    finally:
        if runner.is_running():
            skillwing("down")
        assert psutil.wait_procs(processes, timeout=PATIENCE)[1] == []


def test_a_system_that_is_well_is_left_in_peace(pump: Pump) -> None:
    said = pump.doctor()
    assert (said.code, serious(said)) == (OK, set())
    assert "pump is well." in pump.skillwing("doctor").out


def test_top_shows_every_process_skill_and_resource(pump: Pump) -> None:
    assert pump.skillwing("start", "fill").code == OK
    seen = pump.skillwing("top", "--json").json
    assert set(seen["processes"]) == {process.name for process in pump.state().processes}
    assert all(process["memory_bytes"] > 0 for process in seen["processes"].values())
    assert (seen["skills"]["fill"]["state"], seen["skills"]["drain"]["state"]) == ("RUNNING", "IDLE")
    assert seen["resources"]["valve"]["state"] == "OPEN"
    assert "fill" in seen["resources"]["valve"]["by"]
    told = pump.skillwing("top", "--once").out
    assert all(word in told for word in ("resource_manager", "skill/drain", "RUNNING", "valve"))
    assert pump.skillwing("start", "fill").code == REFUSED
    fill = pump.skillwing("top", "--json").json["skills"]["fill"]
    assert (fill["state"], fill["last"]["ending"]) == ("RUNNING", "BUSY")
    assert pump.skillwing("interrupt", "fill").code in (OK, FAILED)


def test_a_goal_whose_manager_dies_is_lost_and_its_manager_comes_back(pump: Pump) -> None:
    assert pump.skillwing("start", "fill").code == OK
    before = pump.pid("skill/fill")
    os.kill(before, signal.SIGKILL)
    pump.until(lambda: pump.process("skill/fill").life == "lives" and pump.pid("skill/fill") != before)
    pump.until(lambda: "skill/fill runs again." in pump.said())
    pump.until(lambda: pump.skillwing("resources", "--json").json["states"]["valve"] == "SHUT")
    assert pump.skillwing("start", "fill").code == OK
    pump.skillwing("interrupt", "fill")
    assert pump.skillwing("status", "--json").json["processes"]["skill/fill"]["restarts"] == 1
    log = (pump.run_dir / "logs" / "skill" / "fill.log").read_text(encoding="utf-8")
    assert log.count("skill/fill runs") == 2


def test_a_process_that_is_stopped_is_found(pump: Pump) -> None:
    os.kill(pump.pid("skill/drain"), signal.SIGSTOP)
    try:
        said = pump.doctor()
        assert (said.code, serious(said)) == (FAILED, {"process_stopped"})
    finally:
        os.kill(pump.pid("skill/drain"), signal.SIGCONT)
    pump.until(lambda: serious(pump.doctor()) == set())


def test_two_processes_of_one_name_are_found(pump: Pump) -> None:
    first = pump.pid("skill/drain")
    factory = "skillwing.services.mocking.system:make_mock_skill_process"
    options = json.dumps({"skillset": str(pump.skillset), "skill": "drain"})
    command = [sys.executable, "-m", "skillwing.services.processes.node_host", "--name", "skill/drain"]
    command += ["--factory", factory, "--options", options, "--robot", "pump", "--alive", "pump/alive/skill/drain"]
    with subprocess.Popen([*command, "--connect", pump.state().endpoint], stderr=subprocess.PIPE, text=True) as second:
        assert second.stderr is not None
        assert "skill/drain runs" in second.stderr.readline()
        found = serious(pump.doctor())
        second.terminate()
        second.communicate()
    # The one that was replaced may have noticed, and ended, while the doctor looked.
    assert found - {"process_down"} == {"two_of_a_name"}
    # Its launcher starts it again.
    pump.until(lambda: pump.process("skill/drain").life == "lives" and pump.pid("skill/drain") != first)
    # A process that starts is no serious finding, and may still read the file that the next test writes.
    pump.until(lambda: pump.skillwing("status", "--json").json["processes"]["skill/drain"]["state"] == "runs")
    assert serious(pump.doctor()) == set()


def test_a_skillset_that_has_changed_since_is_found(pump: Pump) -> None:
    pump.skillset.write_text(PUMP.replace("EMPTY", "DRY"), encoding="utf-8")
    try:
        assert serious(pump.doctor()) == {"schema_mismatch"}
    finally:
        pump.skillset.write_text(PUMP, encoding="utf-8")


def test_what_dies_again_and_again_is_given_up(pump: Pump) -> None:
    killed: set[int] = set()
    while len(killed) < EXITS_IN_A_ROW:
        pump.until(lambda: pump.process("mocked_world").life == "lives" and pump.pid("mocked_world") not in killed)
        os.kill(pump.pid("mocked_world"), signal.SIGKILL)
        killed.add(pump.pid("mocked_world"))
    pump.until(lambda: pump.process("mocked_world").life == "given up")
    pump.until(lambda: f"It exited {EXITS_IN_A_ROW} times in" in pump.said())
    said = pump.doctor()
    assert "process_down" in serious(said)
    assert "it stays down" in said.out
    said = pump.skillwing("start", "drain", "--follow")
    assert said.code == OK, said


def test_without_its_router_a_system_is_told_to_be_without(pump: Pump) -> None:
    os.kill(pump.pid("router"), signal.SIGSTOP)
    try:
        assert "no_router" in serious(pump.doctor())
    finally:
        os.kill(pump.pid("router"), signal.SIGCONT)


def test_killed_with_9_it_leaves_a_file_that_is_known_to_be_stale(pump: Pump) -> None:
    """The last test of the pump."""
    runner = psutil.Process(pump.state().pid)
    processes = runner.children()
    runner.kill()
    assert psutil.wait_procs([runner, *processes], timeout=PATIENCE)[1] == []
    said = pump.doctor()
    assert serious(said) == {"no_system"}
    assert "stale_run_state" in {finding["about"] for finding in said.json["findings"]}
    assert "stale_run_state" not in {finding["about"] for finding in pump.doctor().json["findings"]}
