"""Commands of skill managers to the functional layer, repeated until a reply."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answered, Bus, Refused
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.protocol import Message, encode

ATTEMPTS = 6


class SentCommand:
    """Handle of a command under way."""

    def __init__(self) -> None:
        self.cancelled = False

    def cancel(self) -> None:
        """Stop repeating it, and report nothing. A node may still execute what it has received."""
        self.cancelled = True


def send_command(
    bus: Bus,
    key: str,
    message: Message,
    *,
    on_accepted: Callable[[], None] = lambda: None,
    on_refused: Callable[[str], None] = lambda _sentence: None,
    on_silence: Callable[[], None] = lambda: None,
) -> SentCommand:
    """Send a command, and repeat it while there is no reply; the node recognises a repetition by its goal.

    Calls exactly one of `on_accepted()`, `on_refused(sentence)` and `on_silence()`, and none after `cancel`.
    """
    sent = SentCommand()

    def answered(answer: Answered | Refused) -> None:
        if sent.cancelled:
            return
        match answer:
            case Answered():
                on_accepted()
            case Refused(error):
                on_refused(sentences(error.message, error.help))

    def unanswered() -> None:
        if not sent.cancelled:
            on_silence()

    def keep_retrying(silences: int) -> bool:
        return not sent.cancelled and silences < ATTEMPTS

    ask_until_answered(bus, key, encode(message), answered, keep_retrying=keep_retrying, on_silence=unanswered)
    return sent


def sentences(*texts: str) -> str:
    """Texts as sentences, one after the other: capital first, full stop last."""
    return " ".join(f"{text[0].upper()}{text[1:].rstrip('.')}." for text in texts if text)
