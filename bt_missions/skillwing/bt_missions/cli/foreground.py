"""Mission in the foreground of a terminal: signals that abort it, its output, and the end of the system under it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial

import typer
from rich.console import Console, RenderableType
from rich.text import Text

from skillwing.bt_missions.running.runner import MissionNode
from skillwing.services.bus import Timers
from skillwing.services.client.connection import Target
from skillwing.services.processes.run_state import read_run_state
from skillwing.services.processes.stop_signal import StopSignal
from skillwing.services.terminal.connection import System

ABORTING = {
    signal.SIGINT: "aborted by Ctrl-C",
    signal.SIGTERM: "aborted by `kill`",
    signal.SIGHUP: "aborted, since its terminal was closed",
}
"""Signals that abort a mission, each with its reason for the timeline."""
SYSTEM_PERIOD = 0.1
"""Time between two checks that the system still runs, in seconds of wall time. `up` announces its end beforehand."""


def run_in_foreground(systems: Mapping[str, System], node: MissionNode, console: Console | None) -> None:
    """Run the mission until it is over, by itself or after a signal. systems: of its robots, by name."""
    bus = next(iter(systems.values())).bus
    node.attach_to({robot: system.bus for robot, system in systems.items()})
    try:
        _call_when_all_stopped(systems, node.system_stopped)
        with aborted_by_signals(bus, node, console):
            bus.run_until(lambda: node.over)
    finally:
        node.detach()


@contextmanager
def aborted_by_signals(bus: Timers, node: MissionNode, console: Console | None) -> Iterator[None]:
    """Let Ctrl-C, `kill` and a closed terminal abort the mission, with its rescue. The body runs the bus until then.

    After that only another Ctrl-C by a person raises KeyboardInterrupt, and ends the process without the rescue. A
    repetition of the first signal does not. Under `nohup` a closed terminal aborts nothing.
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
        then = "" if node.rescue_action is None else f", then {node.rescue_action}"
        print_if_open(console, f"Aborting: goals are interrupted{then}. Ctrl-C{again} ends this command without that.")
        node.abort(ABORTING[number])

    numbers = [number for number in ABORTING if signal.getsignal(number) is not signal.SIG_IGN]
    previous = [signal.signal(number, on_signal) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)


def print_if_open(console: Console | None, text: RenderableType) -> None:
    """Print, and ignore a terminal that is gone: the rescue has to run all the same."""
    if console is None:
        return
    try:
        console.print(text, soft_wrap=not console.is_terminal)
    except SystemExit:
        pass  # rich exits after a closed pipe; later output is dropped
    except OSError:
        with suppress(SystemExit):
            console.on_broken_pipe()


def print_link(console: Console | None, sentence: str) -> None:
    """Print a sentence about the link to the robot, beside JSON on standard error."""
    if console is None:
        with suppress(OSError):  # a terminal that is gone must not end the rescue
            typer.echo(sentence, err=True)
    else:
        print_if_open(console, Text(sentence, "bold red"))


def without_link(grace: float, target: Target) -> str:
    """A sentence on the goals of a mission on the ground while its link is away. grace: of the mission [wall s]."""
    goals = f"The goals run on for {grace:g} s, then they end" if grace else "The goals end after some seconds"
    return f"{goals}. {target.without_goals}".rstrip()


def _call_when_all_stopped(systems: Mapping[str, System], act: Callable[[], None]) -> None:
    """Call `act` when the last of these systems has stopped. One that stops earlier is a lost robot."""
    left = set(systems)

    def note(robot: str) -> None:
        left.discard(robot)
        if not left:
            act()

    for robot, system in systems.items():
        call_when_stopped(system.bus, system.target, partial(note, robot))


def call_when_stopped(bus: Timers, target: Target, act: Callable[[], None]) -> None:
    """Call `act` once the system has stopped, while the bus runs. No effect for a system found by its endpoint."""
    if target.pid is None:
        return

    def check() -> None:
        state = read_run_state(target.robot)
        if state is None or state.pid != target.pid:
            act()
        else:
            bus.after(SYSTEM_PERIOD, check, wall=True)

    check()
