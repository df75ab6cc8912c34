"""How a node reads publications and answers queries: from bytes to messages, from errors to typed refusals."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from skillwing.onboard.commands.authority import RefusedError
from skillwing.onboard.topics.common import Done, Empty
from skillwing.services.bus import Request, Sample
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, ProtocolError, decode, encode

M = TypeVar("M", bound=Message)
S = TypeVar("S")
_log = logging.getLogger(__name__)


def stream_reader(read: Callable[[bytes, bytes], S], use: Callable[[S], object]) -> Callable[[Sample], None]:
    """A subscriber for payloads with attachments; `read` makes something of the two or raises ProtocolError."""

    def on_sample(sample: Sample) -> None:
        try:
            value = read(sample.payload, sample.attachment)
        except ProtocolError as error:
            _log.warning("dropped a publication on %s: %s", sample.key, error)
            return
        use(value)

    return on_sample


def answer_with(kind: type[M], act: Callable[[M], str]) -> Callable[[Request], None]:
    """A service for commands of a kind. `act` says in words what was done, or raises RefusedError."""
    return reply_with(kind, lambda wanted: Done(text=act(wanted)))


def reply_with(kind: type[M], make: Callable[[M], Message]) -> Callable[[Request], None]:
    """A service for questions of a kind. `make` makes the reply, or raises RefusedError."""

    def on_request(request: Request) -> None:
        wanted = read_question(request, kind)
        if wanted is None:
            return
        try:
            reply = make(wanted)
        except RefusedError as error:
            request.refuse(error.reply)
        else:
            request.reply(encode(reply))

    return on_request


def read_question(request: Request, kind: type[M]) -> M | None:
    """What is asked. None where it cannot be read: then the request has been refused."""
    try:
        return decode(request.payload, kind)
    except ProtocolError as error:
        wanted = "send an empty message" if kind is Empty else "check the message"
        request.refuse(ErrorReply(code=ErrorCode.BAD_REQUEST, message=str(error), help=wanted))
        return None
