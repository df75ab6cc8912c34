"""Stop signals of a process, at any place in its code."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator

import pytest

from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.processes.stop_signal import SAME_REQUEST, StopSignal, stop_on_signals

SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


class Clock:
    """Wall time that a test makes pass."""

    def __init__(self) -> None:
        self.t = 100.0

    def __call__(self) -> float:
        return self.t


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def stop(clock: Clock) -> Iterator[StopSignal]:
    before = [signal.getsignal(number) for number in SIGNALS]
    with stop_on_signals(clock) as stop:
        yield stop
    assert [signal.getsignal(number) for number in SIGNALS] == before


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_is_taken_note_of(stop: StopSignal, number: signal.Signals) -> None:
    stop.check()
    signal.raise_signal(number)
    with pytest.raises(KeyboardInterrupt):
        stop.check()


def test_a_second_wish_raises_wherever_it_comes(stop: StopSignal, clock: Clock) -> None:
    signal.raise_signal(signal.SIGTERM)
    clock.t += SAME_REQUEST + 0.1
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_a_withdrawn_request_has_to_be_made_again(stop: StopSignal, clock: Clock) -> None:
    signal.raise_signal(signal.SIGINT)
    assert stop.by_keyboard
    stop.withdraw()
    signal.raise_signal(signal.SIGINT)
    stop.check()
    clock.t += SAME_REQUEST + 0.1
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        stop.check()


def test_another_signal_counts_at_once_after_a_withdrawn_request(stop: StopSignal) -> None:
    signal.raise_signal(signal.SIGINT)
    stop.withdraw()
    signal.raise_signal(signal.SIGTERM)
    assert not stop.by_keyboard
    with pytest.raises(KeyboardInterrupt):
        stop.check()


def test_signals_right_behind_the_first_are_the_same_wish(stop: StopSignal, clock: Clock) -> None:
    """`timeout` signals us and then our whole group."""
    for _ in range(3):
        signal.raise_signal(signal.SIGTERM)
        clock.t += 0.4 * SAME_REQUEST
    assert stop.received
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGTERM)


def test_the_same_wish_again_does_not_cut_short_what_it_began(stop: StopSignal) -> None:
    with pytest.raises(KeyboardInterrupt), stop.raising():
        signal.raise_signal(signal.SIGTERM)
    signal.raise_signal(signal.SIGTERM)


def test_under_nohup_a_closed_terminal_ends_nothing() -> None:
    previous = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stop_on_signals() as stop:
            signal.raise_signal(signal.SIGHUP)
            assert not stop.received
    finally:
        signal.signal(signal.SIGHUP, previous)


def test_waiting_callers_are_notified(stop: StopSignal) -> None:
    bus = InProcessNetwork().bus("command")
    bus.after(3.0, lambda: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        stop.wait(bus, lambda: False, timeout=60.0)
    assert bus.now() == 3.0


def test_waiting_ends_with_its_condition_and_with_its_time(stop: StopSignal) -> None:
    bus = InProcessNetwork().bus("command")
    assert stop.wait(bus, lambda: bus.now() >= 1.0, timeout=2.0)
    begun = bus.wall()
    assert not stop.wait(bus, lambda: False, timeout=2.0)
    assert bus.wall() - begun == pytest.approx(2.0)


def test_where_nobody_looks_the_first_raises(stop: StopSignal) -> None:
    with pytest.raises(KeyboardInterrupt), stop.raising():
        signal.raise_signal(signal.SIGINT)
    assert stop.received


def test_an_exception_that_python_drops_is_not_lost(stop: StopSignal) -> None:
    with pytest.raises(KeyboardInterrupt), stop.raising(), contextlib.suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_an_earlier_stop_does_not_end_the_cleanup(stop: StopSignal) -> None:
    signal.raise_signal(signal.SIGINT)
    with stop.raising():
        done = True
    assert done
