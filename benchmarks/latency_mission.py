"""The measured mission of `latency.py`: a process of its own, as the mission runner makes it.

latency_system.py starts it: latency_mission.py ENDPOINT ROBOT TOPOLOGY SKILLSET_FILE
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import zenoh
from checkouts import first_module
from latency_peers import FIRE, FIRED
from peer_process import serve
from py_trees.behaviours import Success
from py_trees.composites import Sequence
from py_trees.decorators import FailureIsRunning

from skillwing.bt_missions.leaves.conditions import ResourceIs
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import GoalPhase, SkillAction
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import open_session
from skillwing.services.processes.node_host import SWITCH_INTERVAL
from skillwing.services.protocol import Terminal

missions = first_module("skillwing.bt_missions.mission.mission", "skillwing.bt_missions.running.mission")
PATIENCE = 10.0


class Watching(missions.Mission):
    """Mission that runs `hold` whenever the link is up, without end."""

    name = "watching"
    summary = "Runs a skill until its invariant is violated, and again when it can."

    def __init__(self) -> None:
        self.ended_at: float | None = None

    def build(self, context: MissionContext, options: Any) -> Any:
        self.leaf = SkillAction("hold", context, "hold", on_end=self._on_end)
        up = ResourceIs("link is up", context, "link", "UP", wait=1e6)
        again = FailureIsRunning("again", Sequence("watch", memory=True, children=[up, self.leaf]))
        return missions.MissionTrees(again, Success("nothing to rescue"), missions.Progress)

    def _on_end(self, terminal: Terminal) -> None:
        if terminal.ending == "RI":
            self.ended_at = time.monotonic()


class Watcher:
    """The node of the mission. Another process fires the externs, as the functional layer does."""

    def __init__(self, bus: ZenohBus, session: zenoh.Session, skillset: Skillset) -> None:
        self._bus, self._session = bus, session
        self._fire = session.declare_publisher(FIRE)
        self._mission = Watching()
        self._node = MissionNode(self._mission, skillset, missions.MissionOptions())
        self._node.attach(bus)

    def measure(self, calls: int) -> dict[str, list[float]]:
        return {"seen": [self.violate() for _ in range(calls)]}

    def violate(self) -> float:
        """Time from an extern transition to the tick that sees the goal's end [s]."""
        self._mission.ended_at = None
        assert self._bus.run_until(lambda: self._mission.leaf.phase is GoalPhase.RUNNING, PATIENCE), self._node.status
        self._fire.put(b"DOWN")
        assert self._bus.run_until(lambda: self._mission.ended_at is not None, PATIENCE), self._node.status
        assert self._mission.ended_at is not None
        answers = list(self._session.get(FIRED))
        assert answers[0].ok is not None
        self._fire.put(b"UP")
        return self._mission.ended_at - json.loads(answers[0].ok.payload.to_bytes())


def main() -> None:
    """Measure blocks of violations until standard input ends."""
    endpoint, robot, word, file = sys.argv[1:]
    topology: Topology = "mesh" if word == "mesh" else "router"
    sys.setswitchinterval(SWITCH_INTERVAL)
    bus = ZenohBus("mission", robot, endpoint, topology=topology)
    with open_session(topology, endpoint, robot) as session:
        watcher = Watcher(bus, session, load(Path(file)))
        serve(lambda question: watcher.measure(question["calls"]))
    bus.close()


if __name__ == "__main__":
    main()
