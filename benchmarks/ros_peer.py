"""rospy and actionlib doing what `latency.py` has a skill do: start an action that ends at once, wait for its result.

ros_system.py starts `/usr/bin/python3 ros_peer.py server`, and the same with `client`, under a roscore of their own.
Needs Debian's python3-rospy and python3-actionlib. The protocol on standard input and output is that of
peer_process.py, which this Python cannot import.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

import actionlib  # pyright: ignore[reportMissingImports]
import rospy  # pyright: ignore[reportMissingImports]
from actionlib.msg import TestAction, TestGoal  # pyright: ignore[reportMissingImports]


def answer_until_end(answer: Callable[[dict[str, int]], dict[str, list[float]]]) -> None:
    """Greet the parent, then answer its questions until standard input ends."""
    sys.stdout.write("{}\n")
    sys.stdout.flush()
    for line in sys.stdin:
        sys.stdout.write(json.dumps(answer(json.loads(line))) + "\n")
        sys.stdout.flush()


def serve() -> None:
    rospy.init_node("server", disable_signals=True)
    server = actionlib.SimpleActionServer("act", TestAction, lambda goal: server.set_succeeded(), auto_start=False)
    server.start()
    answer_until_end(lambda question: {})
    rospy.signal_shutdown("the parent has ended")


def ask() -> None:
    rospy.init_node("client", disable_signals=True)
    client = actionlib.SimpleActionClient("act", TestAction)
    client.wait_for_server()

    def start(number: int) -> float:
        begun = time.monotonic()
        client.send_goal(TestGoal(goal=number))
        client.wait_for_result()
        return time.monotonic() - begun

    answer_until_end(lambda question: {"result": [start(number) for number in range(question["calls"])]})
    rospy.signal_shutdown("the parent has ended")


if __name__ == "__main__":
    if sys.argv[1] == "server":
        serve()
    else:
        ask()
