"""Whole missions on real managers, in one process and virtual time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from toy_drone import ToyDrone, make_toy_drone

from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.missions.mapping import MISSION
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Answer, Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.managers.data_manager import make_data_manager
from skillwing.services.managers.resource_manager import make_resource_manager
from skillwing.services.protocol import (
    GoalStatus,
    Keys,
    MissionStatus,
    QueryStates,
    Record,
    ResourceStates,
    TreeSnapshot,
    decode,
    encode,
)

ROOT = next(folder for folder in Path(__file__).parents if (folder / "pyproject.toml").exists())
M600_FILE = ROOT / "services/skillwing/m600/m600.skillset"
M600 = load(M600_FILE)
KEYS = Keys(M600.name)
ROUTE = ((20.0, 0.0, 4.0), (20.0, 10.0, 4.0), (0.0, 0.0, 4.0))
IDLE = {
    "axes_authority": "AVAILABLE",
    "heading_authority": "AVAILABLE",
    "depthmap_source": "NONE",
    "slam_status": "IDLE",
}
AWAY, BACK = ("SDK_authority", "UNAVAILABLE"), ("SDK_authority", "AVAILABLE")
"""Reports of the drone when the safety pilot takes it, and when the pilot gives it back."""


class Flight:
    """A robot that is up, a mission that is about to start, and an observer that stores all messages."""

    def __init__(
        self,
        *,
        seed: int = 0,
        mission: Mission = MISSION,
        poles: tuple[tuple[float, float], ...] = (),
        ready_timeout: float = 30.0,
        owner_grace: float = 0.0,
        network: InProcessNetwork | None = None,
        **options: Any,
    ) -> None:
        self.network = network or InProcessNetwork(seed=seed, jitter=0.002)
        self.drone = ToyDrone(M600, poles)
        self.records: list[Record] = []
        self.statuses: list[MissionStatus] = []
        self.trees: list[TreeSnapshot] = []
        self.goals: dict[str, GoalStatus] = {}
        self.started: list[str] = []
        self.states: dict[str, str] = {}
        self.buses: dict[str, Bus] = {}
        self.observer = self.network.bus("observer")
        follow_records(self.observer, KEYS, self.records.append, self._follow)
        self._watch(KEYS.mission_status, MissionStatus, self.statuses.append)
        self._watch(KEYS.mission_tree, TreeSnapshot, self.trees.append)
        managers = [
            make_data_manager({"skillset": str(M600_FILE)}),
            make_resource_manager({"skillset": str(M600_FILE), "contended": False}),
        ]
        for node in (*managers, *make_toy_drone(M600, self.drone)):
            self.buses[node.name] = self.network.attach(node)
        given = {"route": ROUTE, **options} if mission is MISSION else options
        self.node = MissionNode(
            *(mission, M600, mission.read_options(given)),
            rescue_goal=ROBOT.rescue_goal,
            ready_timeout=ready_timeout,
            owner_grace=owner_grace,
        )
        self.buses[self.node.name] = self.network.attach(self.node)

    def _watch(self, key: str, kind: Any, take: Callable[[Any], None]) -> None:
        self.observer.subscribe(key, lambda sample: take(decode(sample.payload, kind)), events=True)

    def _follow(self, status: GoalStatus) -> None:
        if status.goal_id not in self.goals:
            self.started.append(status.skill)
        self.goals[status.goal_id] = status

    def at(self, t: float, action: Callable[[], None]) -> None:
        self.observer.after(t, action)

    def until(self, done: Callable[[], bool], timeout: float = 60.0) -> None:
        assert self.network.run_until(done, timeout), f"still {self.node.status} at {self.network.now():.1f} s"

    def fly(self, timeout: float = 400.0) -> MissionStatus:
        """Run until the mission is over and all goals have settled; then the robot has to be idle."""
        self.until(lambda: self.node.over, timeout)
        self.network.run_for(3.0)
        self.observer.ask(KEYS.resource_states, encode(QueryStates()), self._take_states)
        self.network.run_for(0.5)
        assert self.statuses[-1] == self.node.status
        return self.node.status

    def _take_states(self, answer: Answer) -> None:
        self.states = decode(answer.payload, ResourceStates).states

    @property
    def idle(self) -> bool:
        """Every resource that skills take is free, every goal has ended, and nothing is commanded any more."""
        ended = all(goal.terminal is not None for goal in self.goals.values())
        return ended and all(self.states[resource] == state for resource, state in IDLE.items())

    @property
    def on_ground(self) -> bool:
        return self.drone.position[2] == 0.0

    def ends(self, skill: str) -> list[str]:
        """Terminal labels of a skill's goals, in the order of their starts."""
        return [goal.terminal.label for goal in self.goals.values() if goal.skill == skill and goal.terminal]

    def chain(self, record: Record) -> list[Record]:
        """A record and its causes, back to the first one."""
        by_id = {each.id: each for each in self.records}
        found = [record]
        while (cause := found[-1].cause) is not None:
            found.append(by_id[cause])
        return found
