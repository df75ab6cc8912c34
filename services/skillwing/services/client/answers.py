"""Answers for callers who wait: the reply, or an exception that says why there is none."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answer, Answered, Bus, Refused
from skillwing.services.errors import RefusedError, UnansweredError

ANSWER_TIMEOUT = 4.0
"""Seconds after which nobody is taken to be there; a query itself gives up after two."""


def accepted(answer: Answer | None, key: str) -> Answered:
    """The answer to what was asked at a key. Raises RefusedError if it is a refusal, UnansweredError for none."""
    match answer:
        case Answered():
            return answer
        case Refused(error):
            raise RefusedError(error.code, error.message, help=error.help, known=error.known)
        case _:
            raise UnansweredError(key)


def wait_for_answer(bus: Bus, key: str, ask: Callable[[Callable[[Answer], None]], None]) -> Answered:
    """Call `ask` with a callback and run the bus until that is called. Raises as `ask` and `accepted` do."""
    answers: list[Answer] = []
    ask(answers.append)
    bus.run_until(lambda: bool(answers), ANSWER_TIMEOUT)
    return accepted(answers[0] if answers else None, key)
