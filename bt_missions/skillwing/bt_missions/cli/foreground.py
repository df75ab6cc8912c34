"""A mission that flies from a terminal: who calls it off there, and what it says there."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from rich.console import Console, RenderableType

from skillwing.bt_missions.running.runner import MissionNode
from skillwing.services.bus import Bus
from skillwing.services.client.connection import Target
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.terminal.connection import System

ABORTING = {
    signal.SIGINT: "aborted by Ctrl-C",
    signal.SIGTERM: "aborted by `kill`",
    signal.SIGHUP: "aborted, since its terminal was closed",
}
"""Signals that call a mission off, and what the timeline says of that."""


def fly(system: System, node: MissionNode, console: Console | None) -> None:
    """Run the mission to its end, whoever calls it off."""
    node.attach(system.bus)
    try:
        call_when_stopped(system.bus, system.target, node.system_stopped)
        with aborted_by_signals(system.bus, node, console):
            system.bus.run_until(lambda: node.over)
    finally:
        node.detach()


@contextmanager
def aborted_by_signals(bus: Bus, node: MissionNode, console: Console | None) -> Iterator[None]:
    """Let Ctrl-C, `kill` and a closed terminal abort the mission, so that it lands; the body runs the bus until then.

    After that only another Ctrl-C, which a person presses, raises KeyboardInterrupt and leaves the drone to itself;
    what repeats the first signal does not. Under `nohup` a closed terminal aborts nothing.
    """
    stop = StopSignal(bus.wall)

    def on_signal(number: int, frame: object) -> None:
        if not stop.received:
            bus.post(lambda: abort(signal.Signals(number)))
            stop.receive()
        elif number == signal.SIGINT:
            stop.receive()

    def abort(number: signal.Signals) -> None:
        again = " again" if number is signal.SIGINT else ""
        say(console, f"Aborting: the drone lands where it is. Ctrl-C{again} leaves it to itself.")
        node.abort(ABORTING[number])

    numbers = [number for number in ABORTING if signal.getsignal(number) is not signal.SIG_IGN]
    previous = [signal.signal(number, on_signal) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)


def say(console: Console | None, words: RenderableType) -> None:
    """Print, as long as somebody reads it: a terminal that is gone must not keep the drone from landing."""
    if console is None:
        return
    try:
        console.print(words)
    except SystemExit:
        pass  # rich ends processes whose pipe was closed; it prints nothing more
    except OSError:
        with suppress(SystemExit):
            console.on_broken_pipe()


LOOK_PERIOD = 0.1
"""Wall seconds; `up` says that it ends before it ends anything."""


def call_when_stopped(bus: Bus, target: Target, act: Callable[[], None]) -> None:
    """Call `act` once the system is no more, as long as the bus runs. Of one that was found by its endpoint nobody
    here can tell."""
    if target.pid is None:
        return

    def look() -> None:
        state = read_run_state(target.robot)
        if state is None or state.pid != target.pid:
            act()
        else:
            bus.after(LOOK_PERIOD, look, wall=True)

    look()
