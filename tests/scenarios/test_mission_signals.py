"""A mission in the foreground receives signals: the drone lands before the command ends."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest
from flights import Flight
from rich.console import Console

from skillwing.bt_missions.cli.foreground import ABORTING, aborted_by_signals
from skillwing.services.processes.stop_signal import SAME_REQUEST
from skillwing.services.protocol import MissionPhase

IN_THE_AIR = 17.0
INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@contextmanager
def told(flight: Flight, signals: Sequence[signal.Signals], apart: float = 0.3 * SAME_REQUEST) -> Iterator[io.StringIO]:
    """Output of a mission that receives these signals. apart: time between two of them, in seconds of wall time."""
    console = Console(file=io.StringIO(), width=200)
    assert isinstance(console.file, io.StringIO)
    for place, number in enumerate(signals):
        flight.at(IN_THE_AIR + apart * place, lambda number=number: signal.raise_signal(number))
    with aborted_by_signals(flight.buses["mission"], flight.node, console):
        yield console.file


@pytest.mark.parametrize(
    "signals",
    [[INT], [TERM], [HUP], [TERM, TERM], [HUP, TERM, HUP], [INT, TERM], [INT, INT, INT], [TERM, INT]],
    ids=lambda each: "+".join(number.name for number in each),
)
def test_the_mission_is_aborted_once_and_lands(signals: list[signal.Signals]) -> None:
    flight = Flight()
    before = [signal.getsignal(number) for number in ABORTING]
    with told(flight, signals) as said:
        flight.network.run_for(IN_THE_AIR - 0.1)
        assert not flight.on_ground
        status = flight.fly()
    assert status.phase == MissionPhase.ABORTED
    assert status.text.startswith(ABORTING[signals[0]])
    assert flight.on_ground
    assert flight.idle
    assert said.getvalue().count("Aborting: goals are interrupted, then landing.") == 1
    assert [signal.getsignal(number) for number in ABORTING] == before


@pytest.mark.parametrize("first", [INT, TERM, HUP])
def test_ctrl_c_after_that_leaves_the_drone_to_itself(first: signal.Signals) -> None:
    flight = Flight()
    with pytest.raises(KeyboardInterrupt), told(flight, [first, INT], apart=1.1 * SAME_REQUEST):
        flight.fly()
    assert not flight.on_ground


def test_what_no_person_sends_never_leaves_the_drone_to_itself() -> None:
    flight = Flight()
    with told(flight, [INT, TERM, HUP], apart=1.1 * SAME_REQUEST):
        flight.fly()
    assert flight.on_ground


def test_what_a_process_was_started_to_ignore_aborts_nothing() -> None:
    flight = Flight()
    before = signal.signal(HUP, signal.SIG_IGN)
    try:
        with told(flight, [HUP]):
            status = flight.fly()
    finally:
        signal.signal(HUP, before)
    assert status.phase == MissionPhase.SUCCEEDED


SPEAKER = """
import os, sys
from rich.console import Console
from skillwing.bt_missions.cli.foreground import print_if_open
console = Console()
{loss}
for number in range(3):
    print_if_open(console, f"line {{number}}")
sys.exit(7)
"""
LOSSES = {
    "a pipe without a reader": "read, write = os.pipe(); os.close(read); os.dup2(write, 1)",
    "a terminal that is gone": "read, write = os.openpty(); os.dup2(write, 1); os.close(write); os.close(read)",
}


@pytest.mark.parametrize("loss", LOSSES)
def test_one_who_cannot_be_heard_any_more_goes_on(loss: str) -> None:
    words = [sys.executable, "-c", SPEAKER.format(loss=LOSSES[loss])]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (7, "")
