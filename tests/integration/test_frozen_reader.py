"""A process that is stopped and reads no messages costs the others nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager

import pytest

from skillwing.services.bus.zenoh_bus import ZenohBus

pytestmark = pytest.mark.slow

FROZEN_FOR = 4.0
"""Wall seconds, in which the stopped process is sent more than its link holds."""
ENOUGH = 0.8
"""Share of the messages among the others that must arrive. With one receiving thread the router brought 0.6."""
SESSION = """
import sys
from skillwing.services.bus.zenoh_bus import ZenohBus
bus = ZenohBus(sys.argv[1], "robot", sys.argv[2])
"""
READER = """
bus.subscribe("pictures", lambda sample: None)
bus.subscribe("events", lambda sample: None, events=True)
print("ready", flush=True)
bus.run_until(lambda: False)
"""
WRITER = """
pictures, events = bus.advertise("pictures"), bus.advertise("events", events=True)
print("ready", flush=True)
while True:
    pictures.put(bytes(300_000))
    events.put(b"event")
    bus.run_until(lambda: False, 0.03)
"""


@contextmanager
def process(*arguments: str) -> Iterator[tuple[int, str]]:
    """A Python process, with the first line that it prints."""
    with subprocess.Popen([sys.executable, *arguments], stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None
            yield child.pid, child.stdout.readline().strip()
        finally:
            child.kill()


def test_the_others_go_on_while_a_process_does_not_read() -> None:
    with ExitStack() as stack:
        _, endpoint = stack.enter_context(process("-m", "skillwing.services.processes.router"))
        reader, _ = stack.enter_context(process("-c", SESSION + READER, "reader", endpoint))
        stack.enter_context(process("-c", SESSION + WRITER, "writer", endpoint))
        sender = stack.enter_context(closing(ZenohBus("sender", "robot", endpoint)))
        receiver = stack.enter_context(closing(ZenohBus("receiver", "robot", endpoint)))
        heard: list[bytes] = []
        receiver.subscribe("beat", lambda sample: heard.append(sample.payload))
        beat, sent = sender.advertise("beat"), 0
        os.kill(reader, signal.SIGSTOP)
        end = time.monotonic() + FROZEN_FOR
        while time.monotonic() < end:
            beat.put(b"beat")
            sent += 1
            receiver.run_until(lambda: False, 0.02)
        assert len(heard) >= ENOUGH * sent
