"""Subscribers that survive bad input: an invalid message is logged and dropped."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from skillwing.services.bus import Sample
from skillwing.services.protocol import Message, ProtocolError, decode

M = TypeVar("M", bound=Message)

log = logging.getLogger(__name__)


def message_reader(kind: type[M], act: Callable[[M], object]) -> Callable[[Sample], None]:
    """A subscriber that calls `act` with each message of `kind`."""

    def read(sample: Sample) -> None:
        try:
            message = decode(sample.payload, kind)
        except ProtocolError as error:
            log.warning("Left out a message on %s: %s", sample.key, error)
            return
        act(message)

    return read


def stream_reader(kind: type[M], act: Callable[[M, bytes], None]) -> Callable[[Sample], None]:
    """A subscriber of an array stream: calls `act` with its header of `kind` and its raw bytes.

    `act` raises ValueError for bytes that do not have the shape in the header.
    """

    def read(sample: Sample) -> None:
        try:
            act(decode(sample.attachment, kind), sample.payload)
        except (ProtocolError, ValueError) as error:
            log.warning("Left out an array on %s: %s", sample.key, error)

    return read
