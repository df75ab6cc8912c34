"""What is told of a system's processes, and when."""

from __future__ import annotations

import msgspec
import pytest

from skillwing.services.processes.proc_files import Usage
from skillwing.services.processes.process_monitor import SILENCE, Entry, RollCall
from skillwing.services.processes.process_state import STARTING_TIME, Condition, ProcessState, condition, headcount

OLD = Usage(cpu=1.0, memory=1, uptime=STARTING_TIME + 1.0, stopped=False)
YOUNG = Usage(cpu=0.1, memory=1, uptime=0.5, stopped=False)
STOPPED = Usage(cpu=1.0, memory=1, uptime=100.0, stopped=True)
HERE = {"a"}


@pytest.mark.parametrize(
    ("state", "used", "alive", "expected"),
    [
        (ProcessState(name="a", pid=1), OLD, HERE, Condition.RUNS),
        (ProcessState(name="a", pid=1), YOUNG, HERE, Condition.RUNS),
        (ProcessState(name="a", pid=1), YOUNG, set(), Condition.STARTS),
        (ProcessState(name="a", pid=1), OLD, set(), Condition.SILENT),
        (ProcessState(name="a", pid=1), STOPPED, HERE, Condition.SILENT),
        (ProcessState(name="a", pid=1), OLD, None, Condition.RUNS),
        (ProcessState(name="a", pid=1, talks=False), OLD, set(), Condition.RUNS),
        (ProcessState(name="a", pid=1), None, HERE, Condition.DOWN),
        (ProcessState(name="a", pid=1, life="waits"), None, set(), Condition.RESTARTS),
        (ProcessState(name="a", pid=1, life="given up"), None, set(), Condition.DOWN),
        # The process id of one that is given up may belong to somebody else by now.
        (ProcessState(name="a", pid=1, life="given up"), OLD, set(), Condition.DOWN),
        # Nodes share it: it runs when all of them do.
        (ProcessState(name="house", pid=1, nodes=("a",)), OLD, HERE, Condition.RUNS),
        (ProcessState(name="house", pid=1, nodes=("a", "b")), OLD, HERE, Condition.SILENT),
        (ProcessState(name="house", pid=1, nodes=("a", "b")), YOUNG, HERE, Condition.STARTS),
        (ProcessState(name="a"), None, HERE, Condition.RUNS),
        (ProcessState(name="a"), None, None, Condition.DOWN),
    ],
)
def test_how_a_process_is(state: ProcessState, used: Usage | None, alive: set[str] | None, expected: Condition) -> None:
    assert condition(state, used, alive) is expected


def test_heads_are_counted() -> None:
    assert headcount([Condition.RUNS, Condition.DOWN, Condition.RUNS]) == "2 of 3 processes run, besides the router."


class Calls:
    """A roll call of one process, second by second."""

    def __init__(self) -> None:
        self.roll_call = RollCall()

    def at(self, now: float, found: Condition, restarts: int = 0) -> list[str]:
        return self.roll_call.look([Entry(ProcessState(name="a", pid=1, restarts=restarts), found, None)], now)


def test_nothing_is_told_of_what_just_runs() -> None:
    calls = Calls()
    assert calls.at(0.0, Condition.RUNS) + calls.at(1.0, Condition.RUNS) == []


def test_silence_is_told_once_it_lasts_and_only_once() -> None:
    calls = Calls()
    calls.at(0.0, Condition.RUNS)
    assert calls.at(1.0, Condition.SILENT) == []
    assert calls.at(1.0 + SILENCE, Condition.SILENT) == [
        "a does not answer any more: it is stopped, hangs or is cut off."
    ]
    assert calls.at(2.0 + SILENCE, Condition.SILENT) == []
    assert calls.at(3.0 + SILENCE, Condition.RUNS) == ["a runs again."]


def test_a_flap_is_not_worth_a_word() -> None:
    calls = Calls()
    told = [calls.at(float(t), Condition.SILENT if t % 2 else Condition.RUNS) for t in range(20)]
    assert not any(told)


def test_a_restart_is_told_when_the_process_is_there_again() -> None:
    calls = Calls()
    calls.at(0.0, Condition.RUNS)
    assert calls.at(1.0, Condition.RESTARTS) == []
    assert calls.at(2.0, Condition.STARTS) == []
    assert calls.at(3.0, Condition.RUNS) == ["a runs again."]


@pytest.mark.parametrize("between", [Condition.STARTS, Condition.RUNS])
def test_a_restart_between_two_looks_is_told_once(between: Condition) -> None:
    calls = Calls()
    calls.at(0.0, Condition.RUNS)
    told = calls.at(1.0, between, restarts=1) + calls.at(2.0, Condition.RUNS, 1) + calls.at(3.0, Condition.RUNS, 1)
    assert told == ["a runs again."]


def test_a_slow_first_start_is_no_return() -> None:
    calls = Calls()
    assert calls.at(0.0, Condition.STARTS) + calls.at(1.0, Condition.RUNS) == []


def test_states_travel_in_the_run_state() -> None:
    state = ProcessState(name="a", pid=3, life="waits", restarts=2, last_words="It ended.")
    assert msgspec.json.decode(msgspec.json.encode(state), type=ProcessState) == state


HOUSE = ProcessState(name="house", pid=1, nodes=("a", "b"))


def entry_of(state: ProcessState, used: Usage | None, alive: set[str] | None) -> Entry:
    missing = None if alive is None else frozenset(state.tokens) - alive
    return Entry(state, condition(state, used, alive), used, missing)


@pytest.mark.parametrize(
    ("used", "alive", "a", "b"),
    [
        (OLD, {"a", "b"}, Condition.RUNS, Condition.RUNS),
        (OLD, {"a"}, Condition.RUNS, Condition.SILENT),
        (YOUNG, {"b"}, Condition.STARTS, Condition.RUNS),
        # A stopped process keeps its tokens for the length of a lease.
        (STOPPED, {"a", "b"}, Condition.SILENT, Condition.SILENT),
        (None, {"a", "b"}, Condition.DOWN, Condition.DOWN),
        (OLD, None, Condition.RUNS, Condition.RUNS),
    ],
)
def test_how_the_nodes_of_a_process_are(used: Usage | None, alive: set[str] | None, a: Condition, b: Condition) -> None:
    assert entry_of(HOUSE, used, alive).nodes == {"a": a, "b": b}


@pytest.mark.parametrize(("alive", "who"), [({"a"}, "b in house"), (set[str](), "house")])
def test_of_a_process_that_nodes_share_the_silent_ones_are_named(alive: set[str], who: str) -> None:
    roll_call = RollCall()
    silent = entry_of(HOUSE, OLD, alive)
    told = roll_call.look([silent], 0.0) + roll_call.look([silent], SILENCE)
    assert told == [f"{who} does not answer any more: it is stopped, hangs or is cut off."]
