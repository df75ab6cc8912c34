"""The other ends of `latency.py`: the hooks of its two skills, and a process that answers Zenoh and does nothing else.

python benchmarks/latency_peers.py ENDPOINT ROBOT TOPOLOGY
"""

from __future__ import annotations

import sys
import time
from typing import Any

import zenoh

from skillwing.services.bus import Topology
from skillwing.services.bus.zenoh_session import open_session
from skillwing.services.managers.hooks import Goal, SkillHooks

QUERY, PING, PONG = "raw/query", "raw/ping", "raw/pong"


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


def main() -> None:
    """Answer queries with their payload, publish again what is published, and end with standard input."""
    endpoint, robot, word = sys.argv[1:]
    topology: Topology = "mesh" if word == "mesh" else "router"
    with open_session(topology, endpoint, robot) as session:
        pong = session.declare_publisher(PONG)

        def answer(query: zenoh.Query) -> None:
            query.reply(QUERY, query.payload.to_bytes() if query.payload else b"")

        def forward(sample: zenoh.Sample) -> None:
            pong.put(sample.payload)

        queryable = session.declare_queryable(QUERY, zenoh.handlers.Callback(answer, indirect=False), complete=True)
        subscriber = session.declare_subscriber(PING, zenoh.handlers.Callback(forward, indirect=False))
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        sys.stdin.read()
        subscriber.undeclare()
        queryable.undeclare()


if __name__ == "__main__":
    main()
