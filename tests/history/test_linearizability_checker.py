"""The checker on histories of which it is known whether they are linearizable."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st
from linearizability import Operation, UndecidedError, check

Call: TypeAlias = tuple[str, int]
Seen: TypeAlias = Operation[Call, int]


@dataclass(frozen=True)
class Register:
    """Holds a number; a write is answered with 0."""

    initial: int = 0

    def step(self, state: int, call: Call, answer: int | None) -> int | None:
        kind, value = call
        if kind == "write":
            return value
        return state if answer is None or answer == state else None


def op(client: str, call: Call, answer: int | None, called: int, answered: int | None) -> Seen:
    return Operation(client, call, answer, called, answered)


READ = ("read", 0)
ONE, TWO = ("write", 1), ("write", 2)

LINEARIZABLE = {
    "nothing": [],
    "one after the other": [op("a", ONE, 0, 0, 1), op("b", READ, 1, 2, 3)],
    "a read during a write sees the old value": [op("a", ONE, 0, 0, 9), op("b", READ, 0, 1, 2)],
    "or the new one": [op("a", ONE, 0, 0, 9), op("b", READ, 1, 1, 2)],
    "writes that overlap in either order": [
        op("a", ONE, 0, 0, 9),
        op("b", TWO, 0, 1, 8),
        op("c", READ, 2, 10, 11),
    ],
    "an unanswered write that happened late": [
        op("a", ONE, None, 0, None),
        op("b", READ, 0, 5, 6),
        op("b", READ, 1, 7, 8),
    ],
    "an unanswered write that never happened": [op("a", ONE, None, 0, None), op("b", READ, 0, 5, 6)],
    "at the same instant nobody knows which came first": [op("a", ONE, 0, 0, 5), op("b", READ, 0, 5, 6)],
}
NOT_LINEARIZABLE = {
    "a stale read": [op("a", ONE, 0, 0, 1), op("b", READ, 0, 2, 3)],
    "a value from nowhere": [op("a", ONE, 0, 0, 1), op("b", READ, 7, 2, 3)],
    "a read before the write": [op("b", READ, 1, 0, 1), op("a", ONE, 0, 2, 3)],
    "new, then old": [
        op("a", ONE, 0, 0, 99),
        op("b", READ, 1, 1, 2),
        op("c", READ, 0, 3, 4),
    ],
    "two observers disagree about the order": [
        op("a", ONE, 0, 0, 1),
        op("b", TWO, 0, 0, 1),
        op("c", READ, 1, 2, 3),
        op("c", READ, 2, 4, 5),
    ],
    "an unanswered write that is undone": [
        op("a", ONE, None, 0, None),
        op("b", READ, 1, 5, 6),
        op("b", READ, 0, 7, 8),
    ],
}


@pytest.mark.parametrize("history", LINEARIZABLE.values(), ids=LINEARIZABLE)
def test_accepts(history: list[Seen]) -> None:
    verdict = check(Register(), history)
    assert verdict.linearizable, str(verdict)


@pytest.mark.parametrize("history", NOT_LINEARIZABLE.values(), ids=NOT_LINEARIZABLE)
def test_refutes(history: list[Seen]) -> None:
    verdict = check(Register(), history)
    assert not verdict.linearizable
    assert verdict.stuck
    assert "none of these can come next" in str(verdict)


def linearizable_by_brute_force(history: list[Seen]) -> bool:
    """Try every order of every choice of the operations that were never answered."""
    sure = [each for each in history if each.answered is not None]
    open_ended = [each for each in history if each.answered is None]
    chosen = (part for size in range(len(open_ended) + 1) for part in itertools.combinations(open_ended, size))
    return any(_possible(order) for part in chosen for order in itertools.permutations([*sure, *part]))


def _possible(order: tuple[Seen, ...]) -> bool:
    state: int | None = 0
    for position, each in enumerate(order):
        if any(later.answered is not None and later.answered < each.called for later in order[position + 1 :]):
            return False
        state = Register().step(state, each.call, each.answer)
        if state is None:
            return False
    return True


@st.composite
def histories(draw: st.DrawFn) -> list[Seen]:
    """Up to six operations of registers, the answers of which may or may not be right."""
    calls = draw(st.lists(st.sampled_from([READ, ONE, TWO]), max_size=6))
    history: list[Seen] = []
    for number, call in enumerate(calls):
        called = draw(st.integers(0, 12))
        answered = None if draw(st.integers(0, 4)) == 0 else called + draw(st.integers(1, 8))
        answer = None if answered is None else draw(st.integers(0, 2)) if call == READ else 0
        history.append(op(f"client {number}", call, answer, called, answered))
    return history


@given(histories())
def test_agrees_with_trying_every_order(history: list[Seen]) -> None:
    verdict = check(Register(), history)
    assert verdict.linearizable == linearizable_by_brute_force(history)
    if verdict.linearizable:
        assert _possible(verdict.order)


def test_calls_that_nobody_answered_do_not_double_the_search() -> None:
    calls = [ONE, TWO] * 20
    unanswered = [op(f"writer {number}", call, None, number, None) for number, call in enumerate(calls)]
    verdict = check(Register(), [*unanswered, op("reader", READ, 3, 200, 201)], most_steps=2000)
    assert not verdict.linearizable


def test_a_search_that_takes_too_long_is_undecided() -> None:
    writes = [op(f"writer {number}", ("write", number), 0, number, 100 + number) for number in range(1, 13)]
    history = [*writes, op("reader", READ, 99, 200, 201)]
    with pytest.raises(UndecidedError):
        check(Register(), history, most_steps=1000)
