"""Three stages of the workbench: managers around a developer's hooks, mocks, and mocks as processes over Zenoh."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from faulty_network import FaultyNetwork
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Node, RunnableBus, Topology
from skillwing.services.bus.inprocess import InProcessBus
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.hook_bus import HookBus
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.mocking import MockRun, make_mock_skill
from skillwing.services.mocking.script_file import load_scripts
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.processes.colocation import MANAGERS
from skillwing.services.protocol import DirectMock, Keys, MockCall, ResetMock, encode
from skillwing.services.testing import SkillsetProcesses
from skillwing.services.testing.context import model_of

WORKBENCH = Path(__file__).with_name("workbench.skillset")
SCRIPT = WORKBENCH.with_suffix(".mock.toml")
ATTEMPTS = 50
"""Calls after which a mock counts as unreachable."""


class PlannedHooks(SkillHooks[dict[str, Any], dict[str, Any], dict[str, Any]]):
    """Hooks that follow a plan, with a developer's mistakes: they raise, and their timers outlive their goals."""

    def __init__(self, skill: str) -> None:
        self.skill = skill  # pyright: ignore[reportAttributeAccessIssue]
        self.plans: deque[MockRun] = deque()
        self._run = MockRun(forever=True)

    def validate(self, goal: Goal[dict[str, Any]]) -> str | None:
        if self.plans and self.plans[0].invalid is not None:
            return self.plans.popleft().invalid
        return None

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self._run = self.plans.popleft() if self.plans else MockRun(forever=True)
        if not self._run.forever:
            assert isinstance(self._run.delay, float)
            self.bus.after(self._run.delay, lambda run=self._run: self._end(goal.id, run))

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, Any] | None:
        return {"reached": self.bus.now() - goal.started_at} if self.skill == "grip" else None

    def on_interrupt(self, goal: Goal[dict[str, Any]]) -> None:
        if self._run.stop_delay != "never":
            self.bus.after(self._run.stop_delay, lambda: self.interrupted(goal.id))

    def end_now(self, result: str) -> None:
        assert self.current is not None
        self.terminated(self.current.id, result)

    def _end(self, goal_id: str, run: MockRun) -> None:
        if run.error is not None:
            raise RuntimeError(run.error)
        assert run.result is not None
        self.terminated(goal_id, run.result, run.output or None)


class InProcessStage:
    """Real managers in virtual time. mocked: True for mocks as skills, instead of hooks written by hand."""

    apart = True

    def __init__(self, *, mocked: bool) -> None:
        self.skillset: Skillset = model_of(WORKBENCH)
        self._mocked = mocked
        self._network = FaultyNetwork()
        self._journal = Journal(None, Identity("", self.skillset.name, self.skillset.schema_hash))
        self._running: dict[str, InProcessBus] = {}
        self._frozen: set[str] = set()
        self._hung: set[str] = set()
        self._hooks: dict[str, PlannedHooks] = {}
        self._names = [RESOURCE_MANAGER, DATA_MANAGER, *(skill_process(each.name) for each in self.skillset.skills)]
        for name in self._names:
            self.restart(name)

    def bus(self, name: str) -> RunnableBus:
        return self._network.bus(name)

    def plan(self, skill: str, run: MockRun) -> None:
        if self._mocked:
            direct(self._network.bus("director"), Keys(self.skillset.name), skill, direction(run, "next"))
        else:
            self._hooks[skill].plans.append(run)

    def end_now(self, skill: str, result: str) -> None:
        if self._mocked:
            run = MockRun(result=result, delay=0.0)
            direct(self._network.bus("director"), Keys(self.skillset.name), skill, direction(run, "now"))
        else:
            self._hooks[skill].end_now(result)

    def kill(self, process: str) -> None:
        self._running.pop(process).close()

    def restart(self, process: str) -> None:
        bus = self._network.bus(process)
        assert isinstance(bus, InProcessBus)
        self._running[process] = bus

        def hear(name: str, callback: Callable[[], None]) -> None:
            del name
            if process not in self._hung:
                callback()

        node = self._node(process)
        node.attach(HookBus(bus, hear) if process.startswith("skill/") else bus)

    def freeze(self, process: str) -> None:
        self._frozen.add(process)
        self._network.stop(self._running[process])

    def thaw(self, process: str) -> None:
        self._frozen.remove(process)
        self._network.wake(self._running[process])

    def hang(self, skill: str) -> None:
        self._hung.add(skill_process(skill))

    def tidy(self) -> None:
        for process in tuple(self._hung):
            self.kill(process)
            self._hung.remove(process)
        for process in tuple(self._frozen):
            self.thaw(process)
        for process in self._names:
            if process not in self._running:
                self.restart(process)

    def close(self) -> None:
        """Do nothing: the stage has no processes and no sessions."""

    def _node(self, process: str) -> Node:
        match process:
            case "resource_manager":
                return ResourceManagerNode(self.skillset, journal=self._journal)
            case "data_manager":
                return DataManagerNode(self.skillset)
            case _:
                skill = process.removeprefix("skill/")
                if self._mocked:
                    return make_mock_skill(self.skillset, skill, load_scripts([SCRIPT], self.skillset))
                self._hooks[skill] = PlannedHooks(skill)
                return SkillManagerNode(self._hooks[skill], self.skillset)


class ProcessStage:
    """Mocks as processes over Zenoh, in wall time. One system serves all cases.

    layout: `own`, a process for each manager; `colocated`, one for all but the resource manager; `mesh`, a process for
    each manager, with direct connections.
    """

    def __init__(self, run_dir: Path, layout: str = "own") -> None:
        self._topology: Topology = "mesh" if layout == "mesh" else "router"
        self.apart = layout != "colocated"
        self._system = SkillsetProcesses(
            WORKBENCH, run_dir=run_dir, scripts=[SCRIPT], colocate=not self.apart, topology=self._topology
        )
        self.skillset = self._system.skillset
        self._frozen: set[str] = set()
        self._killed: set[str] = set()
        self._hung: set[str] = set()

    def bus(self, name: str) -> RunnableBus:
        return ZenohBus(name, self.skillset.name, self._system.launcher.endpoint, topology=self._topology)

    def plan(self, skill: str, run: MockRun) -> None:
        self._direct(skill, direction(run, "next"))

    def end_now(self, skill: str, result: str) -> None:
        self._direct(skill, direction(MockRun(result=result, delay=0.0), "now"))

    def kill(self, process: str) -> None:
        process = self._host(process)
        self._killed.add(process)
        self._system.kill(process)

    def restart(self, process: str) -> None:
        process = self._host(process)
        self._killed.remove(process)
        self._system.restart(process)

    def freeze(self, process: str) -> None:
        process = self._host(process)
        self._frozen.add(process)
        os.kill(self._system.launcher.pids[process], signal.SIGSTOP)

    def thaw(self, process: str) -> None:
        process = self._host(process)
        self._frozen.remove(process)
        os.kill(self._system.launcher.pids[process], signal.SIGCONT)

    def hang(self, skill: str) -> None:
        self._hung.add(self._host(skill_process(skill)))
        self._direct(skill, direction(MockRun(hang=True, delay=0.0), "now"))

    def tidy(self) -> None:
        for process in tuple(self._hung):
            self._hung.remove(process)
            self.kill(process)
        for process in tuple(self._frozen):
            self.thaw(process)
        for process in tuple(self._killed):
            self.restart(process)
        for skill in self.skillset.skills:
            self._direct(skill.name, ResetMock())

    def close(self) -> None:
        for process in tuple(self._frozen):
            self.thaw(process)
        self._system.close()

    def _host(self, node: str) -> str:
        """Process that hosts a node."""
        shared = not self.apart and (node == DATA_MANAGER or node.startswith(skill_process("")))
        return MANAGERS if shared else node

    def _direct(self, skill: str, call: MockCall) -> None:
        ask_mock(self._system.bus, Keys(self.skillset.name), skill, call)


def direction(run: MockRun, when: Any) -> DirectMock:
    """Message that gives a mock a run."""
    return DirectMock(run=msgspec.to_builtins(run), when=when)


def direct(bus: RunnableBus, keys: Keys, skill: str, call: MockCall) -> None:
    """Send a mock one call, and close the connection."""
    ask_mock(bus, keys, skill, call)
    bus.close()


def ask_mock(bus: RunnableBus, keys: Keys, skill: str, call: MockCall) -> None:
    """Send a mock one call, repeated until it answers."""
    answers: list[Answer] = []
    for _ in range(ATTEMPTS):
        asked = len(answers)
        bus.ask(keys.mocked_skill(skill), encode(call), answers.append, timeout=1.0)
        bus.run_until(lambda asked=asked: len(answers) > asked, 5.0)
        if answers and isinstance(answers[-1], Answered):
            return
        # A mock that was just started may be alive before it is reachable.
        bus.run_until(lambda: False, 0.1)
    raise AssertionError(f"The mock of `{skill}` does not listen: {answers}")
