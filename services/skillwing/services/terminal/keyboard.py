"""Keys that are pressed while a command shows a live view."""

from __future__ import annotations

import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PERIOD = 0.2
"""Seconds between two checks for the end of the context."""


@contextmanager
def when_pressed(act: Callable[[str], None]) -> Iterator[None]:
    """Call `act` with each key, on a thread of its own; without a terminal it is never called.

    Keys do not wait for Enter and are not shown. Afterwards the terminal has its earlier settings.
    """
    if not sys.stdin.isatty():
        yield
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    over = threading.Event()

    def read() -> None:
        while not over.is_set():
            ready, _, _ = select.select([descriptor], [], [], PERIOD)
            if ready:
                pressed = os.read(descriptor, 1)
                if not pressed:
                    return
                act(pressed.decode(errors="replace"))

    reader = threading.Thread(target=read, name="keyboard", daemon=True)
    tty.setcbreak(descriptor)
    reader.start()
    try:
        yield
    finally:
        over.set()
        reader.join()
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
