"""Services for commands and questions: bytes become messages, refusals become typed error replies."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from skillwing.onboard.topics.common import Done, Empty
from skillwing.services.bus import Request
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, ProtocolError, decode, encode

M = TypeVar("M", bound=Message)


class CommandRefusedError(Exception):
    """A command that a node refuses; `reply` holds the reason and advice."""

    def __init__(self, code: ErrorCode, message: str, advice: str, known: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.reply = ErrorReply(code=code, message=message, help=advice, known=known)


def answer_with(kind: type[M], act: Callable[[M], str]) -> Callable[[Request], None]:
    """A service for commands of a kind. `act` returns a sentence about the command, or raises CommandRefusedError."""
    return reply_with(kind, lambda wanted: Done(text=act(wanted)))


def reply_with(kind: type[M], make: Callable[[M], Message]) -> Callable[[Request], None]:
    """A service for questions of a kind. `make` makes the reply, or raises CommandRefusedError."""

    def on_request(request: Request) -> None:
        wanted = read_question(request, kind)
        if wanted is None:
            return
        try:
            reply = make(wanted)
        except CommandRefusedError as error:
            request.refuse(error.reply)
        else:
            request.reply(encode(reply))

    return on_request


def read_question(request: Request, kind: type[M]) -> M | None:
    """The decoded question; None if it is malformed, after refusing the request."""
    try:
        return decode(request.payload, kind)
    except ProtocolError as error:
        wanted = "send an empty message" if kind is Empty else "check the message"
        request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=str(error), help=wanted))
        return None
