"""A measured process of `latency.py` that follows everything that the managers publish, as a recorder does.

latency_system.py starts it: latency_recorder.py ENDPOINT ROBOT TOPOLOGY SKILLSET_NAME
It decodes nothing, and counts what has come.
"""

from __future__ import annotations

import sys
import threading
from typing import Any

from peer_process import serve

from skillwing.services.bus import Sample, Topology
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.processes.node_host import SWITCH_INTERVAL


def main() -> None:
    """Count messages until standard input ends; the answer to any question is their number so far."""
    endpoint, robot, word, skillset = sys.argv[1:]
    topology: Topology = "mesh" if word == "mesh" else "router"
    sys.setswitchinterval(SWITCH_INTERVAL)
    bus = ZenohBus("recorder", robot, endpoint, topology=topology)
    received: list[str] = []
    ended = threading.Event()

    def note(sample: Sample) -> None:
        received.append(sample.key)

    def answer(question: dict[str, Any]) -> dict[str, int]:
        del question
        return {"received": len(received)}

    def talk() -> None:
        serve(answer)
        ended.set()
        bus.post(lambda: None)

    bus.subscribe(f"{skillset}/**", note, events=True)
    threading.Thread(target=talk, daemon=True).start()
    bus.run_until(ended.is_set)
    bus.close()


if __name__ == "__main__":
    main()
