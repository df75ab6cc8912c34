"""Messages about a system's processes, and their times."""

from __future__ import annotations

import msgspec
import pytest

from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import SILENCE, ProcessMonitor, ProcessStatus
from skillwing.services.processes.process_state import (
    STARTING_TIME,
    ProcessCondition,
    ProcessState,
    condition,
    running_count,
)

OLD = Usage(cpu=1.0, memory=1, uptime=STARTING_TIME + 1.0, stopped=False)
YOUNG = Usage(cpu=0.1, memory=1, uptime=0.5, stopped=False)
STOPPED = Usage(cpu=1.0, memory=1, uptime=100.0, stopped=True)
HERE = {"a"}


@pytest.mark.parametrize(
    ("state", "used", "alive", "expected"),
    [
        (ProcessState(name="a", pid=1), OLD, HERE, ProcessCondition.RUNS),
        (ProcessState(name="a", pid=1), YOUNG, HERE, ProcessCondition.RUNS),
        (ProcessState(name="a", pid=1), YOUNG, set(), ProcessCondition.STARTS),
        (ProcessState(name="a", pid=1), OLD, set(), ProcessCondition.SILENT),
        (ProcessState(name="a", pid=1), STOPPED, HERE, ProcessCondition.SILENT),
        (ProcessState(name="a", pid=1), OLD, None, ProcessCondition.RUNS),
        (ProcessState(name="a", pid=1, talks=False), OLD, set(), ProcessCondition.RUNS),
        (ProcessState(name="a", pid=1), None, HERE, ProcessCondition.DOWN),
        (ProcessState(name="a", pid=1, life="waits"), None, set(), ProcessCondition.RESTARTS),
        (ProcessState(name="a", pid=1, life="given up"), None, set(), ProcessCondition.DOWN),
        # The process id of one that is given up may belong to somebody else by now.
        (ProcessState(name="a", pid=1, life="given up"), OLD, set(), ProcessCondition.DOWN),
        # Nodes share it: it runs when all of them do.
        (ProcessState(name="house", pid=1, nodes=("a",)), OLD, HERE, ProcessCondition.RUNS),
        (ProcessState(name="house", pid=1, nodes=("a", "b")), OLD, HERE, ProcessCondition.SILENT),
        (ProcessState(name="house", pid=1, nodes=("a", "b")), YOUNG, HERE, ProcessCondition.STARTS),
        (ProcessState(name="a"), None, HERE, ProcessCondition.RUNS),
        (ProcessState(name="a"), None, None, ProcessCondition.DOWN),
    ],
)
def test_how_a_process_is(
    state: ProcessState, used: Usage | None, alive: set[str] | None, expected: ProcessCondition
) -> None:
    assert condition(state, used, alive) is expected


def test_heads_are_counted() -> None:
    assert (
        running_count([ProcessCondition.RUNS, ProcessCondition.DOWN, ProcessCondition.RUNS])
        == "2 of 3 processes run, not counting the router."
    )


class Calls:
    """A roll call of one process, second by second."""

    def __init__(self) -> None:
        self.monitor = ProcessMonitor()

    def at(self, now: float, found: ProcessCondition, restarts: int = 0) -> list[str]:
        return self.monitor.changes([ProcessStatus(ProcessState(name="a", pid=1, restarts=restarts), found, None)], now)


def test_running_processes_are_not_reported() -> None:
    calls = Calls()
    assert calls.at(0.0, ProcessCondition.RUNS) + calls.at(1.0, ProcessCondition.RUNS) == []


def test_lasting_silence_is_reported_once() -> None:
    calls = Calls()
    calls.at(0.0, ProcessCondition.RUNS)
    assert calls.at(1.0, ProcessCondition.SILENT) == []
    assert calls.at(1.0 + SILENCE, ProcessCondition.SILENT) == [
        "a does not answer any more: it is stopped, hangs or is cut off."
    ]
    assert calls.at(2.0 + SILENCE, ProcessCondition.SILENT) == []
    assert calls.at(3.0 + SILENCE, ProcessCondition.RUNS) == ["a runs again."]


def test_a_flap_is_not_worth_a_word() -> None:
    calls = Calls()
    told = [calls.at(float(t), ProcessCondition.SILENT if t % 2 else ProcessCondition.RUNS) for t in range(20)]
    assert not any(told)


def test_a_restart_is_reported_when_the_process_is_back() -> None:
    calls = Calls()
    calls.at(0.0, ProcessCondition.RUNS)
    assert calls.at(1.0, ProcessCondition.RESTARTS) == []
    assert calls.at(2.0, ProcessCondition.STARTS) == []
    assert calls.at(3.0, ProcessCondition.RUNS) == ["a runs again."]


@pytest.mark.parametrize("between", [ProcessCondition.STARTS, ProcessCondition.RUNS])
def test_a_restart_between_two_checks_is_reported_once(between: ProcessCondition) -> None:
    calls = Calls()
    calls.at(0.0, ProcessCondition.RUNS)
    told = (
        calls.at(1.0, between, restarts=1)
        + calls.at(2.0, ProcessCondition.RUNS, 1)
        + calls.at(3.0, ProcessCondition.RUNS, 1)
    )
    assert told == ["a runs again."]


def test_a_slow_first_start_is_no_return() -> None:
    calls = Calls()
    assert calls.at(0.0, ProcessCondition.STARTS) + calls.at(1.0, ProcessCondition.RUNS) == []


def test_states_travel_in_the_run_state() -> None:
    state = ProcessState(name="a", pid=3, life="waits", restarts=2, last_words="It ended.")
    assert msgspec.json.decode(msgspec.json.encode(state), type=ProcessState) == state


HOUSE = ProcessState(name="house", pid=1, nodes=("a", "b"))


def entry_of(state: ProcessState, used: Usage | None, alive: set[str] | None) -> ProcessStatus:
    missing = None if alive is None else frozenset(state.tokens) - alive
    return ProcessStatus(state, condition(state, used, alive), used, missing)


@pytest.mark.parametrize(
    ("used", "alive", "a", "b"),
    [
        (OLD, {"a", "b"}, ProcessCondition.RUNS, ProcessCondition.RUNS),
        (OLD, {"a"}, ProcessCondition.RUNS, ProcessCondition.SILENT),
        (YOUNG, {"b"}, ProcessCondition.STARTS, ProcessCondition.RUNS),
        # A stopped process keeps its tokens for the length of a lease.
        (STOPPED, {"a", "b"}, ProcessCondition.SILENT, ProcessCondition.SILENT),
        (None, {"a", "b"}, ProcessCondition.DOWN, ProcessCondition.DOWN),
        (OLD, None, ProcessCondition.RUNS, ProcessCondition.RUNS),
    ],
)
def test_how_the_nodes_of_a_process_are(
    used: Usage | None, alive: set[str] | None, a: ProcessCondition, b: ProcessCondition
) -> None:
    assert entry_of(HOUSE, used, alive).nodes == {"a": a, "b": b}


@pytest.mark.parametrize(("alive", "who"), [({"a"}, "b in house"), (set[str](), "house")])
def test_of_a_process_that_nodes_share_the_silent_ones_are_named(alive: set[str], who: str) -> None:
    monitor = ProcessMonitor()
    silent = entry_of(HOUSE, OLD, alive)
    told = monitor.changes([silent], 0.0) + monitor.changes([silent], SILENCE)
    assert told == [f"{who} does not answer any more: it is stopped, hangs or is cut off."]
