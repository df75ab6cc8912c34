"""Service of queries: each one gets a typed reply or a typed refusal."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

from skillwing.services.bus import Handle, Network, Request
from skillwing.services.core.attribution import attributed
from skillwing.services.core.refusal import RefusedError
from skillwing.services.protocol import ErrorCode, ErrorReply, Message, ProtocolError, decode, encode

M = TypeVar("M", bound=Message)
log = logging.getLogger(__name__)


def serve(bus: Network, key_expression: str, kind: type[M] | Any, answer: Callable[[M, str], Message]) -> Handle:
    """Answer each query on the key with `answer(message, key)`. With keys, the message has its sender's true name.

    kind: the `Message` class of the queries, or a union of tagged ones. A `RefusedError` of `answer` becomes its
    refusal, an unreadable payload BAD_REQUEST, and any other exception INTERNAL. The process continues; a request that
    ended in INTERNAL may have been carried out.
    """

    def on_request(request: Request) -> None:
        try:
            message = decode(request.payload, kind)
        except ProtocolError as error:
            request.refuse(
                ErrorReply(
                    code=ErrorCode.BAD_REQUEST,
                    message=f"The request cannot be read: {error}.",
                    help=f"Send a {_name(kind)} as defined in skillwing.services.protocol.",
                )
            )
            return
        try:
            request.reply(encode(answer(attributed(message, request.asker), request.key)))
        except RefusedError as error:
            request.refuse(error.reply)
        except Exception as error:  # noqa: BLE001 - `fail` logs it
            fail(request, error)

    def fail(request: Request, error: Exception) -> None:
        log.error("could not answer a query on %s", request.key, exc_info=error)
        text, advice = f"`{bus.name}` failed on this request: {error!r}.", "Its log has the traceback."
        request.refuse(ErrorReply(code=ErrorCode.INTERNAL, message=text, help=advice))

    return bus.serve(key_expression, on_request)


def _name(kind: Any) -> str:
    return getattr(kind, "__name__", str(kind))
