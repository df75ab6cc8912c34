"""rospy and actionlib doing what `latency.py` has a skill do: start an action that ends at once, wait for its result.

/usr/bin/python3 benchmarks/ros_peer.py server, and beside it the same with `client GOALS`, which prints how many
seconds each goal took. Needs a running roscore, and Debian's python3-rospy and python3-actionlib.
"""

from __future__ import annotations

import sys
import time

import actionlib  # pyright: ignore[reportMissingImports]
import rospy  # pyright: ignore[reportMissingImports]
from actionlib.msg import TestAction, TestGoal  # pyright: ignore[reportMissingImports]


def serve() -> None:
    rospy.init_node("server")
    server = actionlib.SimpleActionServer("act", TestAction, lambda goal: server.set_succeeded(), auto_start=False)
    server.start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    rospy.spin()


def ask(goals: int) -> None:
    rospy.init_node("client")
    client = actionlib.SimpleActionClient("act", TestAction)
    client.wait_for_server()
    for number in range(goals):
        begun = time.monotonic()
        client.send_goal(TestGoal(goal=number))
        client.wait_for_result()
        sys.stdout.write(f"{time.monotonic() - begun}\n")


if __name__ == "__main__":
    if sys.argv[1] == "server":
        serve()
    else:
        ask(int(sys.argv[2]))
