"""Bad input to real processes over Zenoh: they survive, answer, and keep their memory bounded."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from unittest.mock import patch

import psutil
from endpoints import KEYS, PUBLICATIONS, QUERIES, SKILLSET, WORDS, Endpoint
from payloads import HUGE_SIZES, huge, payload

from skillwing.m600.robot import ROBOT
from skillwing.onboard.topics import faults, flight, guidance, mapping, obstacles, sensors, video
from skillwing.services.bus import Answer, Answered, NoReply, Publisher, Refused
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.mocking.system import mock_processes
from skillwing.services.processes.launcher import Launcher
from skillwing.services.protocol import (
    BeginGoal,
    ErrorCode,
    InterruptGoal,
    QueryData,
    QueryGoal,
    QueryStates,
    Record,
    RecordKind,
    StartGoal,
    encode,
)
from skillwing.services.robot import ProcessSpec

GIVE_BACK = {"MALLOC_MMAP_THRESHOLD_": str(32 * 1024), "MALLOC_TRIM_THRESHOLD_": str(128 * 1024)}
"""Environment in which glibc returns freed memory to the system at once, so that resident memory is held memory.

By default glibc keeps the memory of freed messages for later. A bridge that had taken up 100 MB of them stayed 90 MB
larger, although it held none of them any more.
"""
ANSWER_WITHIN = 10.0
"""Wall seconds after which an unanswered question counts as silence."""
OF_ABSENT_PROCESSES = (
    *(KEYS.mission_abort, KEYS.mission_pause, KEYS.mission_resume, KEYS.mission_start, KEYS.mission_status),
    KEYS.mocked_world,
)
"""Questions to processes that do not run here: mission, launcher and mocks."""
MANAGERS = ("data_manager", "resource_manager", "skill/takeoff")


def managers_and_guidance() -> tuple[ProcessSpec, ...]:
    """One process of each kind that needs no physics: the managers, a mocked skill, the bridge and guidance."""
    flown = {spec.name: spec for spec in (*ROBOT.functional_layer({}), *ROBOT.managers())}
    mocked = {spec.name: spec for spec in mock_processes(ROBOT, skills=["takeoff"])}
    return (*(mocked[name] for name in MANAGERS), flown["skill/hover"], flown["bridge"], flown["guidance"])


def everything(run_dir: Path) -> tuple[ProcessSpec, ...]:
    """All processes of a flying m600, except the mission."""
    options = {"seed": 1, "run_dir": str(run_dir)}
    return (*ROBOT.functional_layer(options), *ROBOT.managers(), *ROBOT.observers(options))


@dataclass
class Outcome:
    """Result of fuzzing. internal: answers with the code INTERNAL. memory: MB of each process before and after."""

    thrown: int = 0
    answered: int = 0
    refused: int = 0
    silent: tuple[str, ...] = ()
    internal: tuple[str, ...] = ()
    died: tuple[str, ...] = ()
    deaf: tuple[str, ...] = ()
    memory: dict[str, tuple[float, float]] | None = None

    @property
    def growth(self) -> float:
        """The largest growth of a process's memory in MB."""
        return max(after - before for before, after in (self.memory or {"none": (0.0, 0.0)}).values())


class Thrower:
    """A sender of bad input on the network of running processes."""

    def __init__(self, launcher: Launcher, processes: Collection[str], seed: int) -> None:
        self._launcher = launcher
        self._random = Random(seed)
        self._bus = ZenohBus("stranger", ROBOT.name, launcher.endpoint)
        self._publishers: dict[str, Publisher] = {}
        self._pids = {name: pid for name, pid in launcher.pids.items() if name in processes}
        self._silent: list[str] = []
        self._internal: list[str] = []
        self.outcome = Outcome()
        skills = {name.removeprefix("skill/") for name in processes if name.startswith("skill/")}
        self._questions = [each for each in QUERIES if self._is_served(each, processes, skills)]
        self._wait_until_reachable()
        self._before = self._memory()

    def close(self) -> None:
        self._bus.close()

    def _wait_until_reachable(self) -> None:
        """Ask on each key until it is answered: a token is seen before the queries of its process are reachable."""
        deadline = time.monotonic() + ANSWER_WITHIN
        for endpoint in self._questions:
            while isinstance(self._ask_raw(endpoint.key, b""), NoReply):
                assert time.monotonic() < deadline, f"nobody answers on {endpoint.key}"
        self.outcome = Outcome()

    # --- what is thrown ----------------------------------------------------------------------------------------------

    def throw(self, count: int) -> None:
        """Send payloads of every sort to all keys in turn."""
        endpoints = (*self._questions, *PUBLICATIONS)
        for number in range(count):
            endpoint = endpoints[number % len(endpoints)]
            content = payload(self._random, endpoint.kind, WORDS)
            if endpoint.array:
                self._put(endpoint.key, self._random.randbytes(64), content)
            elif endpoint in PUBLICATIONS:
                self._put(endpoint.key, content, b"stray" if number % 17 == 0 else b"")
            else:
                self._ask(endpoint, content)

    def throw_huge(self) -> None:
        """Send messages with one field of the size limit, and beyond it, to every key."""
        for endpoint in (*self._questions, *PUBLICATIONS):
            content = huge(self._random, endpoint.kind, self._random.choice(HUGE_SIZES))
            if endpoint in PUBLICATIONS:
                self._put(endpoint.key, content)
            else:
                self._ask(endpoint, content)

    def flood(self, count: int) -> None:
        """Send valid messages, each with a new id. A process that remembers all of them grows."""
        begin = {"inputs": {}, "manager": "skill/hover", "owner": "x", "schema": SKILLSET.schema_hash}
        for number in range(count):
            name = f"{number:08x}-" + "f" * 80
            start = StartGoal(goal_id=name, inputs={}, client="x", schema=SKILLSET.schema_hash, owner=name)
            interrupt = InterruptGoal(goal_id=name, client="x")
            record = Record(
                id=name, t=0.0, source=name, kind=RecordKind.HEALTH, subject=name, before=None, after="OK", goal_id=name
            )
            health = sensors.Health(id=name, t=0.0, sensor=name, status=sensors.SensorStatus.OK, cause=name)
            self._put(KEYS.timeline, encode(record))
            self._put(sensors.health_key("zed"), encode(health))
            self._ask_raw(KEYS.start("takeoff"), encode(start))
            self._ask_raw(KEYS.interrupt("takeoff"), encode(interrupt))
            self._ask_raw(KEYS.resource_goal, encode(BeginGoal(goal_id=name, skill="hover", **begin)))

    # --- what came of it ---------------------------------------------------------------------------------------------

    def verdict(self) -> Outcome:
        """Ask good questions, and examine the processes."""
        good = {
            "resource_manager": (KEYS.resource_states, QueryStates()),
            "data_manager": (KEYS.data("battery"), QueryData()),
            "skill/takeoff": (KEYS.goal("takeoff"), QueryGoal()),
        }
        deaf: list[str] = []
        for process, (key, question) in good.items():
            if process in self._pids and not isinstance(self._ask_raw(key, encode(question)), Answered | Refused):
                deaf.append(process)
        out = self.outcome
        out.silent, out.internal, out.deaf = tuple(self._silent), tuple(self._internal), tuple(deaf)
        out.died = tuple(
            name
            for name, pid in self._pids.items()
            if self._launcher.pids[name] != pid or not self._launcher.running(name)
        )
        after = self._memory()
        out.memory = {name: (before, after.get(name, 0.0)) for name, before in self._before.items()}
        return out

    def _memory(self) -> dict[str, float]:
        """Memory that each process holds, in MB (see `GIVE_BACK`)."""
        found: dict[str, float] = {}
        for name, pid in self._pids.items():
            if psutil.pid_exists(pid):
                found[name] = psutil.Process(pid).memory_info().rss / 1e6
        return found

    # --- sending -----------------------------------------------------------------------------------------------------

    def _is_served(self, endpoint: Endpoint, processes: Collection[str], skills: Collection[str]) -> bool:
        """True if one of the processes serves the key."""
        servers = {
            faults.FAULT: "sim",
            faults.FAULTS: "sim",
            flight.PILOT: "sim",
            guidance.GUIDANCE_COMMAND: "guidance",
            obstacles.OBSTACLE_COMMAND: "obstacles",
            obstacles.LANDING_PLACE: "obstacles",
            mapping.MAPPING_COMMAND: "mapping",
            mapping.MAP_SNAPSHOT: "mapping",
            video.CAMERA_COMMAND: "sim",
            video.VIDEO_COMMAND: "video",
            faults.LINK_FAULT: "link",
        }
        if endpoint.key in servers:
            return servers[endpoint.key] in processes
        if endpoint.key in OF_ABSENT_PROCESSES:
            return False
        parts = endpoint.key.split("/")
        if "mock" in parts:
            return False
        return parts[2] in skills if "skill" in parts else True

    def _put(self, key: str, content: bytes, attachment: bytes = b"") -> None:
        if key not in self._publishers:
            self._publishers[key] = self._bus.advertise(key)
        self.outcome.thrown += 1
        self._publishers[key].put(content, attachment)

    def _ask(self, endpoint: Endpoint, content: bytes) -> None:
        if not isinstance(self._ask_raw(endpoint.key, content), Answered | Refused):
            self._silent.append(f"{endpoint.key} {content[:100]!r}")

    def _ask_raw(self, key: str, content: bytes) -> Answer:
        answers: list[Answer] = []
        self.outcome.thrown += 1
        self._bus.ask(key, content, answers.append, timeout=ANSWER_WITHIN)
        self._bus.run_until(lambda: bool(answers))
        self.outcome.answered += isinstance(answers[0], Answered)
        if isinstance(answers[0], Refused):
            self.outcome.refused += 1
            if answers[0].error.code == ErrorCode.INTERNAL:
                self._internal.append(f"{key} {content[:100]!r}: {answers[0].error.message}")
        return answers[0]


def fuzz(
    specs: Sequence[ProcessSpec],
    run_dir: Path,
    act: Callable[[Thrower], None],
    *,
    seed: int = 0,
) -> Outcome:
    """Start processes, let `act` send bad input, and return the result."""
    launched = Launcher(ROBOT.name, SKILLSET.name, run_dir, clock="wall")
    with patch.dict(os.environ, GIVE_BACK), launched as launcher:
        launcher.start(specs)
        thrower = Thrower(launcher, [spec.name for spec in specs], seed)
        try:
            act(thrower)
            return thrower.verdict()
        finally:
            thrower.close()
