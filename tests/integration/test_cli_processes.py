"""Processes for real: how they start, what they say when they cannot, and that none outlives its system."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue

import psutil
import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client
from skillwing.services.client.goal_handle import GoalHandle
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.client.retry import wait_for_answer
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.processes.child import ProcessExit
from skillwing.services.processes.colocation import ProcessGroup
from skillwing.services.processes.launcher import Launcher, StartError
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_OK, EXIT_REPLACED, EXIT_UNREACHABLE
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.processes.router import start_router
from skillwing.services.protocol import AttachManager, Ending, Keys, encode
from skillwing.services.robot import ProcessSpec

pytestmark = pytest.mark.slow

MANAGERS = tuple(spec for spec in ROBOT.managers() if spec.name in ("data_manager", "resource_manager"))
PATIENCE = 20.0


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    session, found = start_router()
    yield found
    session.close()


def host(endpoint: str, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "skillwing.services.processes.node_host", "--connect", endpoint, "--robot", "m600"]
    return subprocess.Popen(
        [*command, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def outcome(process: subprocess.Popen[str]) -> tuple[int, str]:
    """Exit code and everything that the process said."""
    out, error = process.communicate(timeout=PATIENCE)
    return process.returncode, out + error


# --- one process -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--process", "skill/takeof"], "did you mean `skill/takeoff`"),
        (["--name", "x", "--factory", "skillwing.nowhere:make"], "skillwing.nowhere:make"),
        (
            ["--name", "x", "--factory", "skillwing.services.managers.data_manager:make"],
            "skillwing.services.managers.data_manager:make",
        ),
        (
            ["--name", "x", "--factory", "skillwing.services.managers.data_manager:make_data_manager"],
            "`skillset` is missing",
        ),
        (["--name", "x", "--factory", "a:b", "--options", "{"], "no JSON"),
        (["--name", "x", "--factory", "a:b", "--options", "[]"], "JSON object"),
    ],
)
def test_a_wrong_configuration_gets_a_sentence_and_no_traceback(arguments: list[str], sentence: str) -> None:
    code, said = outcome(host("tcp/127.0.0.1:1", *arguments))
    assert code == EXIT_CONFIGURATION
    assert sentence in said
    assert "Traceback" not in said


def test_a_router_that_is_not_there_gets_a_sentence() -> None:
    with pytest.raises(RouterUnreachableError, match=r"No router answers at tcp/127\.0\.0\.1:1"):
        open_client("tcp/127.0.0.1:1", "m600", timeout=0.2)


@pytest.mark.parametrize("end", ["SIGTERM", "SIGINT", "the parent's death"])
def test_a_process_ends_in_good_order(endpoint: str, end: str) -> None:
    process = host(endpoint, "--process", "data_manager", "--clock", "wall", "--parent-pipe")
    assert process.stderr is not None
    assert process.stdin is not None
    assert "data_manager runs" in process.stderr.readline()
    if end.startswith("SIG"):
        process.send_signal(signal.Signals[end])
    else:
        process.stdin.close()
        process.stdin = None
    code, said = outcome(process)
    assert code == EXIT_OK
    assert "data_manager ended" in said


def test_the_router_listens_where_it_says_and_ends_with_its_parent() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "skillwing.services.processes.router", "--parent-pipe"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    open_client(process.stdout.readline().strip(), "m600", timeout=5.0).close()
    assert outcome(process) == (EXIT_OK, "")


@pytest.mark.parametrize("listen", ["udp/127.0.0.1:0", "tcp/nowhere.invalid:0"])
def test_a_router_that_cannot_listen_says_so(listen: str) -> None:
    command = [sys.executable, "-m", "skillwing.services.processes.router", "--listen", listen, "--insecure"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert result.returncode == EXIT_CONFIGURATION
    assert f"cannot listen at {listen}" in result.stderr or f"`{listen}`, given by `listen`, is no" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_port_in_use_is_reported_with_its_owner(endpoint: str) -> None:
    command = [sys.executable, "-m", "skillwing.services.processes.router", "--listen", endpoint]
    result = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert result.returncode == EXIT_UNREACHABLE
    assert f"Process {os.getpid()} (`" in result.stderr


# --- a system --------------------------------------------------------------------------------------------------------


def test_a_system_starts_is_watched_and_stops(tmp_path: Path) -> None:
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    with Launcher("m600", "m600", tmp_path, clock="wall", on_exit=deaths.put) as launcher:
        launcher.start(MANAGERS)
        processes = [psutil.Process(pid) for pid in launcher.pids.values()]
        assert set(launcher.pids) == {"router", "data_manager", "resource_manager"}
        await_line(tmp_path / "logs" / "data_manager.log", "data_manager runs")
        os.kill(launcher.pids["data_manager"], signal.SIGKILL)
        death = deaths.get(timeout=PATIENCE)
        assert str(death) == "data_manager was killed by SIGKILL."
        assert "data_manager runs" in death.log[-1]
        assert not launcher.running("data_manager")
        launcher.start(MANAGERS[:1])
        assert launcher.running("data_manager")
    assert psutil.wait_procs(processes, timeout=0)[1] == []
    assert launcher.exits == [death]
    assert "resource_manager ended" in (tmp_path / "logs" / "resource_manager.log").read_text(encoding="utf-8")


def test_a_launcher_remembers_the_latest_exits_and_sees_each_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("skillwing.services.processes.launcher.EXITS_KEPT", 2)
    factory, nowhere = "skillwing.services.managers.data_manager:make_data_manager", {"skillset": "/nowhere"}
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    with Launcher("m600", "m600", tmp_path, clock="wall", on_exit=deaths.put) as launcher:
        launcher.start_router()
        for name in ("first", "second", "third"):
            launcher.launch(ProcessSpec(name, factory, nowhere, essential=False, restart="never"), name)
            deaths.get(timeout=PATIENCE)
        assert [death.process for death in launcher.exits] == ["second", "third"]
        with pytest.raises(StartError, match="fourth ended with exit code 78"):
            launcher.start([ProcessSpec("fourth", factory, nowhere)], timeout=PATIENCE)


def test_a_process_that_hangs_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("skillwing.services.processes.launcher.STOP_TIMEOUT", 0.5)
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher:
        launcher.start(MANAGERS[:1])
        process = psutil.Process(launcher.pids["data_manager"])
        os.kill(process.pid, signal.SIGSTOP)
    assert psutil.wait_procs([process], timeout=0)[1] == []


def test_a_system_that_does_not_start_says_which_process_and_why(tmp_path: Path) -> None:
    broken = ProcessSpec(
        "broken", "skillwing.services.managers.data_manager:make_data_manager", {"skillset": "/nowhere"}
    )
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher, pytest.raises(StartError) as caught:
        launcher.start([broken], timeout=PATIENCE)
    assert caught.value.missing == ("broken",)
    assert f"broken ended with exit code {EXIT_CONFIGURATION}." in str(caught.value)
    assert "/nowhere" in str(caught.value)


def test_a_process_that_never_says_that_it_is_there_is_named(tmp_path: Path) -> None:
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher, pytest.raises(StartError) as caught:
        launcher.start_router()
        launcher.start(MANAGERS[:1], timeout=0.0)
    assert caught.value.missing == ("data_manager",)
    assert "No sign of life from data_manager." in str(caught.value)


KILLER = """
import os, signal, psutil
from skillwing.services.managers.data_manager import make_data_manager

def make(options):
    if options["victim"]:
        victim = psutil.Process(options["victim"])
        victim.kill()
        psutil.wait_procs([victim])
    else:
        os.kill(os.getpid(), signal.SIGKILL)
    return make_data_manager(options)
"""


@pytest.fixture
def killer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ProcessSpec:
    """A process that kills its victim while it starts itself; without one, itself."""
    (tmp_path / "killer.py").write_text(KILLER, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    options = {"skillset": str(ROBOT.skillset), "victim": 0}
    return ProcessSpec("killer", "killer:make", options, essential=False)


def test_the_death_of_another_process_does_not_keep_one_from_starting(tmp_path: Path, killer: ProcessSpec) -> None:
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher:
        launcher.start(MANAGERS)
        killer.options["victim"] = launcher.pids["data_manager"]
        launcher.start([killer], timeout=PATIENCE)
        assert launcher.running("killer")
        assert [death.process for death in launcher.exits] == ["data_manager"]


def test_a_process_that_is_not_essential_may_die_while_it_starts(tmp_path: Path, killer: ProcessSpec) -> None:
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher:
        launcher.start([killer, *MANAGERS], timeout=PATIENCE)
        assert launcher.running("resource_manager")
        assert [str(death) for death in launcher.exits] == ["killer was killed by SIGKILL."]


# --- restarts ---------------------------------------------------------------------------------------------------------


def test_what_dies_is_started_again_and_its_log_goes_on(tmp_path: Path) -> None:
    changes: SimpleQueue[None] = SimpleQueue()
    deaths: SimpleQueue[tuple[ProcessExit, ProcessState]] = SimpleQueue()
    with Launcher(
        "m600",
        "m600",
        tmp_path,
        clock="wall",
        restarts=True,
        on_exit=lambda death: deaths.put((death, state_of(launcher, "data_manager"))),
        on_change=lambda: changes.put(None),
    ) as launcher:
        launcher.start(MANAGERS)
        first = launcher.pids["data_manager"]
        os.kill(first, signal.SIGKILL)
        death, dead = deaths.get(timeout=PATIENCE)
        assert (death.final, death.outlook) == (False, "It is started again in 0.2 s.")
        assert dead.last_words == f"{death} {death.outlook}"
        await_restart(launcher, "data_manager", changes)
        state = state_of(launcher, "data_manager")
        assert (state.life, state.restarts) == ("lives", 1)
        assert state.pid != first
        assert_present(launcher, ["data_manager"])
    log = (tmp_path / "logs" / "data_manager.log").read_text(encoding="utf-8")
    # Its first life may have been too short for a line of its own.
    _, second_life = log.split("--- restarted")
    assert "data_manager runs" in second_life
    assert psutil.pid_exists(state.pid or 0) is False


LOOKING = """
import sys
from skillwing.services.managers.data_manager import make_data_manager

def make(options):
    manager = make_data_manager(options)
    print("with a checker" if "skillwing.dsl.checking" in sys.modules else "without a checker", flush=True)
    return manager
"""


def test_no_life_of_a_process_checks_the_skillset_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "looking.py").write_text(LOOKING, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    spec = ProcessSpec("data_manager", "looking:make", {"skillset": str(ROBOT.skillset)})
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    with Launcher("m600", "m600", tmp_path, clock="wall", restarts=True, on_exit=deaths.put) as launcher:
        launcher.start([spec])
        log = tmp_path / "logs" / "data_manager.log"
        await_line(log, "data_manager runs")
        os.kill(launcher.pids[spec.name], signal.SIGKILL)
        deaths.get(timeout=PATIENCE)
        await_line(log, "data_manager runs", times=2)
    lives = [line for line in log.read_text(encoding="utf-8").splitlines() if line.endswith("checker")]
    assert lives == ["without a checker"] * 2


def test_the_router_comes_back_at_its_port_and_the_others_find_it(tmp_path: Path) -> None:
    changes: SimpleQueue[None] = SimpleQueue()
    with Launcher(
        "m600", "m600", tmp_path, clock="wall", restarts=True, on_change=lambda: changes.put(None)
    ) as launcher:
        launcher.start(MANAGERS)
        os.kill(launcher.pids["router"], signal.SIGKILL)
        await_restart(launcher, "router", changes)
        assert_present(launcher, [spec.name for spec in MANAGERS])
        assert [death.process for death in launcher.exits] == ["router"]


def test_a_process_that_must_not_be_restarted_stays_down(tmp_path: Path) -> None:
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    once = replace(MANAGERS[0], restart="never")
    with Launcher("m600", "m600", tmp_path, clock="wall", restarts=True, on_exit=deaths.put) as launcher:
        launcher.start([once])
        os.kill(launcher.pids[once.name], signal.SIGKILL)
        death = deaths.get(timeout=PATIENCE)
        assert death.final
        assert "not started again" in death.outlook
        assert state_of(launcher, once.name).life == "given up"


def test_a_process_with_impossible_options_is_not_restarted(tmp_path: Path, killer: ProcessSpec) -> None:
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    broken = replace(killer, factory="killer:nothing")
    with Launcher("m600", "m600", tmp_path, clock="wall", restarts=True, on_exit=deaths.put) as launcher:
        launcher.start([broken])
        death = deaths.get(timeout=PATIENCE)
    assert (death.final, death.exit_code) == (True, EXIT_CONFIGURATION)
    assert "killer:nothing" in death.outlook


def test_a_replaced_manager_ends_and_is_restarted(tmp_path: Path) -> None:
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    manager = ROBOT.process(skill_process("hover"), {})
    with Launcher("m600", "m600", tmp_path, clock="wall", restarts=True, on_exit=deaths.put) as launcher:
        launcher.start(MANAGERS)
        launcher.start([manager])
        with closing(ZenohBus("test", "m600", launcher.endpoint)) as bus:
            client = SkillsetInterface(bus, ROBOT.load_skillset(), client="test")
            # The process has attached once the resource manager has judged a goal of it.
            assert ending_of(bus, client.start("hover", {"duration": 1.0})) is Ending.NOT_READY
            rival = AttachManager(manager=manager.name, incarnation="one that comes and goes")
            key = Keys("m600").resource_attach
            wait_for_answer(bus, key, lambda take: bus.ask(key, encode(rival), take))
            assert ending_of(bus, client.start("hover", {"duration": 1.0})) is Ending.LOST
            death = deaths.get(timeout=PATIENCE)
            assert (death.process, death.exit_code, death.final) == (manager.name, EXIT_REPLACED, False)
            assert any("Another process has taken the place" in line for line in death.log)
            assert_present(launcher, [manager.name])
            # It counts again: what the goal lacks now is a drone in the air.
            assert ending_of(bus, client.start("hover", {"duration": 1.0})) is Ending.NOT_READY
        assert deaths.empty()


def ending_of(bus: ZenohBus, goal: GoalHandle) -> Ending | None:
    bus.run_until(lambda: goal.done, PATIENCE)
    return goal.terminal.ending if goal.terminal is not None else None


def test_a_process_that_waits_for_its_restart_is_not_started_by_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("skillwing.services.processes.restart_policy.FIRST_PAUSE", PATIENCE)
    deaths: SimpleQueue[ProcessExit] = SimpleQueue()
    with Launcher("m600", "m600", tmp_path, clock="wall", restarts=True, on_exit=deaths.put) as launcher:
        launcher.start(MANAGERS[:1])
        os.kill(launcher.pids["data_manager"], signal.SIGKILL)
        deaths.get(timeout=PATIENCE)
    assert not launcher.running("data_manager")
    assert state_of(launcher, "data_manager").restarts == 0


def await_line(log: Path, text: str, times: int = 1) -> None:
    """Wait for what a process writes right after it has said that it is there."""
    deadline = time.monotonic() + PATIENCE
    while log.read_text(encoding="utf-8").count(text) < times:
        assert time.monotonic() < deadline
        time.sleep(0.01)


def assert_present(launcher: Launcher, names: list[str]) -> None:
    """Wait until these processes say that they are there."""
    bus = ZenohBus("test", launcher.robot, launcher.endpoint)
    missing = {Keys("m600").alive(name) for name in names}
    bus.watch_alive("m600/alive/**", lambda key, alive: missing.discard(key) if alive else None)
    try:
        assert bus.run_until(lambda: not missing, PATIENCE), missing
    finally:
        bus.close()


def await_restart(launcher: Launcher, name: str, changes: SimpleQueue[None]) -> None:
    """Follow the changes until the process has begun its second life."""
    while state_of(launcher, name).restarts == 0:
        changes.get(timeout=PATIENCE)


def state_of(launcher: Launcher, name: str) -> ProcessState:
    return next(state for state in launcher.states if state.name == name)


LAUNCH = """
import sys, threading
from pathlib import Path
from skillwing.m600.robot import ROBOT
from skillwing.services.processes.launcher import Launcher
with Launcher("m600", "m600", Path(sys.argv[1]), clock="wall") as launcher:
    launcher.start([spec for spec in ROBOT.managers() if spec.name == "data_manager"])
    print(*launcher.pids.values(), flush=True)
    threading.Event().wait()
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_no_process_outlives_its_launcher(tmp_path: Path, end: signal.Signals) -> None:
    command = [sys.executable, "-c", LAUNCH, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        children = [psutil.Process(int(pid)) for pid in process.stdout.readline().split()]
        assert len(children) == 2
        process.send_signal(end)
        assert psutil.wait_procs(children, timeout=PATIENCE)[1] == []


def test_liveliness_is_declared_under_the_name_of_the_process(tmp_path: Path) -> None:
    seen: dict[str, bool] = {}
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher:
        launcher.start(MANAGERS)
        session = open_client(launcher.endpoint, "m600", timeout=5.0)
        for reply in session.liveliness().get(Keys("m600").alive("**")):
            assert reply.ok is not None
            seen[str(reply.ok.key_expr)] = True
        session.close()
    assert set(seen) == {"m600/alive/data_manager", "m600/alive/resource_manager"}


def test_the_late_note_of_an_exit_does_not_count_against_the_next_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted = threading.Event()
    wait = subprocess.Popen.wait

    def wait_long(self: subprocess.Popen[bytes], timeout: float | None = None) -> int:
        """Let the launcher hear of the first life's end only after the start of the second has begun."""
        code = wait(self, timeout)
        if threading.current_thread().name.startswith("watch"):
            noted.wait(PATIENCE)
        return code

    command = Launcher._command

    def note_and_command(self: Launcher, group: ProcessGroup) -> list[str]:
        noted.set()
        return command(self, group)

    monkeypatch.setattr(subprocess.Popen, "wait", wait_long)
    (spec,) = (each for each in MANAGERS if each.name == RESOURCE_MANAGER)
    with Launcher("m600", "m600", tmp_path, clock="wall") as launcher:
        launcher.start((spec,))
        os.kill(launcher.pids[RESOURCE_MANAGER], signal.SIGKILL)
        while launcher.running(RESOURCE_MANAGER):
            pass
        monkeypatch.setattr(Launcher, "_command", note_and_command)
        launcher.start((spec,))
        assert launcher.running(RESOURCE_MANAGER)
