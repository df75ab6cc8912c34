"""Other layouts than a process for each manager round one router: what holds there, with real processes."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from pump import PUMP

from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER
from skillwing.services.processes.colocation import MANAGERS, colocated
from skillwing.services.processes.launcher import ROUTER, Launcher
from skillwing.services.processes.lifetime import EXIT_OK
from skillwing.services.robot import Robot
from skillwing.services.testing import SkillsetProcesses

pytestmark = pytest.mark.slow

SCRIPT = "[skill.fill]\ndelay = 3600.0\n[skill.drain]\ndelay = 3600.0\n"
"""Skills run until they are interrupted."""
LEASE_AND_MORE = 20.0
POLL = 0.02

Make = Callable[..., SkillsetProcesses]


@pytest.fixture
def skillset(tmp_path: Path) -> Path:
    path = tmp_path / "pump.skillset"
    path.write_text(PUMP, encoding="utf-8")
    return path


@pytest.fixture
def pumps(tmp_path: Path, skillset: Path) -> Iterator[Make]:
    """Makes running pumps; when the test is over, none of their processes is left."""
    script = tmp_path / "pump.toml"
    script.write_text(SCRIPT, encoding="utf-8")
    made: list[SkillsetProcesses] = []

    def make(**layout: object) -> SkillsetProcesses:
        pump = SkillsetProcesses(skillset, run_dir=tmp_path / "run", scripts=[script], **layout)  # pyright: ignore[reportArgumentType]
        made.append(pump)
        return pump

    yield make
    for pump in made:
        processes = [psutil.Process(pid) for pid in pump.launcher.pids.values() if psutil.pid_exists(pid)]
        pump.close()
        assert psutil.wait_procs(processes, timeout=0)[1] == []


def test_managers_that_share_a_process_die_and_come_back_together(pumps: Make, tmp_path: Path) -> None:
    pump = pumps(colocate=True)
    assert set(pump.launcher.pids) == {ROUTER, RESOURCE_MANAGER, MANAGERS}
    shared = next(state for state in pump.launcher.states if state.name == MANAGERS)
    assert shared.nodes == (DATA_MANAGER, "skill/fill", "skill/drain")

    goal = pump.start_skill("fill")
    pump.assert_states(valve="OPEN")
    pump.kill(MANAGERS)
    goal.assert_ended("LOST")
    pump.assert_states(valve="SHUT", within=LEASE_AND_MORE)

    pump.restart(MANAGERS)
    pump.start_skill("drain").interrupt().assert_ended("IT")
    again = pump.start_skill("fill")
    pump.assert_states(valve="OPEN")
    again.interrupt().assert_ended("IT")

    earlier = len(pump.launcher.exits)
    psutil.Process(pump.launcher.pids[MANAGERS]).terminate()
    # Nothing on the bus tells that a process has been reaped.
    while len(pump.launcher.exits) == earlier:
        pump.run(POLL)
    assert pump.launcher.exits[-1].exit_code == EXIT_OK
    log = (tmp_path / "run" / "logs" / f"{MANAGERS}.log").read_text(encoding="utf-8")
    assert all(f"[{node}] skillwing.node_host: {node} ended" in log for node in shared.nodes)


def test_peers_need_the_router_only_to_meet(pumps: Make) -> None:
    """Goals run without it, and processes notice each other's exit or freeze."""
    pump = pumps(topology="mesh")
    pump.kill(ROUTER)
    assert pump.bus.connected
    pump.start_skill("fill").interrupt().assert_ended("IT")
    goal, other = pump.start_skill("fill"), pump.start_skill("drain")
    pump.assert_states(valve="OPEN")
    pump.kill("skill/fill")
    goal.assert_ended("LOST")
    pump.assert_states(valve="SHUT", within=LEASE_AND_MORE)

    frozen = pump.launcher.pids["skill/drain"]
    os.kill(frozen, signal.SIGSTOP)
    try:
        other.assert_ended("LOST")
    finally:
        os.kill(frozen, signal.SIGCONT)


def test_robots_share_a_router_and_not_their_ends(tmp_path: Path, skillset: Path) -> None:
    def started(robot: str, router: str | None = None) -> Launcher:
        launcher = Launcher(robot, "pump", tmp_path / robot, clock="wall", router=router)
        with ExitStack() as undoing:
            undoing.callback(launcher.stop)
            launcher.start(colocated(Robot(robot, skillset, {}, clock="wall").managers()))
            undoing.pop_all()
        return launcher

    with started("first") as first:
        with started("second", first.endpoint) as second:
            assert second.endpoint == first.endpoint
            assert set(second.pids) == {RESOURCE_MANAGER, MANAGERS}
            processes = [psutil.Process(pid) for pid in second.pids.values()]
        assert psutil.wait_procs(processes, timeout=0)[1] == []
        assert all(first.running(name) for name in (ROUTER, RESOURCE_MANAGER, MANAGERS))
        assert first.exits == []
