"""Two measured processes of `latency.py`: a raw Zenoh client, and a client of skills.

latency_system.py starts each: latency_clients.py raw|client ENDPOINT ROBOT TOPOLOGY SKILLSET_FILE
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from queue import SimpleQueue

import zenoh
from latency_peers import PING, PONG, QUERY
from peer_process import serve

from skillwing.dsl import load
from skillwing.dsl.model import Skillset
from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.bus.zenoh_session import open_session
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.processes.node_host import SWITCH_INTERVAL

PAYLOAD = bytes(226)
"""Payload of a raw query, as long as the start of a skill with some inputs."""
PATIENCE = 10.0


class RawClient:
    """Plain Zenoh, the base of all comparisons."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._ping = session.declare_publisher(PING)
        self._pongs: SimpleQueue[zenoh.Sample] = SimpleQueue()
        self._pong = session.declare_subscriber(PONG, zenoh.handlers.Callback(self._pongs.put, indirect=False))

    def measure(self, calls: int) -> dict[str, list[float]]:
        return {"query": [self.query() for _ in range(calls)], "hop": [self.hop() for _ in range(calls)]}

    def query(self) -> float:
        """Time from a query to its answer [s]."""
        begun = time.monotonic()
        answers = list(self._session.get(QUERY, payload=PAYLOAD, consolidation=zenoh.ConsolidationMode.NONE))
        assert answers[0].ok is not None
        return time.monotonic() - begun

    def hop(self) -> float:
        """Duration of a publication to another process: half of the round trip [s]."""
        begun = time.monotonic()
        self._ping.put(PAYLOAD)
        self._pongs.get(timeout=PATIENCE)
        return (time.monotonic() - begun) / 2.0


class SkillClient:
    """A client that starts `act`, a skill that ends at once."""

    def __init__(self, bus: ZenohBus, skillset: Skillset) -> None:
        self._bus = bus
        self._interface = SkillsetInterface(bus, skillset, client="benchmark")
        assert bus.run_until(lambda: self._interface.ready, PATIENCE)

    def measure(self, calls: int) -> dict[str, list[float]]:
        pairs = [self.start() for _ in range(calls)]
        return {"dispatched": [pair[0] for pair in pairs], "result": [pair[1] for pair in pairs]}

    def start(self) -> tuple[float, float]:
        """Times from the start to `on_dispatch`, and to the client's result [s]."""
        begun = time.monotonic()
        goal = self._interface.start("act")
        assert self._bus.run_until(lambda: goal.done, PATIENCE)
        ended = time.monotonic()
        assert goal.terminal is not None
        assert goal.terminal.output is not None, goal.terminal
        return goal.terminal.output["at"] - begun, ended - begun


def main() -> None:
    """Measure blocks of calls until standard input ends."""
    role, endpoint, robot, word, file = sys.argv[1:]
    topology: Topology = "mesh" if word == "mesh" else "router"
    sys.setswitchinterval(SWITCH_INTERVAL)
    if role == "raw":
        with open_session(topology, endpoint, robot) as session:
            raw = RawClient(session)
            serve(lambda question: raw.measure(question["calls"]))
        return
    bus = ZenohBus(role, robot, endpoint, topology=topology)
    client = SkillClient(bus, load(Path(file)))
    serve(lambda question: client.measure(question["calls"]))
    bus.close()


if __name__ == "__main__":
    main()
