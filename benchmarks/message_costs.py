"""Processor time to encode and decode the most frequent messages, with our checks and with msgspec alone.

messages.py and bench_against.py start it, with the code of one checkout. It prints JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from checkouts import code_of, first_module, script

from skillwing.services.protocol import ClockTick, DataSample, GoalStatus, Message, StartGoal, State, decode, encode

Navigation: Any = first_module("skillwing.sim_mujoco.topics", "skillwing.onboard.topics.navigation").Navigation
GOAL = "0199b0d4-0000-7000-8000-000000000001"
POSITION = {"x": 12.5, "y": -3.25, "z": 4.0}
MESSAGES: tuple[Message, ...] = (
    ClockTick(t=12.34),
    DataSample(name="position", value=POSITION, t=12.34),
    Navigation(
        t=12.34,
        position=(12.5, -3.25, 4.0),
        velocity=(1.5, 0.0, 0.0),
        quaternion=(1.0, 0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 0.1),
        heading=0.0,
    ),
    StartGoal(goal_id=GOAL, inputs={"target": POSITION, "speed": 2.0}, client="mission", schema="0" * 64),
    GoalStatus(goal_id=GOAL, skill="goto", state=State.RUNNING, t=12.34),
)
CALLS = 2000
BLOCKS = 15


def _microseconds(call: Callable[[], object]) -> float:
    """The least processor time of a call among some blocks: whatever else the machine does can only add to it."""
    least = float("inf")
    for _ in range(BLOCKS):
        begun = time.process_time()
        for _ in range(CALLS):
            call()
        least = min(least, time.process_time() - begun)
    return 1e6 * least / CALLS


def costs(message: Message) -> dict[str, float]:
    """Microseconds to encode and decode a message, with our checks and with msgspec alone; its size in bytes."""
    kind, payload = type(message), encode(message)
    encoder, decoder = msgspec.msgpack.Encoder(), msgspec.msgpack.Decoder(kind)
    return {
        "bytes": len(payload),
        "encode": _microseconds(lambda: encode(message)),
        "encode alone": _microseconds(lambda: encoder.encode(message)),
        "decode": _microseconds(lambda: decode(payload, kind)),
        "decode alone": _microseconds(lambda: decoder.decode(payload)),
    }


def measure() -> dict[str, dict[str, float]]:
    return {type(message).__name__: costs(message) for message in MESSAGES}


def run(tree: Path) -> dict[str, dict[str, float]]:
    """Measure the code of a checkout in a process of its own."""
    environment = {**os.environ, **code_of(tree)}
    done = subprocess.run(script("message_costs.py"), env=environment, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


if __name__ == "__main__":
    json.dump(measure(), sys.stdout)
