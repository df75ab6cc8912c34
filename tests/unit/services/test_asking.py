"""Whoever cannot take up a request now is asked again, and is given up like one who stays silent."""

from __future__ import annotations

from skillwing.services.bus import Answered, Refused, Request
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.asking import ask_until_answered
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
        keep_asking=lambda silences: silences < patience,
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
