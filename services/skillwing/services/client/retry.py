"""Requests on a network that may stay silent: repeated until a reply arrives, or waited for once.

Silence is not an answer. It never means that the request was not carried out.
"""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answer, Answered, Bus, Loop, NoReply, Refused
from skillwing.services.errors import NoReplyError, RefusedError
from skillwing.services.protocol import ErrorCode

ANSWER_TIMEOUT = 4.0
"""Seconds after which a caller stops waiting; a query itself times out after 2 s."""
FIRST_DELAY = 0.05
LONGEST_DELAY = 1.0
CUT_OFF_DELAY = 0.25
"""Seconds between two attempts while this process is cut off. Its silence then proves nothing about others."""


def retry_delay(attempt: int) -> float:
    """Seconds to wait after the `attempt`-th silence (from 1): doubling from 0.05 s up to 1 s.

    0 stands for a silence that does not count, because this node was cut off.
    """
    if attempt == 0:
        return CUT_OFF_DELAY
    return min(LONGEST_DELAY, FIRST_DELAY * 2 ** min(attempt - 1, 16))


def ask_until_answered(
    bus: Bus,
    key: str,
    payload: bytes,
    on_answer: Callable[[Answered | Refused], None],
    *,
    keep_retrying: Callable[[int], bool] = lambda silences: True,
    on_silence: Callable[[], None] = lambda: None,
) -> None:
    """Send the same request until it is answered. The request has to be idempotent.

    After each silence `keep_retrying(number of silences)` decides: True repeats the request, False ends with
    `on_silence`. The refusal UNAVAILABLE counts as silence. While this node is cut off nothing is counted, and the
    count starts again at 0 when it is back. Delays are wall time: a robot clock that stands still must not stop them.
    """
    silences = 0

    def send() -> None:
        bus.ask(key, payload, receive)

    def receive(answer: Answer) -> None:
        nonlocal silences
        unavailable = isinstance(answer, Refused) and answer.error.code is ErrorCode.UNAVAILABLE
        if not (isinstance(answer, NoReply) or unavailable):
            on_answer(answer)
            return
        silences = silences + 1 if bus.connected else 0
        if keep_retrying(silences):
            bus.after(retry_delay(silences), send, wall=True)
        else:
            on_silence()

    send()


def accepted(answer: Answer | None, key: str) -> Answered:
    """The answer to what was asked at a key. Raises RefusedError if it is a refusal, NoReplyError for none."""
    match answer:
        case Answered():
            return answer
        case Refused(error):
            raise RefusedError(error.code, error.message, help=error.help, known=error.known)
        case _:
            raise NoReplyError(key)


def wait_for_answer(loop: Loop, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
    """Call `ask` with a callback and run the loop until that is called. Raises as `ask` and `accepted` do."""
    answers: list[Answer] = []
    ask(answers.append)
    loop.run_until(lambda: bool(answers), ANSWER_TIMEOUT)
    return accepted(answers[0] if answers else None, key)
