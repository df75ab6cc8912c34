"""actionlib (ROS 1) as a system that `latency.py` measures in turns with ours: roscore, action server, action client.

latency.py starts it: ros_system.py ROSCORE PYTHON PEER_SCRIPT START_LIMIT
Each step has a time limit. At the end, every process that started here is ended by its pid.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from typing import Any

from peer_process import PeerProcess, own_processes, serve

CALL_LIMIT = 1.0
"""Longest mean time of a goal [s]."""


def free_port() -> int:
    """A port of the loopback interface that the system chose."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main() -> None:
    """Let the action client start goals until standard input ends."""
    roscore, python, peer, limit = sys.argv[1:]
    port = free_port()
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        stack.enter_context(own_processes())
        ros = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_HOME": folder}
        environment = {**ros, "PYTHONPATH": os.environ.get("ROS_PYTHONPATH")}
        subprocess.Popen(
            [roscore, "-p", str(port)],
            env={name: value for name, value in {**os.environ, **environment}.items() if value is not None},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        stack.enter_context(PeerProcess([python, peer, "server"], environment, float(limit)))
        client = stack.enter_context(PeerProcess([python, peer, "client"], environment, float(limit)))

        def measure(question: dict[str, Any]) -> dict[str, Any]:
            calls = question["calls"]
            return client.ask({"calls": calls}, CALL_LIMIT * calls)

        serve(measure)


if __name__ == "__main__":
    main()
