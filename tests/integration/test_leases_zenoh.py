"""Leases over real Zenoh: processes that freeze, and a router that dies under everybody."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Node, Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.managers.leased_core import GRANT_LEASE
from skillwing.services.managers.liveliness_monitor import LOSS_DEBOUNCE
from skillwing.services.mocking import MockRun, MockScript, make_mock_managers
from skillwing.services.names import skill_process
from skillwing.services.processes.router import LOOPBACK
from skillwing.services.protocol import Keys, State
from skillwing.services.testing import SkillsetProcesses

pytestmark = pytest.mark.slow

WINCH = """
skillset winch {
    resource rope { initial FREE  FREE -> TAKEN  TAKEN -> FREE }
    skill pull {
        effect { take: rope -> TAKEN  release: rope -> FREE }
        precondition { free: resource=(rope == FREE)  success take }
        interrupt { apply=release timeout=2.0 }
        result { PULLED: apply=release }
    }
}
"""
SCRIPT = "[skill.pull]\ndelay = 600.0\n"
TOPOLOGIES: tuple[Topology, ...] = ("router", "mesh")
PATIENCE = 20.0
"""Seconds for what takes about two of them, on a machine that is busy."""


@pytest.fixture(scope="module")
def winch(mocked: Callable[[str, str], SkillsetProcesses]) -> SkillsetProcesses:
    """End the goal of the client that has one running."""
    return mocked(WINCH, SCRIPT)


@contextmanager
def frozen(pid: int) -> Iterator[None]:
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def test_a_frozen_manager_loses_its_goal_and_learns_of_it_when_it_wakes_up(winch: SkillsetProcesses) -> None:
    goal = winch.start_skill("pull")
    with frozen(winch.launcher.pids[skill_process("pull")]):
        winch.assert_states(rope="FREE", within=PATIENCE)
        goal.assert_ended("LOST", within=PATIENCE)
    # Awake again it gives up what it was about, and then takes a new goal.
    deadline = time.monotonic() + PATIENCE
    while (goal := winch.start_skill("pull")).state is not State.RUNNING:
        assert time.monotonic() < deadline, goal
    winch.assert_states(rope="TAKEN")
    goal.interrupt().assert_ended("IT")


OWNER = """
import sys
from skillwing.dsl import load
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.client.interface import SkillsetInterface
bus = ZenohBus("owner", "winch", sys.argv[1])
client = SkillsetInterface(bus, load(sys.argv[2]), client="owner", owns_goals=True)
client.start("pull", {}, goal_id="owned")
bus.run_until(lambda: False)
"""


def test_a_client_that_freezes_loses_the_goals_it_owns(winch: SkillsetProcesses) -> None:
    skillset = winch.launcher.run_dir.parent / "winch.skillset"
    process = subprocess.Popen([sys.executable, "-c", OWNER, winch.launcher.endpoint, str(skillset)])
    try:
        winch.assert_states(rope="TAKEN", within=PATIENCE)
        with frozen(process.pid):
            winch.assert_states(rope="FREE", within=PATIENCE)
    finally:
        process.kill()
        process.wait()


# --- a router that dies ----------------------------------------------------------------------------------------------


class Robots:
    """The managers of a winch and a client on one router, which the test kills: each node on a thread of its own.

    topology: of the managers, and the robot's name. The client, who owns its goals, is one of the router like any that
    comes from outside.
    """

    def __init__(self, endpoint: str, topology: Topology) -> None:
        self._topology: Topology = topology
        skillset = parse(WINCH, "winch.skillset")
        script = MockScript(skills={"pull": (MockRun(delay=600.0),)})
        self.keys = Keys("winch")
        self._over = False
        self._threads: list[threading.Thread] = []
        self._buses: list[ZenohBus] = []
        self.client_bus = ZenohBus("client", topology, endpoint)
        self.client = SkillsetInterface(self.client_bus, skillset, client="client", owns_goals=True)
        for number in range(len(make_mock_managers(skillset, script))):
            self._run(lambda number=number: make_mock_managers(skillset, script)[number], endpoint)

    def _run(self, make: Callable[[], Node], endpoint: str) -> None:
        def live() -> None:
            node = make()
            bus = ZenohBus(node.name, self._topology, endpoint, topology=self._topology)
            self._buses.append(bus)
            node.attach(bus)
            bus.run_until(lambda: self._over)
            bus.close()

        self._threads.append(threading.Thread(target=live, daemon=True))
        self._threads[-1].start()

    def wait_until(self, condition: Callable[[], bool]) -> None:
        assert self.client_bus.run_until(condition, PATIENCE)

    def close(self) -> None:
        self._over = True
        self.client_bus.close()
        for bus in self._buses:
            bus.post(lambda: None)  # who waits for messages looks up
        for thread in self._threads:
            thread.join(PATIENCE)


@contextmanager
def router_at(endpoint: str = LOOPBACK) -> Iterator[str]:
    command = [sys.executable, "-m", "skillwing.services.processes.router", "--listen", endpoint]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()


def test_a_router_that_is_back_within_some_seconds_costs_nobody_a_goal() -> None:
    """However its managers meet: both robots go through the same seconds."""
    longer_than_any_lease = GRANT_LEASE + LOSS_DEBOUNCE + 1.0
    with ExitStack() as cleaning:
        with router_at() as endpoint:
            robots = [cleaning.enter_context(closing(Robots(endpoint, topology))) for topology in TOPOLOGIES]
            goals = [crew.client.start("pull", {}) for crew in robots]
            for crew, goal in zip(robots, goals, strict=True):
                crew.wait_until(lambda goal=goal: goal.state is State.RUNNING)
        for crew in robots:
            crew.wait_until(lambda crew=crew: not crew.client_bus.connected)
        live_on(robots, longer_than_any_lease)
        with router_at(endpoint):
            for crew in robots:
                crew.wait_until(lambda crew=crew: crew.client_bus.connected)
            live_on(robots, longer_than_any_lease)
            for crew, goal in zip(robots, goals, strict=True):
                assert goal.state is State.RUNNING
                assert crew.client.states["rope"] == "TAKEN"
                crew.client.interrupt(goal)
                crew.wait_until(lambda goal=goal: goal.done)
                assert goal.terminal is not None
                assert goal.terminal.label == "IT"
                crew.wait_until(lambda crew=crew: crew.client.states["rope"] == "FREE")
            cleaning.close()


def live_on(robots: Sequence[Robots], seconds: float) -> None:
    """Let wall time pass, with the clients at work."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for crew in robots:
            crew.client_bus.run_until(lambda: False, 0.02)
