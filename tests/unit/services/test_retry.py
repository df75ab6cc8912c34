"""UNAVAILABLE counts as silence: the request is repeated, and given up in the end."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from skillwing.services.bus import Answered, Refused, Request
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork
from skillwing.services.client.retry import CUT_OFF_DELAY, ask_until_answered
from skillwing.services.protocol import ErrorCode, ErrorReply


class Busy:
    """Refuses so many requests before it answers one."""

    def __init__(self, network: InProcessNetwork, refusals: int, code: ErrorCode = ErrorCode.UNAVAILABLE) -> None:
        self._refusal = ErrorReply(code=code, message="There is no room.", help="Ask again.")
        self._refusals = refusals
        self.asked = 0
        network.bus("busy").serve("x", self._take)

    def _take(self, request: Request) -> None:
        self.asked += 1
        if self.asked <= self._refusals:
            request.refuse(self._refusal)
        else:
            request.reply(b"done")


def ask(network: InProcessNetwork, patience: int) -> list[Answered | Refused | None]:
    """Ask for a minute; None stands for giving up."""
    told: list[Answered | Refused | None] = []
    ask_until_answered(
        network.bus("asker"),
        "x",
        b"",
        told.append,
        keep_retrying=lambda silences: silences < patience,
        on_silence=lambda: told.append(None),
    )
    network.run_for(60.0)
    return told


def test_unavailable_is_asked_again_until_somebody_answers() -> None:
    network = InProcessNetwork()
    busy = Busy(network, refusals=5)
    assert ask(network, patience=10) == [Answered(b"done")]
    assert busy.asked == 6


def test_who_stays_unavailable_is_given_up_once() -> None:
    network = InProcessNetwork()
    busy = Busy(network, refusals=100)
    assert ask(network, patience=4) == [None]
    assert busy.asked == 4


def test_any_other_refusal_is_an_answer() -> None:
    network = InProcessNetwork()
    busy = Busy(network, refusals=1, code=ErrorCode.INTERNAL)
    [told] = ask(network, patience=4)
    assert isinstance(told, Refused)
    assert told.error.code is ErrorCode.INTERNAL
    assert busy.asked == 1


def test_silence_does_not_count_while_cut_off_and_restarts_afterwards() -> None:
    network = InProcessNetwork()
    asker = network.bus("asker")
    assert isinstance(asker, InProcessBus)
    counts: list[tuple[float, int]] = []

    def keep_retrying(silences: int) -> bool:
        counts.append((network.now(), silences))
        return True

    ask_until_answered(asker, "nobody", b"", lambda answer: None, keep_retrying=keep_retrying)
    network.run_for(0.3)
    asker.given_up = True
    network.run_for(2.0)
    heard = [(when, silences) for when, silences in counts if when > 0.3]
    assert {silences for _, silences in heard} == {0}
    pauses = [later - earlier for (earlier, _), (later, _) in pairwise(heard)]
    assert len(pauses) > 3
    assert pauses == pytest.approx([CUT_OFF_DELAY] * len(pauses), abs=0.01)
    asker.given_up, back = False, network.now()
    network.run_for(1.0)
    assert [silences for when, silences in counts if when > back][:3] == [1, 2, 3]


def test_a_robot_clock_that_stands_still_is_no_reason_to_stop_asking(monkeypatch: pytest.MonkeyPatch) -> None:
    network = InProcessNetwork()
    busy = Busy(network, refusals=3)
    right = InProcessBus.after

    def after(self: InProcessBus, delay: float, action: Callable[[], None], *, wall: bool = False) -> object:
        return right(self, delay, action) if wall else None

    monkeypatch.setattr(InProcessBus, "after", after)
    assert ask(network, patience=10) == [Answered(b"done")]
    assert busy.asked == 4
