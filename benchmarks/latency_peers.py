"""Other ends of `latency.py`: hooks of its two skills, and the process that answers plain Zenoh and fires externs.

latency_system.py starts it: latency_peers.py ENDPOINT ROBOT TOPOLOGY SKILLSET_NAME
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import zenoh
from peer_process import serve

from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_session import open_session
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.protocol import FireExtern, Keys, encode

QUERY, PING, PONG, FIRE, FIRED = "raw/query", "raw/ping", "raw/pong", "raw/fire", "raw/fired"


class ActHooks(SkillHooks[dict[str, Any], dict[str, float], None]):
    """Ends as soon as it is dispatched, and says when that was."""

    skill = "act"

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        # The same clock for all processes of a machine.
        self.terminated(goal.id, "DONE", {"at": time.monotonic()})


class HoldHooks(SkillHooks[dict[str, Any], None, None]):
    """Runs until its invariant is violated."""

    skill = "hold"

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        pass


class Firing:
    """A functional layer: fires extern transitions of `link` on request, and remembers the time of the last one."""

    def __init__(self, session: zenoh.Session, skillset: str) -> None:
        self._session = session
        self._key = Keys(skillset).resource_extern
        self._at = 0.0

    def fire(self, sample: zenoh.Sample) -> None:
        target = sample.payload.to_string()
        request = encode(FireExtern(resource="link", target=target, source="benchmark"))
        self._at = time.monotonic()
        self._session.get(self._key, zenoh.handlers.Callback(lambda _: None, indirect=False), payload=request)

    def answer(self, query: zenoh.Query) -> None:
        query.reply(FIRED, json.dumps(self._at).encode())


def main() -> None:
    """Answer queries with their payload, publish again what is published, and fire, until standard input ends."""
    endpoint, robot, word, skillset = sys.argv[1:]
    topology: Topology = "mesh" if word == "mesh" else "router"
    with open_session(topology, endpoint, robot) as session:
        pong = session.declare_publisher(PONG)
        firing = Firing(session, skillset)

        def answer(query: zenoh.Query) -> None:
            query.reply(QUERY, query.payload.to_bytes() if query.payload else b"")

        def forward(sample: zenoh.Sample) -> None:
            pong.put(sample.payload)

        declared = [
            session.declare_queryable(QUERY, zenoh.handlers.Callback(answer, indirect=False), complete=True),
            session.declare_queryable(FIRED, zenoh.handlers.Callback(firing.answer, indirect=False), complete=True),
            session.declare_subscriber(PING, zenoh.handlers.Callback(forward, indirect=False)),
            session.declare_subscriber(FIRE, zenoh.handlers.Callback(firing.fire, indirect=False)),
        ]
        serve(lambda question: question)
        for each in declared:
            each.undeclare()


if __name__ == "__main__":
    main()
