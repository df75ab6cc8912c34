"""The whole m600 and its mocks in one process and virtual time: every callback that raises is a finding.

On a real bus such an exception ends the process.
"""

from __future__ import annotations

import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import cast

import msgspec
from endpoints import KEYS, QUERIES, SKILLSET, WORDS, Endpoint
from payloads import HUGE_SIZES, huge, payload

from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Answer, Answered, Bus, Node, NoReply, Publisher, Refused
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork, Namespace
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.mocking.script import MockScript, Reaction, When
from skillwing.services.mocking.system import make_mock_managers
from skillwing.services.mocking.world import MockWorld
from skillwing.services.options import imported
from skillwing.services.processes.launcher_node import LauncherNode
from skillwing.services.processes.process_state import ProcessState
from skillwing.services.protocol import ErrorCode, QueryGoal, QueryStates, ResourceStates, decode, encode
from skillwing.services.robot import ProcessSpec

ROUTE = ((20.0, 0.0, 4.0), (0.0, 0.0, 4.0))
REAL, MOCKED = "real", "mocked"
GAP = 0.005
"""Virtual seconds from one payload to the next."""


def made(spec: ProcessSpec) -> Node:
    """The node that a process of the table would host."""
    return imported({"factory": spec.factory}, "factory")(spec.resolved().options)


@dataclass
class NoLauncher:
    """A launcher that starts nothing."""

    run_dir: Path
    states: tuple[ProcessState, ...] = ()

    def launch(self, spec: ProcessSpec, log: str) -> None:
        del spec, log

    def forget(self, name: str) -> None:
        del name


class Follower:
    """A client that follows a goal of each skill: only such a client hears feedback."""

    name = "follower"
    owns_clock = False

    def attach(self, bus: Bus) -> None:
        interface = SkillsetInterface(bus, SKILLSET, client=self.name)
        for number, skill in enumerate(SKILLSET.skills, 1):
            interface.follow(skill.name, f"goal-{number}")

    def detach(self) -> None:
        pass


def nodes_of_the_m600(run_dir: Path) -> list[Node]:
    """All processes of a flying m600, with the recorder, a mission and observers."""
    options = {"run_dir": str(run_dir), "seed": 1}
    specs = (*ROBOT.functional_layer(options), *ROBOT.managers(), *ROBOT.observers(options))
    route = MISSION.read_options({"route": ROUTE})
    mission = MissionNode(MISSION, SKILLSET, route, rescue_goal=ROBOT.rescue_goal)
    launcher = LauncherNode(NoLauncher(run_dir), ROBOT, SKILLSET.name, {})
    return [*(made(spec) for spec in specs), mission, launcher, Follower()]


def nodes_of_the_mocked_m600() -> list[Node]:
    """The same skillset with mocks, and a world that reacts to goals and resources."""
    events = (When(starts="hover"), When(ends="hover"), When(resource="battery_status", becomes="CRITICAL"))
    script = MockScript(reactions=tuple(Reaction(when=each, set={"battery": 50.0}) for each in events))
    return [*make_mock_managers(SKILLSET), MockWorld(SKILLSET, script)]


@dataclass(frozen=True)
class Finding:
    """A callback that raised, and the payloads before it."""

    endpoint: str
    payload: bytes
    error: str

    def __str__(self) -> str:
        return f"{self.endpoint} {self.payload[:300]!r}\n{self.error}"


class FuzzStage:
    """Two robots that get bad input, and the results."""

    def __init__(self, robots: dict[str, Iterable[Node]]) -> None:
        self.network = InProcessNetwork()
        self.findings: list[Finding] = []
        self.silent: list[str] = []
        self.internal: list[str] = []
        self.thrown = 0
        self.refused = 0
        self._buses: dict[str, Bus] = {}
        self._publishers: dict[tuple[str, str], Publisher] = {}
        self._last = ("", b"")
        for robot, nodes in robots.items():
            for node in nodes:
                self.network.attach(node, robot)
            self._buses[robot] = self.network.bus("stranger", robot)
        self.run(1.0)

    def throw(self, random: Random, endpoint: Endpoint) -> None:
        """Send one payload to every robot."""
        self._send(random, endpoint, payload(random, endpoint.kind, WORDS))

    def throw_huge(self, random: Random, endpoint: Endpoint) -> None:
        """Send a message with one field of the size limit, or beyond it, to every robot."""
        self._send(random, endpoint, huge(random, endpoint.kind, random.choice(HUGE_SIZES)))

    def _send(self, random: Random, endpoint: Endpoint, content: bytes) -> None:
        data, attachment = content, b""
        if endpoint.array:
            data, attachment = random.randbytes(random.choice([0, 1, 64, 4096])), content
        elif random.random() < 0.05:
            attachment = random.randbytes(20)
        self._last = (endpoint.key, content)
        self.thrown += 1
        for robot in self._buses:
            if endpoint in QUERIES:
                self._ask(robot, endpoint, data, attachment)
            else:
                self._publisher(robot, endpoint.key).put(data, attachment)
        self.run(GAP)

    def run(self, seconds: float) -> None:
        """Run for some virtual time, also after exceptions."""
        deadline = self.network.now() + seconds
        while self.network.now() < deadline:
            try:
                self.network.run_for(deadline - self.network.now())
            except Exception:  # noqa: BLE001 - a finding
                self.findings.append(Finding(*self._last, traceback.format_exc()))

    def served(self) -> set[str]:
        """The key expressions of all services."""
        return {each.key_expression for robot in self._buses for each in self._robot(robot).services}

    def subscribed(self) -> set[str]:
        """The key expressions of all subscriptions."""
        return {each.key_expression for robot in self._buses for each in self._robot(robot).subscriptions}

    def answers_well(self, robot: str) -> bool:
        """True if the resource manager and the skill managers still answer good questions."""
        answers: list[Answer] = []
        self._buses[robot].ask(KEYS.resource_states, encode(QueryStates()), answers.append)
        for skill in SKILLSET.skills:
            self._buses[robot].ask(KEYS.goal(skill.name), encode(QueryGoal(goal_id="nobody's")), answers.append)
        self.run(0.1)
        told = [answer for answer in answers if isinstance(answer, Answered)]
        codes = [answer.error.code for answer in answers if isinstance(answer, Refused)]
        states = decode(told[0].payload, ResourceStates).states if told else {}
        knows_all = states.keys() == {resource.name for resource in SKILLSET.resources}
        return knows_all and codes == [ErrorCode.UNKNOWN_GOAL] * len(SKILLSET.skills)

    def start(self, robot: str, skill: str, fields: object) -> Answer:
        """The answer to a start of a skill with these fields."""
        answers: list[Answer] = []
        self._buses[robot].ask(KEYS.start(skill), msgspec.msgpack.encode(fields), answers.append)
        self.run(0.1)
        (answer,) = answers
        return answer

    def _ask(self, robot: str, endpoint: Endpoint, data: bytes, attachment: bytes) -> None:
        served = self._robot(robot).services.covering(endpoint.key)

        def on_answer(answer: Answer) -> None:
            if isinstance(answer, NoReply) and served:
                self.silent.append(f"{endpoint.key} {data[:200]!r}")
            elif isinstance(answer, Refused):
                self.refused += 1
                if answer.error.code == ErrorCode.INTERNAL:
                    self.internal.append(f"{endpoint.key} {data[:200]!r}: {answer.error.message}")

        self._buses[robot].ask(endpoint.key, data, on_answer, attachment=attachment)

    def _robot(self, robot: str) -> Namespace:
        return cast(InProcessBus, self._buses[robot]).robot

    def _publisher(self, robot: str, key: str) -> Publisher:
        if (robot, key) not in self._publishers:
            self._publishers[robot, key] = self._buses[robot].advertise(key)
        return self._publishers[robot, key]
