"""Commands to the functional layer that get there, or whose failure becomes known."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answered, Bus, Refused
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.protocol import Message, encode

ATTEMPTS = 6


def _nothing() -> None:
    pass


def _ignore(_sentence: str) -> None:
    pass


class Command:
    """One command on its way, repeated while nobody answers, as a receiver may: it knows a repeated one by its goal.

    Exactly one of `on_taken()`, `on_refused(sentence)` and `on_silence()` is called, or none of them after `cancel`.
    """

    def __init__(
        self,
        bus: Bus,
        key: str,
        message: Message,
        *,
        on_taken: Callable[[], None] = _nothing,
        on_refused: Callable[[str], None] = _ignore,
        on_silence: Callable[[], None] = _nothing,
    ) -> None:
        self._on_taken, self._on_refused, self._on_silence = on_taken, on_refused, on_silence
        self._cancelled = False
        ask_until_answered(
            bus, key, encode(message), self._answered, keep_retrying=self._keep_retrying, on_silence=self._unanswered
        )

    def cancel(self) -> None:
        """Ask no more and report nothing. What is already under way may still be executed."""
        self._cancelled = True

    def _keep_retrying(self, silences: int) -> bool:
        return not self._cancelled and silences < ATTEMPTS

    def _answered(self, answer: Answered | Refused) -> None:
        if self._cancelled:
            return
        match answer:
            case Answered():
                self._on_taken()
            case Refused(error):
                self._on_refused(sentences(error.message, error.help))

    def _unanswered(self) -> None:
        if not self._cancelled:
            self._on_silence()


def sentences(*texts: str) -> str:
    """Texts of any origin as sentences, one after the other: capital first, full stop last."""
    return " ".join(f"{text[0].upper()}{text[1:].rstrip('.')}." for text in texts if text)
